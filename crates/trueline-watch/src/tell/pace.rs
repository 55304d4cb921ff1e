//! How often a courier looks for messages, and how long it waits for a receiver.

use std::time::Duration;

/// Between tries at most, s.
const LONGEST_WAIT_S: i64 = 600;

/// The pace of telling; the default is that of a factory, tests are quicker.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pace {
    /// How long one try may take: connecting, sending and the answer together.
    pub patience: Duration,
    /// Between looks for new messages.
    pub look_every: Duration,
    /// Time between tries at first, s; doubled each time, up to ten minutes.
    pub first_wait_s: i64,
}

impl Default for Pace {
    fn default() -> Self {
        Self { patience: Duration::from_secs(10), look_every: Duration::from_secs(1), first_wait_s: 2 }
    }
}

impl Pace {
    /// Waiting time after a number of tries, s.
    pub(super) fn wait_s(&self, tries: u32) -> i64 {
        (self.first_wait_s << tries.min(10)).min(LONGEST_WAIT_S)
    }

    /// A message that was taken is due again after this, s: longer than a try can take.
    pub(super) fn taken_for_s(&self) -> i64 {
        3 * self.patience.as_secs().cast_signed()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waits_double_up_to_ten_minutes() {
        let pace = Pace::default();
        let waits: Vec<i64> = [0, 1, 2, 8, 9, 40, u32::MAX].map(|tries| pace.wait_s(tries)).to_vec();
        assert_eq!(waits, [2, 4, 8, 512, 600, 600, 600]);
        assert_eq!(pace.taken_for_s(), 30);
        assert_eq!((pace.patience.as_secs(), pace.look_every.as_secs()), (10, 1));
    }
}
