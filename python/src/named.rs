//! Options by name: the meaning of a name, and numbers that must be above zero.

use crate::failure::Failure;
use trueline::Requirement;
use trueline::open::nearest;

/// Meaning of a name.
///
/// # Errors
/// An unknown name, with the valid ones and the nearest of them.
pub(crate) fn choice<T: Copy>(option: &str, name: &str, known: &[(&str, T)]) -> Result<T, Failure> {
    known.iter().find(|(known, _)| *known == name).map(|(_, value)| *value).ok_or_else(|| {
        let names: Vec<_> = known.iter().map(|(name, _)| *name).collect();
        let choices = names.join(", ");
        let message = format!("{option}: no {name:?}; the choices are {choices}");
        match nearest(name, names) {
            Some(near) => {
                Failure::new(format!("{message}. Did you mean {near:?}?"), format!("{option}={near:?}"))
            }
            None => Failure::new(message, format!("one of {choices}")),
        }
    })
}

/// A number of at least zero.
///
/// # Errors
/// Any other.
pub(crate) fn not_negative(option: &str, value: Option<f64>) -> Result<Option<f64>, Failure> {
    match value {
        Some(x) if !(x >= 0.0 && x.is_finite()) => Err(Failure::new(
            format!("{option}: expected a number of at least zero, found {x}"),
            "leave it out for the default",
        )),
        _ => Ok(value),
    }
}

/// A number above zero.
///
/// # Errors
/// Any other.
pub(crate) fn positive(option: &str, value: Option<f64>) -> Result<Option<f64>, Failure> {
    match value {
        Some(x) if !(x > 0.0 && x.is_finite()) => Err(Failure::new(
            format!("{option}: expected a number above zero, found {x}"),
            "leave it out for the default",
        )),
        _ => Ok(value),
    }
}

/// Standard deviations of time in ms, rotation in degrees, translation in mm.
///
/// # Errors
/// A number that is not above zero.
pub(crate) fn sigmas(
    option: &str,
    [time_ms, rotation_deg, translation_mm]: [Option<f64>; 3],
) -> Result<Requirement, Failure> {
    let of = |unit: &str, value| positive(&format!("{option}_{unit}"), value);
    Ok(Requirement {
        time_s: of("ms", time_ms)?.map(|ms| ms * 1e-3),
        rotation_rad: of("deg", rotation_deg)?.map(f64::to_radians),
        translation_m: of("mm", translation_mm)?.map(|mm| mm * 1e-3),
        ..Requirement::default()
    })
}
