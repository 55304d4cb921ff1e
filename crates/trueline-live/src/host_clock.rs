//! The PC's clocks: one that people read, which can be set, and one that only goes forward.
//!
//! Everything is stamped on the steady one, continued from the wall clock at the start. Setting the wall clock during
//! a scan then tears nothing; the change is reported.

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
    pub(crate) fn wall_ahead_ns(&self) -> i64 {
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

    /// Reads both at one moment.
    #[must_use]
    pub fn read(&self) -> Reading {
        read_at_once(|| self.steady(), wall_ns)
    }

    fn steady(&self) -> i64 {
        let since_ns = i64::try_from(self.start.elapsed().as_nanos()).unwrap_or(i64::MAX);
        self.wall_at_start_ns.saturating_add(since_ns)
    }

    /// The steady stamp of something that the kernel stamped by the wall clock, ns; `None` if the two cannot belong together
    /// because the clock was set in between. [`KernelStamps`] also uses the earlier stamps, and so needs no such bound.
    #[must_use]
    pub fn steady_ns(read: Reading, kernel_wall_ns: i64) -> Option<i64> {
        let age_ns = read.wall_ns - kernel_wall_ns;
        (-CLOCKS_APART_NS..OLDEST_NS).contains(&age_ns).then(|| read.steady_ns - age_ns)
    }
}

/// Both clocks, with the wall clock read between two readings of the steady one. A thread that is suspended in between would
/// shift them against each other, and the kernel's stamps with them. Of several tries the quickest counts.
fn read_at_once(steady_ns: impl Fn() -> i64, wall_ns: impl Fn() -> i64) -> Reading {
    let once = || {
        let before_ns = steady_ns();
        let wall_ns = wall_ns();
        let took_ns = steady_ns() - before_ns;
        (took_ns, Reading { steady_ns: before_ns + took_ns / 2, wall_ns })
    };
    let mut quickest = once();
    for _ in 1..TRIES {
        if quickest.0 < AT_ONCE_NS {
            break;
        }
        let next = once();
        if next.0 < quickest.0 {
            quickest = next;
        }
    }
    quickest.1
}

/// Readings within this are of one moment, ns: three looks at a clock take a tenth of it.
const AT_ONCE_NS: i64 = 2_000;
/// Most tries.
const TRIES: usize = 5;

impl HostClock {
    /// How far the machine's own steady clock, which all programs on it share, is ahead of this one, ns. This one starts
    /// with the wall clock at the start of the program. Two programs differ by any change of the wall clock in between.
    #[must_use]
    pub fn machine_ahead_ns(&self) -> i64 {
        machine_ns() - self.read().steady_ns
    }
}

#[cfg(target_os = "linux")]
fn machine_ns() -> i64 {
    use nix::time::{ClockId, clock_gettime};
    clock_gettime(ClockId::CLOCK_MONOTONIC).map_or(0, |now| now.tv_sec() * 1_000_000_000 + now.tv_nsec())
}

/// Elsewhere programs share the wall clock.
#[cfg(not(target_os = "linux"))]
fn machine_ns() -> i64 {
    wall_ns()
}

/// Nothing waits longer than this in a socket that is being read, ns: no buffer holds more of a camera's packets.
const OLDEST_NS: i64 = 60_000_000_000;

/// Puts the kernel's stamps, which are of the wall clock, on the steady one. Datagrams come in order, so a stamp is right if it
/// lies between the one before and now, however long the datagram waited.
#[derive(Clone, Copy, Debug)]
pub struct KernelStamps {
    newest_ns: i64,
    wall: StepWatch,
    /// How far the wall clock was ahead before it was last set, ns.
    ahead_before_step_ns: Option<i64>,
}

impl KernelStamps {
    /// For datagrams that come from now on.
    #[must_use]
    pub fn since(now: Reading) -> Self {
        Self { newest_ns: now.steady_ns, wall: StepWatch { last: Some(now) }, ahead_before_step_ns: None }
    }

