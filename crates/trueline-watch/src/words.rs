//! Words and numbers as all texts have them.

use crate::parameters::Kind;

/// A weld by its number and name.
#[must_use]
pub fn numbered(number: i64, name: &str) -> String {
    format!("weld {number} ({name})")
}

/// Undetectable changes, in words.
#[must_use]
pub fn hidden(blind_to: &[String]) -> String {
    if blind_to.is_empty() { "nothing".to_owned() } else { blind_to.join(", ") }
}

/// Cause of a change, in words.
#[must_use]
pub fn what_changed(kind: Kind) -> &'static str {
    match kind {
        Kind::Timing => "the camera's time offset has changed",
        Kind::Bracket => "the sensor has moved on the robot",
        Kind::Sensor => "the sensor itself has changed",
        Kind::Seam => "the part has moved",
    }
}

/// Parts to check for a cause.
#[must_use]
pub fn where_to_look(kind: Kind) -> &'static str {
    match kind {
        Kind::Timing => "exposure, driver, network, and whether a clock was set",
        Kind::Bracket => {
            "the sensor's bracket, and the torch or tool; a camera or laser loose inside the sensor looks \
            identical"
        }
        Kind::Sensor => "the sensor's window, camera, laser and temperature",
        Kind::Seam => "the fixture; the calibration is still good",
    }
}

/// Values rarer than once in 10 to this power of welds are drawn there. Otherwise an alarm of a thousand
/// zeros would hide everything near the limit.
pub const RAREST_SHOWN: f64 = 20.0;

/// Beyond this log₁₀ the tail of the distribution is a figure of the model, and not of any cell.
const RAREST_LOG10: f64 = -12.0;

/// A probability in words.
#[must_use]
pub fn how_rarely(p_log10: f64) -> String {
    if p_log10 < RAREST_LOG10 {
        return format!("less than once in {:.0e} welds", 10f64.powf(-RAREST_LOG10));
    }
    format!("once in {:.0e} welds", 10f64.powf(-p_log10))
}

/// The probability of a false alarm in words.
#[must_use]
pub(crate) fn false_alarm(p_log10: f64) -> String {
    if p_log10 < RAREST_LOG10 {
        return format!("below {:.0e}", 10f64.powf(RAREST_LOG10));
    }
    format!("{:.0e}", 10f64.powf(p_log10))
}

/// A length with the digits that matter on a seam.
#[must_use]
pub fn millimetres(length_m: f64) -> String {
    let length_mm = length_m * 1e3;
    match length_mm.abs() {
        ..0.0995 => format!("{length_mm:.3} mm"),
        ..9.95 => format!("{length_mm:.2} mm"),
        _ => format!("{length_mm:.1} mm"),
    }
}
