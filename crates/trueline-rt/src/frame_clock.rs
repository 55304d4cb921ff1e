//! When a frame was stamped, by the clock of the frames.

use crate::envelope_clock::{EnvelopeClock, Trust};
use crate::error::PlaceError;
use crate::settings::StampRule;
use crate::stamps::{self, is_stamp, seconds};

/// The origin of the clock's times moves along after so long, s.
const REBASE_S: f64 = 1000.0;

/// The stamp of a frame, made regular if that is wanted.
#[derive(Debug)]
pub(crate) struct FrameClock {
    clock: Option<EnvelopeClock>,
    origin_ns: Option<i64>,
    last: Option<(i64, Result<FrameTime, PlaceError>)>,
}

/// The time, ns, and its uncertainty, s.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FrameTime {
    pub stamp_ns: i64,
    pub sigma_s: f64,
}

impl FrameClock {
    pub(crate) fn new(rule: StampRule) -> Self {
        let clock = (rule == StampRule::LowerEnvelope).then(EnvelopeClock::new);
        Self { clock, origin_ns: None, last: None }
    }

    pub(crate) fn clock(&self) -> Option<&EnvelopeClock> {
        self.clock.as_ref()
    }

    /// The time of a frame. The same stamp again is the same frame.
    pub(crate) fn time(&mut self, stamp_ns: i64) -> Result<FrameTime, PlaceError> {
        if !is_stamp(stamp_ns) {
            return Err(PlaceError::StampOutOfRange);
        }
        let Some(clock) = &mut self.clock else { return Ok(FrameTime { stamp_ns, sigma_s: 0.0 }) };
        if let Some((_, time)) = self.last.filter(|(last_ns, _)| *last_ns == stamp_ns) {
            return time;
        }
        let mut origin_ns = *self.origin_ns.get_or_insert(stamp_ns);
        let arrival_s = seconds(stamp_ns, origin_ns);
        let dated = clock.date(arrival_s);
        let time = match dated {
            None => Err(PlaceError::FramesUnsettled),
            Some(dated) if dated.trust != Trust::Sure => {
                Err(PlaceError::StampJumped { late_s: dated.late_s })
            }
            Some(dated) => {
                Ok(FrameTime { stamp_ns: stamps::stamp(dated.time_s, origin_ns), sigma_s: dated.sigma_s })
            }
        };
        if arrival_s.abs() > REBASE_S {
            clock.rebase(arrival_s);
            origin_ns = stamp_ns;
            self.origin_ns = Some(origin_ns);
        }
        self.last = Some((stamp_ns, time));
        time
    }
}
