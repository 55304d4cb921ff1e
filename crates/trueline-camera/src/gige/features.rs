//! Features of a camera: makers name the same thing differently.

use super::errors::feature;
use crate::error::CameraError;
use telegenic::GenICamera;

/// What makers call the exposure time, µs.
pub(super) const EXPOSURE: [&str; 2] = ["ExposureTime", "ExposureTimeAbs"];

/// Exposure time as the camera tells it, µs.
pub(super) fn exposure_us(camera: &mut GenICamera) -> Option<f64> {
    let name = EXPOSURE.into_iter().find(|name| camera.has_feature(name))?;
    camera.get_float(name).ok().filter(|us| us.is_finite())
}

/// A whole number that the camera must have.
///
/// # Errors
/// A feature that is missing, or no size.
pub(super) fn size(camera: &mut GenICamera, name: &str) -> Result<u32, CameraError> {
    let value = camera.get_integer(name).map_err(|e| feature(name, &e))?;
    u32::try_from(value)
        .map_err(|_| CameraError::Feature { name: name.to_owned(), why: format!("{value} is no size") })
}

/// Sets an enumeration where the camera has it.
pub(crate) fn set_if_there(camera: &mut GenICamera, name: &str, entry: &str) -> Result<(), CameraError> {
    if !camera.has_feature(name) {
        return Ok(());
    }
    // Some cameras show what they are as an enumeration that cannot be written.
    if camera.get_enum(name).is_ok_and(|now| now == entry) {
        return Ok(());
    }
    camera.set_enum(name, entry).map_err(|e| feature(name, &e))
}

/// Sets a number that the camera has by one of these names.
///
/// # Errors
/// A camera that has none of them, or takes other numbers.
pub(super) fn set_one_of(camera: &mut GenICamera, names: &[&str], value: f64) -> Result<(), CameraError> {
    let Some(name) = names.iter().find(|name| camera.has_feature(name)) else {
        let why = "the camera has no such feature".to_owned();
        return Err(CameraError::Feature { name: names[0].to_owned(), why });
    };
    if let Ok((least, most)) = camera.float_bounds(name)
        && !(least..=most).contains(&value)
    {
        let why = format!("{value} was asked for, the camera takes {least} to {most}");
        return Err(CameraError::Feature { name: (*name).to_owned(), why });
    }
    camera.set_float(name, value).map_err(|e| feature(name, &e))
}
