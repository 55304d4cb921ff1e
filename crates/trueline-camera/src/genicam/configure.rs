//! Setting a camera up before it begins.

use super::features::{EXPOSURE, Features, set_if_there, set_one_of, size};
use super::refusal::RefusedBy;
use super::scan3d;
use super::trigger::{self, Waits};
use crate::error::CameraError;
use crate::pixel_format::PixelFormat;
use crate::setup::CameraSetup;

const FRAME_RATE: [&str; 2] = ["AcquisitionFrameRate", "AcquisitionFrameRateAbs"];
const FRAME_RATE_SWITCH: [&str; 2] = ["AcquisitionFrameRateEnable", "AcquisitionFrameRateMode"];

/// Sets size, format, trigger, exposure and rate; returns the format, and the trigger of each picture.
///
/// # Errors
/// An existing feature that cannot be set as requested.
pub(super) fn configure(
    camera: &mut dyn Features,
    setup: &CameraSetup,
) -> Result<(PixelFormat, Waits), CameraError> {
    // A program that crashed may have left the camera running, and then it lets nothing be set.
    let _ = camera.execute("AcquisitionStop");
    let _ = camera.set_integer("TLParamsLocked", 0);
    let format = set_format(camera, setup)?;
    set_size(camera, setup)?;
    let waits = trigger::set(camera, &setup.trigger)?;
    set_if_there(camera, "AcquisitionMode", "Continuous")?;
    set_if_there(camera, "ExposureMode", "Timed")?;
    if let Some(exposure_us) = setup.exposure_us {
        set_one_of(camera, &EXPOSURE, exposure_us)?;
    }
    if let Some(fps) = setup.fps {
        if let Some(waits) = waits.told() {
            let why = format!("{fps} Hz were requested, but the trigger sets the rate ({waits})");
            return Err(CameraError::Feature { name: FRAME_RATE[0].to_owned(), why });
        }
        switch_rate_on(camera);
        set_one_of(camera, &FRAME_RATE, fps)?;
    }
    Ok((format, waits))
}

/// The requested format; else the camera's own, if it can be used; else gray levels of 8 bits.
fn set_format(camera: &mut dyn Features, setup: &CameraSetup) -> Result<PixelFormat, CameraError> {
    if setup.profiles {
        return scan3d::set_format(camera);
    }
    let own = camera.get_enum("PixelFormat").ok().as_deref().and_then(PixelFormat::of_name);
    let usable = |format: &PixelFormat| {
        format.samples().is_some() && (setup.channel.is_some() || !format.has_colours())
    };
    let wanted = setup.pixel.or(own.filter(usable)).unwrap_or(PixelFormat::MONO_8);
    if wanted.has_colours() && setup.channel.is_none() {
        return Err(CameraError::NoChannel { format: wanted.to_string() });
    }
    if !wanted.has_colours() && setup.channel.is_some() {
        return Err(CameraError::NoColours { format: wanted.to_string() });
    }
    if own == Some(wanted) {
        return Ok(wanted);
    }
    let offered = camera.enum_entries("PixelFormat").unwrap_or_default();
    // By the camera's own name for it: there are two for one format.
    let name = offered.iter().find(|name| PixelFormat::of_name(name) == Some(wanted));
    match camera.set_enum("PixelFormat", name.map_or(wanted.name(), String::as_str)) {
        Ok(()) => Ok(wanted),
        Err(refusal) if refusal.by != RefusedBy::Description || offered.is_empty() => Err(refusal.into()),
        Err(_) => Err(CameraError::Format { wanted: wanted.to_string(), offered: offered.join(", ") }),
    }
}

/// Offsets first go to zero: the largest size depends on them.
fn set_size(camera: &mut dyn Features, setup: &CameraSetup) -> Result<(), CameraError> {
    if setup.width.is_some() || setup.height.is_some() || setup.offset.is_some() {
        let _ = camera.set_integer("OffsetX", 0);
        let _ = camera.set_integer("OffsetY", 0);
    }
    let [left, top] = setup.offset.map_or([None; 2], |offset| offset.map(Some));
    let numbers = [("Width", setup.width), ("Height", setup.height), ("OffsetX", left), ("OffsetY", top)];
    for (name, value) in numbers {
        let Some(value) = value else { continue };
        if camera.get_integer(name).is_ok_and(|now| now == i64::from(value)) {
            continue;
        }
        check_limits(camera, name, i64::from(value))?;
        camera.set_integer(name, i64::from(value))?;
        let now = size(camera, name)?;
        if now != value {
            let why = format!("{value} px were requested, the camera set {now}");
            return Err(CameraError::Feature { name: name.to_owned(), why });
        }
    }
    Ok(())
}

/// The driver leaves it to the camera to mind its limits, and some cameras do not.
fn check_limits(camera: &mut dyn Features, name: &str, value: i64) -> Result<(), CameraError> {
    let Ok((least, most)) = camera.integer_bounds(name) else { return Ok(()) };
    let step = camera.integer_increment(name).unwrap_or(1).max(1);
    if (least..=most).contains(&value) && (value - least) % step == 0 {
        return Ok(());
    }
    let why = format!("{value} was requested; the camera supports {least} to {most} in steps of {step}");
    Err(CameraError::Feature { name: name.to_owned(), why })
}

/// Some cameras ignore the rate until it is switched on; a camera without the switch always uses it.
fn switch_rate_on(camera: &mut dyn Features) {
    let [boolean, mode] = FRAME_RATE_SWITCH;
    if camera.has_feature(boolean) {
        let _ = camera.set_boolean(boolean, true);
    }
    if camera.has_feature(mode) {
        let _ = camera.set_enum(mode, "On");
    }
}