    /// The steady stamp of a datagram that was read just now, ns; `None` if its stamp fits no clock there was.
    pub fn steady_ns(&mut self, read: Reading, kernel_wall_ns: i64) -> Option<i64> {
        if let Some(step_ns) = self.wall.step_ns(read) {
            self.ahead_before_step_ns = Some(read.wall_ahead_ns() - step_ns);
        }
        let possible = self.newest_ns - CLOCKS_APART_NS..=read.steady_ns + CLOCKS_APART_NS;
        let aheads = [Some(read.wall_ahead_ns()), self.ahead_before_step_ns];
        let stamps = aheads.into_iter().flatten().map(|ahead_ns| kernel_wall_ns.saturating_sub(ahead_ns));
        let stamp_ns = stamps.into_iter().find(|stamp_ns| possible.contains(stamp_ns))?;
        self.newest_ns = self.newest_ns.max(stamp_ns);
        Some(stamp_ns)
    }
}

/// The two clocks are not read at the same instant, ns.
const CLOCKS_APART_NS: i64 = 1_000_000;

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
    use std::cell::Cell;

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

    /// A thread that is put aside for 3 ms between its looks at the clocks, the first times or always.
    #[test]
    fn both_clocks_are_read_at_one_moment_though_the_thread_is_put_aside_in_between() {
        for (put_aside_times, most_apart_ns) in [(0, 50), (1, 50), (4, 50), (100, 3_000_000)] {
            let (now_ns, times) = (Cell::new(0), Cell::new(0));
            let look = |then_ns: i64| {
                let seen_ns = now_ns.get() + 25;
                now_ns.set(seen_ns + then_ns);
                seen_ns
            };
            let wall_ns = || {
                times.set(times.get() + 1);
                look(if times.get() <= put_aside_times { 3_000_000 } else { 0 })
            };
            let read = read_at_once(|| look(0), wall_ns);
            assert!(read.wall_ahead_ns().abs() <= most_apart_ns, "{put_aside_times}: {read:?}");
        }
    }

    fn at(steady_s: i64, wall_s: i64) -> Reading {
        Reading { steady_ns: steady_s * SECOND_NS, wall_ns: wall_s * SECOND_NS }
    }

    #[test]
    fn a_kernel_stamp_keeps_its_age_however_old_it_is() {
        let mut stamps = KernelStamps::since(at(10, 10));
        // The program was held up for 50 s; the datagrams waited for 49 s and less.
        for waited_ns in [49 * SECOND_NS, 3 * SECOND_NS, 2 * SECOND_NS + 1, 400_000] {
            let stamp = stamps.steady_ns(at(60, 60), 60 * SECOND_NS - waited_ns);
            assert_eq!(stamp, Some(60 * SECOND_NS - waited_ns));
        }
    }

    #[test]
    fn a_kernel_stamp_from_before_the_clock_was_set_is_put_where_it_belongs() {
        for wall_s in [9, 85, 1_000_000] {
            let mut stamps = KernelStamps::since(at(60, 60));
            let read = at(70, wall_s);
            // Two waited since before the clock was set, one came after.
            assert_eq!(stamps.steady_ns(read, 61 * SECOND_NS), Some(61 * SECOND_NS), "{wall_s}");
            assert_eq!(stamps.steady_ns(read, 65 * SECOND_NS), Some(65 * SECOND_NS), "{wall_s}");
            let after = stamps.steady_ns(read, wall_s * SECOND_NS - 400_000);
            assert_eq!(after, Some(70 * SECOND_NS - 400_000), "{wall_s}");
        }
        let mut stamps = KernelStamps::since(at(60, 60));
        assert_eq!(stamps.steady_ns(at(70, 70), 3 * SECOND_NS), None, "from before the socket was there");
        assert_eq!(stamps.steady_ns(at(70, 70), 90 * SECOND_NS), None, "from the future");
    }
}
