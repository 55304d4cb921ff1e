//! Setting a camera up: makers name the same thing differently.

use super::errors::feature;
use super::scan3d;
use super::settings::{GigeSettings, PixelFormat};
use crate::error::CameraError;
use telegenic::{GenICamera, GenicamError};

const EXPOSURE: [&str; 2] = ["ExposureTime", "ExposureTimeAbs"];
const FRAME_RATE: [&str; 2] = ["AcquisitionFrameRate", "AcquisitionFrameRateAbs"];
const FRAME_RATE_SWITCH: [&str; 2] = ["AcquisitionFrameRateEnable", "AcquisitionFrameRateMode"];

/// Sets size, format, exposure and rate of a camera that runs by itself; returns the format.
///
/// # Errors
/// A feature that is there and cannot be set as asked for.
pub(crate) fn configure(
    camera: &mut GenICamera,
    settings: &GigeSettings,
) -> Result<PixelFormat, CameraError> {
    // A program that crashed may have left the camera running, and then it lets nothing be set.
    let _ = camera.execute("AcquisitionStop");
    let _ = camera.set_integer("TLParamsLocked", 0);
    let format = set_format(camera, settings)?;
    set_size(camera, settings)?;
    set_if_there(camera, "TriggerMode", "Off")?;
    set_if_there(camera, "AcquisitionMode", "Continuous")?;
    set_if_there(camera, "ExposureMode", "Timed")?;
    if let Some(exposure_us) = settings.exposure_us {
        set_one_of(camera, &EXPOSURE, exposure_us)?;
    }
    if let Some(fps) = settings.fps {
        switch_rate_on(camera);
        set_one_of(camera, &FRAME_RATE, fps)?;
    }
    Ok(format)
}

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

fn set_format(camera: &mut GenICamera, settings: &GigeSettings) -> Result<PixelFormat, CameraError> {
    if settings.profiles {
        return scan3d::set_format(camera);
    }
    let wanted = settings.pixel.name();
    match camera.set_enum("PixelFormat", wanted) {
        Ok(()) => Ok(settings.pixel),
        Err(GenicamError::Camera(error)) => Err(feature("PixelFormat", &GenicamError::Camera(error))),
        Err(_) => {
            let offered = camera.enum_entries("PixelFormat").unwrap_or_default().join(", ");
            Err(CameraError::Format { wanted: wanted.to_owned(), offered })
        }
    }
}

/// Offsets first go to zero: the largest size depends on them.
fn set_size(camera: &mut GenICamera, settings: &GigeSettings) -> Result<(), CameraError> {
    if settings.width.is_some() || settings.height.is_some() || settings.offset.is_some() {
        let _ = camera.set_integer("OffsetX", 0);
        let _ = camera.set_integer("OffsetY", 0);
    }
    let [left, top] = settings.offset.map_or([None; 2], |offset| offset.map(Some));
    let numbers =
        [("Width", settings.width), ("Height", settings.height), ("OffsetX", left), ("OffsetY", top)];
    for (name, value) in numbers {
        let Some(value) = value else { continue };
        if camera.get_integer(name).is_ok_and(|now| now == i64::from(value)) {
            continue;
        }
        check_limits(camera, name, i64::from(value))?;
        camera.set_integer(name, i64::from(value)).map_err(|e| feature(name, &e))?;
        let now = size(camera, name)?;
        if now != value {
            let why = format!("{value} px were asked for, the camera set {now}");
            return Err(CameraError::Feature { name: name.to_owned(), why });
        }
    }
    Ok(())
}

/// The driver leaves it to the camera to mind its limits, and some cameras do not.
fn check_limits(camera: &mut GenICamera, name: &str, value: i64) -> Result<(), CameraError> {
    let Ok((least, most)) = camera.integer_bounds(name) else { return Ok(()) };
    let step = camera.integer_increment(name).unwrap_or(1).max(1);
    if (least..=most).contains(&value) && (value - least) % step == 0 {
        return Ok(());
    }
    let why = format!("{value} was asked for, the camera takes {least} to {most} in steps of {step}");
    Err(CameraError::Feature { name: name.to_owned(), why })
}

fn set_one_of(camera: &mut GenICamera, names: &[&str], value: f64) -> Result<(), CameraError> {
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

/// Where the rate is not heeded until it is switched on; a camera without the switch heeds it always.
fn switch_rate_on(camera: &mut GenICamera) {
    let [boolean, mode] = FRAME_RATE_SWITCH;
    if camera.has_feature(boolean) {
        let _ = camera.set_boolean(boolean, true);
    }
    if camera.has_feature(mode) {
        let _ = camera.set_enum(mode, "On");
    }
}
