//! How late the messages of a stream arrive.

/// Delays of messages since the last report: from the stamp in the header to the arrival here. It contains the difference
/// of the clocks if the sender is another PC.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct StreamLag {
    messages: u32,
    sum_s: f64,
    most_s: f64,
}

impl StreamLag {
    /// Notes a message, by its stamp and its arrival, ns since 1970.
    pub(crate) fn note(&mut self, stamp_ns: i64, arrived_ns: i64) {
        let late_s = (i128::from(arrived_ns) - i128::from(stamp_ns)) as f64 * 1e-9;
        self.most_s = if self.messages == 0 { late_s } else { self.most_s.max(late_s) };
        self.sum_s += late_s;
        self.messages += 1;
    }

    /// Mean and largest delay in words, and begins anew.
    pub(crate) fn report(&mut self) -> String {
        let Self { messages, sum_s, most_s } = std::mem::take(self);
        if messages == 0 {
            return "no message".to_owned();
        }
        let mean_ms = 1e3 * sum_s / f64::from(messages);
        format!("mean {mean_ms:.1} ms, at most {:.1} ms", most_s * 1e3)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn delays_are_those_since_the_last_report() {
        let mut lag = StreamLag::default();
        assert_eq!(lag.report(), "no message");
        for (stamp_ms, arrived_ms) in [(10, 12), (20, 24), (30, 29)] {
            lag.note(stamp_ms * 1_000_000, arrived_ms * 1_000_000);
        }
        assert_eq!(lag.report(), "mean 1.7 ms, at most 4.0 ms");
        // The sender's clock is ahead.
        lag.note(50_000_000, 20_000_000);
        assert_eq!(lag.report(), "mean -30.0 ms, at most -30.0 ms");
        lag.note(i64::MIN, i64::MAX);
    }
}
