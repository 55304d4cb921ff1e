//! Automatics move the instant of an exposure from picture to picture: they must be off and stay off.

use super::features::{Features, exposure_us, set_if_there};
use crate::error::CameraError;
use std::time::{Duration, Instant};

const AUTOMATICS: [&str; 2] = ["ExposureAuto", "GainAuto"];
/// Between two looks.
const EVERY: Duration = Duration::from_secs(1);

/// Turns them off.
///
/// # Errors
/// One that cannot be turned off.
pub(super) fn turn_off(camera: &mut dyn Features) -> Result<(), CameraError> {
    AUTOMATICS.into_iter().try_for_each(|name| set_if_there(camera, name, "Off"))
}

/// Looks now and then whether they stayed off.
pub(crate) struct Watch {
    due: Instant,
}

impl Watch {
    /// The first look is due after the usual time.
    pub(crate) fn start() -> Self {
        Self { due: Instant::now() + EVERY }
    }

    /// Looks if it is time, and takes the exposure time, µs; `false` where the camera does not answer.
    ///
    /// # Errors
    /// [`CameraError::ExposureAuto`] if one is on.
    pub(crate) fn look(
        &mut self,
        camera: &mut dyn Features,
        taken_us: &mut Option<f64>,
    ) -> Result<bool, CameraError> {
        if Instant::now() < self.due {
            return Ok(true);
        }
        self.due = Instant::now() + EVERY;
        // Another program turned it on, so the driver's memory is worthless.
        let _ = camera.forget();
        for name in AUTOMATICS {
            match camera.get_enum(name) {
                Ok(value) if value == "Off" => {}
                Ok(value) => return Err(CameraError::ExposureAuto { feature: name.to_owned(), value }),
                Err(refusal) if refusal.is_silence() => return Ok(false),
                // The camera has no such automatic.
                Err(_) => {}
            }
        }
        *taken_us = exposure_us(camera);
        Ok(true)
    }
}
