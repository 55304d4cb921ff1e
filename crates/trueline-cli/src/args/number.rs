//! Options with a bounded number as value; the bounds are named in the error.
#![cfg_attr(not(feature = "live"), allow(dead_code, reason = "many numbers are those of live devices"))]

use std::time::Duration;

/// A number that is `expected` so.
fn number(text: &str, expected: &str, is_good: impl Fn(f64) -> bool) -> Result<f64, String> {
    let found = text.parse::<f64>().ok().filter(|x| x.is_finite() && is_good(*x));
    found.ok_or_else(|| format!("expected {expected}, found {text}"))
}

/// The least and the largest positive value: squares of these, and quotients of squares, are still numbers.
const LEAST: f64 = 1e-9;
const LARGEST: f64 = 1e9;

/// Above zero.
pub(crate) fn above_zero(text: &str) -> Result<f64, String> {
    number(text, "a number above zero, from 1e-9 to 1e9", |x| (LEAST..=LARGEST).contains(&x))
}

/// Zero or more.
pub(crate) fn zero_or_more(text: &str) -> Result<f64, String> {
    number(text, "a number of at least zero, up to 1e9", |x| (0.0..=LARGEST).contains(&x))
}

/// A length of a seam's edge or form, mm: larger ones are those of another unit.
pub(crate) fn of_a_seam_mm(text: &str) -> Result<f64, String> {
    number(text, "0 to 20 mm", |x| (0.0..=20.0).contains(&x))
}

/// A duration of a simulated scan, s.
pub(crate) fn simulated_s(text: &str) -> Result<f64, String> {
    number(text, "1 to 3600 s", |x| (1.0..=3600.0).contains(&x))
}

/// How often a sensor goes over a seam.
pub(crate) fn passes(text: &str) -> Result<f64, String> {
    number(text, "0.5 to 100", |x| (0.5..=100.0).contains(&x))
}

/// A time offset of a simulated scan, ms: up to a minute.
pub(crate) fn simulated_offset_ms(text: &str) -> Result<f64, String> {
    number(text, "-60 000 to 60 000 ms", |x| x.abs() <= 6e4)
}

/// An angle of less than a whole turn to either side, degrees.
pub(crate) fn turn_deg(text: &str) -> Result<f64, String> {
    number(text, "-360° to 360°", |x| x.abs() <= 360.0)
}

/// How far a simulated sensor tilts, degrees.
pub(crate) fn tilt_deg(text: &str) -> Result<f64, String> {
    number(text, "0° to 90°", |x| (0.0..=90.0).contains(&x))
}

/// How far a simulated robot travels, mm.
pub(crate) fn travel_mm(text: &str) -> Result<f64, String> {
    number(text, "0 to 100 000 mm", |x| (0.0..=1e5).contains(&x))
}

/// Distance of a simulated profiler's columns, mm.
pub(crate) fn column_mm(text: &str) -> Result<f64, String> {
    number(text, "0.001 to 10 mm", |x| (0.001..=10.0).contains(&x))
}

/// How often a simulated weave comes back, Hz.
pub(crate) fn weave_hz(text: &str) -> Result<f64, String> {
    number(text, "0 to 1000 Hz", |x| (0.0..=1e3).contains(&x))
}

/// A period of a simulated stream, ms.
pub(crate) fn period_ms(text: &str) -> Result<f64, String> {
    number(text, "0.1 to 10 000 ms", |x| (0.1..=1e4).contains(&x))
}

/// How far simulated stamps stray, or how long a simulated exposure is, ms.
pub(crate) fn up_to_a_second_ms(text: &str) -> Result<f64, String> {
    number(text, "0 to 1000 ms", |x| (0.0..=1e3).contains(&x))
}

/// An angle between plates, degrees.
pub(crate) fn opening_deg(text: &str) -> Result<f64, String> {
    number(text, "more than 0° and less than 360° (90 is usual)", |x| x > 0.0 && x < 360.0)
}

