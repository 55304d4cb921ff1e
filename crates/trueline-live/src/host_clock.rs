//! The PC's clocks: one that people read, which can be set, and one that only goes forward.
//!
//! Everything is stamped on the steady one, continued from what the wall clock said at the start. A wall clock that is
//! set during a scan then tears nothing; that it was set is told.

use std::time::{Instant, SystemTime, UNIX_EPOCH};

/// Both clocks at one moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reading {
    /// Wall clock at the start plus time since, ns since 1970.
    pub steady_ns: i64,
    /// Wall clock now, ns since 1970.
    pub wall_ns: i64,
}

impl Reading {
    /// How far the wall clock has moved away from the steady one, ns.
    #[must_use]
    pub fn wall_ahead_ns(&self) -> i64 {
        self.wall_ns - self.steady_ns
    }
}

/// The clocks, from a common start.
#[derive(Clone, Copy, Debug)]
pub struct HostClock {
    start: Instant,
    wall_at_start_ns: i64,
}

impl HostClock {
    /// Starts now.
    #[must_use]
    pub fn start() -> Self {
        Self { start: Instant::now(), wall_at_start_ns: wall_ns() }
    }

    /// Reads both.
    #[must_use]
    pub fn read(&self) -> Reading {
        let since_ns = i64::try_from(self.start.elapsed().as_nanos()).unwrap_or(i64::MAX);
        Reading { steady_ns: self.wall_at_start_ns.saturating_add(since_ns), wall_ns: wall_ns() }
    }

    /// The steady stamp of something that the kernel stamped by the wall clock, ns; `None` if the two cannot belong
    /// together because the clock was set in between.
    #[must_use]
    pub fn steady_ns(read: Reading, kernel_wall_ns: i64) -> Option<i64> {
        let age_ns = read.wall_ns - kernel_wall_ns;
        (-CLOCKS_APART_NS..OLDEST_NS).contains(&age_ns).then(|| read.steady_ns - age_ns)
    }
}

/// The two clocks are not read at the same instant, ns.
const CLOCKS_APART_NS: i64 = 1_000_000;
/// Nothing waits longer than this in a socket that is being read, ns.
const OLDEST_NS: i64 = 2_000_000_000;

fn wall_ns() -> i64 {
    // Before 1970 and after 2262 there is no scan.
    SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .map_or(0, |d| i64::try_from(d.as_nanos()).unwrap_or(i64::MAX))
}

/// Watches for a wall clock that is set.
#[derive(Clone, Copy, Debug, Default)]
pub struct StepWatch {
    last: Option<Reading>,
}

/// A clock that is being slewed moves by at most this share of the time (`adjtimex(2)`: 500 ppm), ns a ns.
const SLEW: f64 = 6e-4;

impl StepWatch {
    /// By how much the wall clock was set since the last look, ns; `None` if it was not.
    pub fn step_ns(&mut self, now: Reading) -> Option<i64> {
        let last = self.last.replace(now)?;
        let moved_ns = now.wall_ahead_ns() - last.wall_ahead_ns();
        let allowed_ns = CLOCKS_APART_NS as f64 + SLEW * (now.steady_ns - last.steady_ns) as f64;
        (moved_ns.unsigned_abs() as f64 > allowed_ns).then_some(moved_ns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND_NS: i64 = 1_000_000_000;

    #[test]
    fn a_set_clock_is_seen_and_a_slewed_one_is_not() {
        let mut watch = StepWatch::default();
        let at =
            |s: i64, ahead_ns: i64| Reading { steady_ns: s * SECOND_NS, wall_ns: s * SECOND_NS + ahead_ns };
        assert_eq!(watch.step_ns(at(0, 0)), None);
        // 500 ppm for ten seconds are 5 ms.
        assert_eq!(watch.step_ns(at(10, 5_000_000)), None);
        assert_eq!(watch.step_ns(at(11, 5_000_000 - 30 * SECOND_NS)), Some(-30 * SECOND_NS));
        assert_eq!(watch.step_ns(at(12, 5_000_000 - 30 * SECOND_NS)), None);
    }

    #[test]
    fn a_kernel_stamp_keeps_its_age_whatever_the_wall_clock_says() {
        let read = Reading { steady_ns: 70 * SECOND_NS, wall_ns: 9 * SECOND_NS };
        assert_eq!(HostClock::steady_ns(read, 9 * SECOND_NS - 400_000), Some(70 * SECOND_NS - 400_000));
        assert_eq!(HostClock::steady_ns(read, 69 * SECOND_NS), None, "the clock was set in between");
    }
}
