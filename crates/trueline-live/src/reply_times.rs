//! Delays of answers, from the kernel's stamp of a frame until its answer is sent.

use hdrhistogram::Histogram;

/// Counts of answers by time; as large after ten minutes as after one.
#[derive(Clone, Debug)]
pub struct ReplyTimes {
    microseconds: Histogram<u32>,
}

/// Longest separate time, µs.
const LONGEST_US: u64 = 10_000_000;

impl Default for ReplyTimes {
    fn default() -> Self {
        // Two digits: 1 % of each time.
        let microseconds = Histogram::new_with_bounds(1, LONGEST_US, 2);
        Self { microseconds: microseconds.unwrap_or_else(|_| unreachable!("the bounds are in order")) }
    }
}

impl ReplyTimes {
    /// Counts one, ns.
    pub fn add(&mut self, took_ns: i64) {
        let microseconds = u64::try_from(took_ns / 1000).unwrap_or(0);
        self.microseconds.saturating_record(microseconds);
    }

    /// Number of answers.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.microseconds.len()
    }

    /// Time within which a share of the answers was sent, ms.
    #[must_use]
    pub fn within_ms(&self, share: f64) -> f64 {
        self.microseconds.value_at_quantile(share) as f64 * 1e-3
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tells_shares_to_a_percent() {
        let mut times = ReplyTimes::default();
        for k in 1..=1000 {
            times.add(k * 10_000);
        }
        times.add(-5);
        assert_eq!(times.count(), 1001);
        for (share, expected_ms) in [(0.5, 5.0), (0.99, 9.9), (1.0, 10.0)] {
            assert!((times.within_ms(share) / expected_ms - 1.0).abs() < 0.02);
        }
    }
}
