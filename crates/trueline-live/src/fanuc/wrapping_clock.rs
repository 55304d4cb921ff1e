//! A counter of time that wraps at an unstated value: R-30iB's µs wrap at about 1.29·10⁸, others at 2³².

/// Unwraps it by the packets' own numbers.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct WrappingClock {
    last: Option<(u32, i64)>,
    period_ns: Option<i64>,
}

/// A step forward of more than this many periods for each number is not a step of the clock.
const MOST_PERIODS: i64 = 3;

impl WrappingClock {
    /// Time of the packet that comes `number` packets after the last one, ns. A new session begins at the counter's
    /// value.
    pub(crate) fn unwrapped_ns(&mut self, ticks: u32, tick_ns: i64, numbers: Option<u32>) -> i64 {
        let raw_ns = i64::from(ticks) * tick_ns;
        let at_ns = match (self.last, numbers) {
            (Some((last_ticks, last_ns)), Some(numbers)) => {
                let numbers = i64::from(numbers).max(1);
                let ahead_ns = raw_ns - i64::from(last_ticks) * tick_ns;
                let plausible_ns = self.period_ns.map_or(i64::MAX, |ns| MOST_PERIODS * ns * numbers);
                if (0..=plausible_ns).contains(&ahead_ns) {
                    if ahead_ns > 0 {
                        let period_ns = ahead_ns / numbers;
                        self.period_ns =
                            Some(self.period_ns.map_or(period_ns, |ns| ns.min(period_ns).max(1)));
                    }
                    last_ns + ahead_ns
                } else {
                    // It wrapped, or one packet's clock is wrong: as much has passed as the numbers say.
                    last_ns + self.period_ns.unwrap_or(0) * numbers
                }
            }
            _ => raw_ns,
        };
        self.last = Some((ticks, at_ns));
        at_ns
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_goes_on_evenly_wherever_the_counter_wraps() {
        for modulus in [129_000_000_u64, 1 << 32] {
            let mut clock = WrappingClock::default();
            let begins = modulus - 50 * 8000;
            let at = |k: u64| ((begins + k * 8000) % modulus) as u32;
            let first_ns = clock.unwrapped_ns(at(0), 1000, None);
            for k in 1..200_u64 {
                let at_ns = clock.unwrapped_ns(at(k), 1000, Some(1));
                assert_eq!(at_ns - first_ns, k as i64 * 8_000_000, "{modulus}: {k}");
            }
            // Ten packets lost just there.
            assert_eq!(clock.unwrapped_ns(at(210), 1000, Some(11)) - first_ns, 210 * 8_000_000);
        }
    }

    #[test]
    fn one_wrong_stamp_is_bridged() {
        let mut clock = WrappingClock::default();
        let stamps = [0_u32, 8000, 16_000, 3_999_999_999, 32_000, 40_000];
        let found: Vec<i64> = stamps
            .iter()
            .enumerate()
            .map(|(k, ticks)| clock.unwrapped_ns(*ticks, 1000, (k > 0).then_some(1)))
            .collect();
        assert_eq!(found, [0, 8, 16, 24, 32, 40].map(|ms| ms * 1_000_000));
    }
}
