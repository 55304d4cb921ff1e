//! Asking the camera what time it is.

use super::errors::is_silence;
use super::stamps::LatchStamps;
use crate::latch_clock::LatchSample;
use std::time::Duration;
use telegenic::gige::GigECamera;
use telegenic::gige::proto::bootstrap::{TIMESTAMP_CONTROL, TIMESTAMP_LATCHED_HIGH, TIMESTAMP_LATCHED_LOW};
use telegenic::{CameraError as Driver, GenicamError};
use trueline_live::HostClock;

/// Bit of the control register that latches the clock.
const LATCH: u32 = 2;
/// Longer than the driver repeats a command.
const WAIT: Duration = Duration::from_secs(2);

/// What came of asking.
pub(super) enum Asked {
    /// An exchange.
    Answer(LatchSample),
    /// The camera cannot, or not this time.
    No,
    /// The camera did not answer.
    Silence,
}

/// Asks.
pub(super) struct Latch {
    clock: HostClock,
    stamps: LatchStamps,
    /// Some cameras take the command and never move the value.
    last_ticks: Option<u64>,
    unsupported: bool,
}

impl Latch {
    /// Has asked nothing yet.
    pub(super) fn new(clock: HostClock, stamps: LatchStamps) -> Self {
        Self { clock, stamps, last_ticks: None, unsupported: false }
    }

    /// One exchange; `device_ns` makes nanoseconds of ticks.
    pub(super) fn ask(&mut self, camera: &GigECamera, device_ns: impl Fn(u64) -> i64) -> Asked {
        if self.unsupported {
            return Asked::No;
        }
        let before_ns = self.clock.read().steady_ns;
        let ticks = match exchange(camera) {
            Ok(ticks) => ticks,
            Err(error) if is_silence(&error) => return Asked::Silence,
            Err(_) => {
                self.unsupported = true;
                return Asked::No;
            }
        };
        let now_ns = self.clock.read().steady_ns;
        if ticks == 0 || self.last_ticks == Some(ticks) {
            self.unsupported = true;
            return Asked::No;
        }
        let first = self.last_ticks.replace(ticks).is_none();
        let after_ns = self.stamps.take_answered_ns().unwrap_or(now_ns).clamp(before_ns, now_ns);
        // A value that was seen once may be one that never moves.
        if first {
            return self.ask(camera, device_ns);
        }
        Asked::Answer(LatchSample { before_ns, device_ns: device_ns(ticks), after_ns })
    }
}

fn exchange(camera: &GigECamera) -> Result<u64, GenicamError> {
    let shared = |error: std::sync::Arc<Driver>| match &*error {
        Driver::Timeout => Driver::Timeout,
        Driver::Disconnected => Driver::Disconnected,
        Driver::ControlLost => Driver::ControlLost,
        other => Driver::Protocol(other.to_string()),
    };
    camera.write_register(TIMESTAMP_CONTROL, LATCH)?.wait_timeout(WAIT).map_err(shared)?;
    let values = camera
        .read_registers(vec![TIMESTAMP_LATCHED_HIGH, TIMESTAMP_LATCHED_LOW])?
        .wait_timeout(WAIT)
        .map_err(shared)?;
    match values.as_slice() {
        [high, low] => Ok(u64::from(*high) << 32 | u64::from(*low)),
        _ => Err(GenicamError::Camera(Driver::Protocol("two registers were asked for".to_owned()))),
    }
}
