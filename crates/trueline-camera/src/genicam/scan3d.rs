//! A profiler's description of its numbers.

use super::features::Features;
use super::trigger::Waits;
use crate::error::CameraError;
use crate::pixel_format::PixelFormat;
use crate::range::{RangeAxis, RangeScale};

const OUTPUT_MODE: &str = "Scan3dOutputMode";
const UNIT: &str = "Scan3dDistanceUnit";
const SYSTEM: &str = "Scan3dCoordinateSystem";
const SELECTOR: &str = "Scan3dCoordinateSelector";
const SCALE: &str = "Scan3dCoordinateScale";
const OFFSET: &str = "Scan3dCoordinateOffset";
const INVALID_FLAG: &str = "Scan3dInvalidDataFlag";
const INVALID_VALUE: &str = "Scan3dInvalidDataValue";
const LINE_RATE: &str = "AcquisitionLineRate";
/// Value for no range if the camera states none.
const USUAL_INVALID: f64 = 0.0;

/// Reads scales and offsets of frames of several profiles.
///
/// # Errors
/// Numbers that are not coordinates of a plane in a unit of length; frames of several profiles with unknown times.
pub(super) fn scale(
    camera: &mut dyn Features,
    format: PixelFormat,
    rows: u32,
    waits: &Waits,
) -> Result<RangeScale, CameraError> {
    let sends_both = format == PixelFormat::Coord3dAc16;
    expect_coordinates(camera, sends_both)?;
    let unit_m = unit_m(camera)?;
    let [along, range] = [axis(camera, "CoordinateA", unit_m)?, axis(camera, "CoordinateC", unit_m)?];
    Ok(RangeScale { along, range, sends_both, line_period_ns: line_period_ns(camera, rows, waits)? })
}

/// The mode in which numbers are coordinates, where the camera has modes.
fn expect_coordinates(camera: &mut dyn Features, sends_both: bool) -> Result<(), CameraError> {
    let fits = |mode: &str| if sends_both { mode.contains("AC") } else { mode.starts_with("RectifiedC") };
    match asked(camera, OUTPUT_MODE)? {
        Some(mode) if !fits(&mode) => {
            let wanted = if sends_both {
                "CalibratedAC"
            } else {
                "RectifiedC, or a pixel format that sends A as well"
            };
            return Err(refused(
                OUTPUT_MODE,
                format!("it is {mode}, which does not locate a range along the stripe; expected {wanted}"),
            ));
        }
        _ => {}
    }
    match asked(camera, SYSTEM)? {
        Some(system) if system != "Cartesian" => {
            Err(refused(SYSTEM, format!("it is {system}, expected Cartesian")))
        }
        _ => Ok(()),
    }
}

/// Millimetres where the camera does not tell.
fn unit_m(camera: &mut dyn Features) -> Result<f64, CameraError> {
    match asked(camera, UNIT)?.as_deref() {
        None | Some("Millimeter") => Ok(1e-3),
        Some("Micrometer") => Ok(1e-6),
        Some("Inch") => Ok(0.0254),
        Some(other) => Err(refused(UNIT, format!("it is {other}, expected Millimeter or Inch"))),
    }
}

fn axis(camera: &mut dyn Features, coordinate: &str, unit_m: f64) -> Result<RangeAxis, CameraError> {
    if camera.has_feature(SELECTOR) {
        camera.set_enum(SELECTOR, coordinate)?;
        // The driver's memory is of the previous coordinate.
        camera.forget()?;
    }
    let scale = number(camera, SCALE)?.ok_or_else(|| {
        refused(SCALE, "the camera has no such feature: its numbers cannot be made lengths".to_owned())
    })?;
    if scale == 0.0 {
        return Err(refused(SCALE, format!("it is 0 for {coordinate}")));
    }
    let offset = number(camera, OFFSET)?.unwrap_or(0.0);
    Ok(RangeAxis { scale_m: scale * unit_m, offset_m: offset * unit_m, invalid: invalid(camera)? })
}

fn invalid(camera: &mut dyn Features) -> Result<Option<f64>, CameraError> {
    let is_marked = match camera.has_feature(INVALID_FLAG) {
        true => camera.get_boolean(INVALID_FLAG)?,
        false => true,
    };
    Ok(if is_marked { Some(number(camera, INVALID_VALUE)?.unwrap_or(USUAL_INVALID)) } else { None })
}

fn line_period_ns(camera: &mut dyn Features, rows: u32, waits: &Waits) -> Result<f64, CameraError> {
    if rows <= 1 {
        return Ok(0.0);
    }
    if let Some(signal) = &waits.for_line {
        let why = format!(
            "each of the {rows} profiles of a frame waits for {signal}: when each was taken is not known. Set Height to 1"
        );
        return Err(refused("TriggerMode", why));
    }
    match number(camera, LINE_RATE)? {
        Some(hz) if hz > 0.0 => Ok(1e9 / hz),
        _ => Err(refused(
            LINE_RATE,
            format!("a frame holds {rows} profiles without time stamps of each. Set Height to 1"),
        )),
    }
}

/// A number that is finite; `None` where the camera has no such feature.
fn number(camera: &mut dyn Features, name: &str) -> Result<Option<f64>, CameraError> {
    if !camera.has_feature(name) {
        return Ok(None);
    }
    let value = camera.get_float(name)?;
    if value.is_finite() { Ok(Some(value)) } else { Err(refused(name, format!("it is {value}"))) }
}

/// An enumeration; `None` where the camera has no such feature or does not tell.
fn asked(camera: &mut dyn Features, name: &str) -> Result<Option<String>, CameraError> {
    if !camera.has_feature(name) {
        return Ok(None);
    }
    match camera.get_enum(name) {
        Ok(value) => Ok(Some(value)),
        Err(refusal) if refusal.is_silence() => Err(refusal.into()),
        Err(_) => Ok(None),
    }
}

fn refused(name: &str, why: String) -> CameraError {
    CameraError::Feature { name: name.to_owned(), why }
}

/// Sets the pixel format to one of range data: the camera's own choice, if it is one.
///
/// # Errors
/// A camera that offers none.
pub(super) fn set_format(camera: &mut dyn Features) -> Result<PixelFormat, CameraError> {
    let of = |name: &str| PixelFormat::RANGE.into_iter().find(|format| format.name() == name);
    if let Some(format) = camera.get_enum("PixelFormat").ok().as_deref().and_then(of) {
        return Ok(format);
    }
    let offered = camera.enum_entries("PixelFormat").unwrap_or_default();
    // Mono16 only if it was chosen: a picture in 16 bits looks the same.
    let best = PixelFormat::RANGE
        .into_iter()
        .find(|format| *format != PixelFormat::MONO_16 && offered.iter().any(|name| name == format.name()));
    let Some(format) = best else {
        let wanted = PixelFormat::RANGE.map(PixelFormat::name).join(" or ");
        return Err(CameraError::Format { wanted, offered: offered.join(", ") });
    };
    camera.set_enum("PixelFormat", format.name())?;
    Ok(format)
}
