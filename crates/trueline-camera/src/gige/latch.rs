//! Asks a GigE Vision camera for its time.

use super::stamps::LatchStamps;
use crate::genicam::{Latched, is_silence};
use std::time::Duration;
use telegenic::gige::GigECamera;
use telegenic::gige::proto::bootstrap::{TIMESTAMP_CONTROL, TIMESTAMP_LATCHED_HIGH, TIMESTAMP_LATCHED_LOW};
use telegenic::{CameraError as Driver, GenicamError};

/// Bit of the control register that latches the clock.
const LATCH: u32 = 2;
/// Longer than the driver repeats a command.
const WAIT: Duration = Duration::from_secs(2);

/// Latches the clock and reads it.
pub(super) fn latched(camera: &GigECamera, stamps: &LatchStamps) -> Latched {
    match exchange(camera) {
        Ok(ticks) => Latched::At(ticks, stamps.take_answered_ns()),
        Err(error) if is_silence(&error) => Latched::Silence,
        Err(_) => Latched::No,
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