/// A part of a whole, %.
pub(crate) fn percent(text: &str) -> Result<f64, String> {
    number(text, "a percentage above 0 and up to 100", |x| x > 0.0 && x <= 100.0)
}

/// Any number.
pub(crate) fn any(text: &str) -> Result<f64, String> {
    number(text, "a number", |_| true)
}

/// From 0 to 1.
pub(crate) fn share(text: &str) -> Result<f64, String> {
    number(text, "a share from 0 to 1", |x| (0.0..=1.0).contains(&x))
}

/// Above 0 and up to 1.
pub(crate) fn pace(text: &str) -> Result<f64, String> {
    number(text, "a share above 0 and up to 1", |x| x > 0.0 && x <= 1.0)
}

/// Days, as a duration: up to a century.
pub(crate) fn days(text: &str) -> Result<Duration, String> {
    let days = number(text, "a number of days above 0 and up to 36 500", |x| x > 0.0 && x <= 36_500.0)?;
    Ok(Duration::from_secs_f64(days * 86_400.0))
}

/// Parts per million of a clock that runs fast or slow.
pub(crate) fn drift_ppm(text: &str) -> Result<f64, String> {
    number(text, "-100 000 to 100 000", |x| x.abs() <= 1e5)
}

/// The same of a camera.
#[cfg(feature = "gige")]
pub(crate) fn camera_drift_ppm(text: &str) -> Result<f64, String> {
    number(text, "a number up to 10 000", |x| x.abs() <= 1e4)
}

/// Datagrams lost in a row.
pub(crate) fn burst(text: &str) -> Result<f64, String> {
    number(text, "1 to 10 000", |x| (1.0..=1e4).contains(&x))
}

/// Reading of a clock, s.
pub(crate) fn epoch_s(text: &str) -> Result<f64, String> {
    number(text, "0 or more, below 4 000 000 000", |x| (0.0..4e9).contains(&x))
}

/// A time that must pass, s.
pub(crate) fn seconds(text: &str) -> Result<f64, String> {
    number(text, "seconds above 0 and below a million", |x| x > 0.0 && x < 1e6)
}

/// When a clock is set, or by how much, s.
pub(crate) fn clock_step_s(text: &str) -> Result<f64, String> {
    number(text, "a number of seconds", |x| x.abs() <= 1e9)
}

/// A time that may be none, s.
pub(crate) fn rest_s(text: &str) -> Result<f64, String> {
    number(text, "seconds of 0 or more, below a million", |x| (0.0..1e6).contains(&x))
}

/// The same as a duration.
pub(crate) fn duration(text: &str) -> Result<Duration, String> {
    seconds(text).map(Duration::from_secs_f64)
}

/// How far a tool carries something, mm.
pub(crate) fn reach_mm(text: &str) -> Result<f64, String> {
    number(text, "1 to 3000 mm", |x| (1.0..=3000.0).contains(&x))
}

/// Rest at the end of a guidance.
pub(crate) fn hold(text: &str) -> Result<Duration, String> {
    number(text, "seconds above 0 and below 600", |x| x > 0.0 && x < 600.0).map(Duration::from_secs_f64)
}

/// \\CommTimeout, s.
pub(crate) fn timeout_s(text: &str) -> Result<f64, String> {
    number(text, "0.02 to 10 s", |x| (0.02..=10.0).contains(&x))
}

/// Wait for a guidance to begin.
pub(crate) fn armed(text: &str) -> Result<Duration, String> {
    number(text, "1 to 3600 s", |x| (1.0..=3600.0).contains(&x)).map(Duration::from_secs_f64)
}

/// Readout, latency, bandwidth of a simulated camera.
pub(crate) fn below_a_billion(text: &str) -> Result<f64, String> {
    number(text, "0 or more, below a billion", |x| (0.0..1e9).contains(&x))
}

/// A share that leaves something.
#[cfg(feature = "gige")]
pub(crate) fn partial_share(text: &str) -> Result<f64, String> {
    number(text, "a share from 0 to less than 1", |x| (0.0..1.0).contains(&x))
}
