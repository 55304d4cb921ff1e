//! Asks the camera for its time.

use crate::latch_clock::LatchSample;
use trueline_live::HostClock;

/// Result of a request.
pub(crate) enum Asked {
    /// An exchange.
    Answer(LatchSample),
    /// The camera cannot, or not this time.
    No,
    /// The camera did not answer.
    Silence,
}

/// Answer of the camera.
pub(crate) enum Latched {
    /// Its clock, ticks, and when the answer to the latch came by the steady clock, ns; `None` if that is not known.
    At(u64, Option<i64>),
    /// It cannot.
    No,
    /// It did not.
    Silence,
}

/// Asks.
pub(crate) struct Latch {
    clock: HostClock,
    /// Some cameras take the command and never move the value.
    last_ticks: Option<u64>,
    unsupported: bool,
}

impl Latch {
    /// Has asked nothing yet.
    pub(crate) fn new(clock: HostClock) -> Self {
        Self { clock, last_ticks: None, unsupported: false }
    }

    /// One exchange; `device_ns` makes nanoseconds of ticks.
    pub(crate) fn ask(&mut self, exchange: impl Fn() -> Latched, device_ns: impl Fn(u64) -> i64) -> Asked {
        loop {
            if self.unsupported {
                return Asked::No;
            }
            let before_ns = self.clock.read().steady_ns;
            let (ticks, answered_ns) = match exchange() {
                Latched::At(ticks, answered_ns) => (ticks, answered_ns),
                Latched::Silence => return Asked::Silence,
                Latched::No => {
                    self.unsupported = true;
                    continue;
                }
            };
            let now_ns = self.clock.read().steady_ns;
            if ticks == 0 || self.last_ticks == Some(ticks) {
                self.unsupported = true;
                continue;
            }
            let is_first = self.last_ticks.replace(ticks).is_none();
            let after_ns = answered_ns.unwrap_or(now_ns).clamp(before_ns, now_ns);
            // A value that was read only once may be a constant.
            if !is_first {
                return Asked::Answer(LatchSample { before_ns, device_ns: device_ns(ticks), after_ns });
            }
        }
    }
}
