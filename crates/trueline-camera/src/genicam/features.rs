//! Features of a camera by name, for any wire; makers name the same thing differently.

use super::refusal::Refusal;
use crate::error::CameraError;

/// Makers' names of the exposure time, µs.
pub(super) const EXPOSURE: [&str; 2] = ["ExposureTime", "ExposureTimeAbs"];

/// The features of a camera.
///
/// # Errors
/// Each call reports a missing feature, one that cannot be read or set to the value, and a camera that does not answer.
pub(crate) trait Features {
    /// Whether the camera's description has it.
    fn has_feature(&self, name: &str) -> bool;
    /// A whole number.
    fn get_integer(&mut self, name: &str) -> Result<i64, Refusal>;
    /// Sets a whole number.
    fn set_integer(&mut self, name: &str, value: i64) -> Result<(), Refusal>;
    /// The least and the largest whole number that it takes.
    fn integer_bounds(&mut self, name: &str) -> Result<(i64, i64), Refusal>;
    /// Between two whole numbers that it takes.
    fn integer_increment(&mut self, name: &str) -> Result<i64, Refusal>;
    /// A number.
    fn get_float(&mut self, name: &str) -> Result<f64, Refusal>;
    /// Sets a number.
    fn set_float(&mut self, name: &str, value: f64) -> Result<(), Refusal>;
    /// The least and the largest number that it takes.
    fn float_bounds(&mut self, name: &str) -> Result<(f64, f64), Refusal>;
    /// A switch.
    fn get_boolean(&mut self, name: &str) -> Result<bool, Refusal>;
    /// Sets a switch.
    fn set_boolean(&mut self, name: &str, value: bool) -> Result<(), Refusal>;
    /// An enumeration's entry.
    fn get_enum(&mut self, name: &str) -> Result<String, Refusal>;
    /// Sets an enumeration.
    fn set_enum(&mut self, name: &str, entry: &str) -> Result<(), Refusal>;
    /// An enumeration's entries.
    fn enum_entries(&mut self, name: &str) -> Result<Vec<String>, Refusal>;
    /// Executes a command.
    fn execute(&mut self, name: &str) -> Result<(), Refusal>;
    /// Forgets the read values: another program may have changed them.
    fn forget(&mut self) -> Result<(), Refusal>;
}

/// Exposure time as the camera reports it, µs.
pub(crate) fn exposure_us(camera: &mut dyn Features) -> Option<f64> {
    let name = EXPOSURE.into_iter().find(|name| camera.has_feature(name))?;
    camera.get_float(name).ok().filter(|us| us.is_finite())
}

/// A whole number that the camera must have.
///
/// # Errors
/// A feature that is missing, or no size.
pub(crate) fn size(camera: &mut dyn Features, name: &str) -> Result<u32, CameraError> {
    let value = camera.get_integer(name)?;
    u32::try_from(value)
        .map_err(|_| CameraError::Feature { name: name.to_owned(), why: format!("{value} is not a size") })
}

/// Sets an enumeration where the camera has it.
pub(super) fn set_if_there(camera: &mut dyn Features, name: &str, entry: &str) -> Result<(), CameraError> {
    if !camera.has_feature(name) {
        return Ok(());
    }
    // Some cameras have read-only enumerations.
    if camera.get_enum(name).is_ok_and(|now| now == entry) {
        return Ok(());
    }
    Ok(camera.set_enum(name, entry)?)
}

/// Sets a number that the camera has by one of these names.
///
/// # Errors
/// A camera without any of these features, or with another range of values.
pub(super) fn set_one_of(camera: &mut dyn Features, names: &[&str], value: f64) -> Result<(), CameraError> {
    let Some(name) = names.iter().find(|name| camera.has_feature(name)) else {
        let why = "the camera has no such feature".to_owned();
        return Err(CameraError::Feature { name: names[0].to_owned(), why });
    };
    if let Ok((least, most)) = camera.float_bounds(name)
        && !(least..=most).contains(&value)
    {
        let why = format!("{value} was requested; the camera supports {least} to {most}");
        return Err(CameraError::Feature { name: (*name).to_owned(), why });
    }
    Ok(camera.set_float(name, value)?)
}
