//! Tests whether the scan contradicts a sensor, a line or another quantity that was held fixed, by refitting with it free.
//!
//! The error of a held sensor or line appears in the residuals, where it looks like a bad robot, another lens or a bent seam. Causes are therefore
//! looked for with sensor and lines released.

use crate::assess::drawn_line_shift::DrawnLineShift;
use crate::assess::held_off::HeldOff;
use crate::assess::sensor_shape::SensorShape;
use crate::calibration::Calibration;
use crate::config::{Config, DrawnLine, HeldSigma, Hold, ResidualKind, SensorMode};
use crate::findings::Checks;
use crate::problem::parameters::{Parameters, line_index};
use crate::verdict::Status;
use nalgebra::Matrix4;
use trueline_dataset::Recording;

/// The same options with everything released, also the quantities of --fix; `None` if --fix holds nothing that this scan has.
pub(crate) fn all_released(config: &Config, recording: &Recording) -> Option<Config> {
    let is_absent = |hold: &Hold| config.at_stops && *hold == Hold::TimeOffset;
    let (absent, held): (Vec<Hold>, Vec<Hold>) = config.hold.iter().copied().partition(is_absent);
    let rest = released(config, recording).unwrap_or_else(|| config.clone());
    (!held.is_empty()).then_some(Config { hold: absent, held_sigma: HeldSigma::default(), ..rest })
}

/// The same options with the sensor and the lines released; `None` where neither is held.
pub(crate) fn released(config: &Config, recording: &Recording) -> Option<Config> {
    let holds_sensor = config.sensor == SensorMode::Fixed && config.residual == ResidualKind::Sheet;
    if !holds_sensor && config.drawn_lines.is_empty() {
        return None;
    }
    let sensor = match config.sensor {
        // The file's uncertainty was derived from this scan.
        SensorMode::Fixed if holds_sensor && recording.is_in_its_sensors_uncertainty() => SensorMode::Free,
        SensorMode::Fixed if holds_sensor => SensorMode::Prior,
        other => other,
    };
    Some(Config { sensor, drawn_lines: Vec::new(), ..config.clone() })
}

/// The same options without the sensor file's uncertainty. `None` unless a fit that trusts the file leaves residuals that a worse sensor would
/// explain.
pub(crate) fn freed(config: &Config, as_stated: &Calibration) -> Option<Config> {
    let findings = &as_stated.findings;
    let shape =
        findings.unknowns.sensor.filter(|shape| shape.stated && config.sensor == SensorMode::Prior)?;
    let is_doubted = shape.is_off() || findings.checks.cause.is_some();
    is_doubted.then(|| Config { sensor: SensorMode::Free, ..config.clone() })
}

/// Compares held quantities with the same scan with them released. No accuracy is claimed for a quantity that the scan contradicts.
pub(crate) fn compare(config: &Config, held: &Parameters, checks: &mut Checks, released: &Calibration) {
    let is_released = config.sensor != released.findings.config.sensor;
    checks.held_sensor = held_sensor(config, released).filter(|_| is_released);
    checks.confounded_causes = released.findings.checks.confounded_causes.clone();
    checks.held_off = held_off(config, held, released);
    checks.drawn_line_shifts = shifted_lines(config, released);
    checks.lens = released.findings.checks.lens;
    checks.better_without_drawing_m = better_without_drawing_m(config, checks, released);
    if checks.contradict_what_is_held() {
        checks.seam_error = None;
        checks.seam_point_error = None;
    }
}

/// Shape of a sensor that was held fixed or had its file's uncertainty. `None` if it was free or is unobservable.
pub(crate) fn held_sensor(held: &Config, released: &Calibration) -> Option<SensorShape> {
    let unknowns = &released.findings.unknowns;
    let shape = unknowns.sensor.filter(|_| unknowns.observability.unobservable.is_empty())?;
    match held.sensor {
        SensorMode::Fixed => Some(shape),
        SensorMode::Prior => shape.beyond_stated(),
        SensorMode::Free => None,
    }
}

/// Error of a seam point without the drawing, m, if the scan determines the lines better than the drawing does.
fn better_without_drawing_m(held: &Config, checks: &Checks, released: &Calibration) -> Option<f64> {
    let (with, without) = (checks.seam_error?.rms_m, released.findings.checks.seam_error?.rms_m);
    let is_good = released.status() == Status::Accepted;
    (is_good && !held.drawn_lines.is_empty() && without < with).then_some(without)
}

/// Quantities of --fix that differ in the released fit. Only a fit that determines everything is compared.
fn held_off(config: &Config, held: &Parameters, released: &Calibration) -> Vec<HeldOff> {
    let is_free = |hold: &&Hold| !released.findings.config.hold.contains(hold);
    let covariance = |i: usize, j: usize| released.covariance(i, j).unwrap_or(f64::INFINITY);
    let off = |hold: &Hold| HeldOff::of(*hold, [held, released.best_fit()], &config.held_sigma, covariance);
    if !released.findings.unknowns.observability.shows_all() {
        return Vec::new();
    }
    config.hold.iter().filter(is_free).filter_map(off).collect()
}

/// Lines whose estimate without the drawing contradicts the drawing.
fn shifted_lines(held: &Config, released: &Calibration) -> Vec<DrawnLineShift> {
    let shift = |drawn: &DrawnLine| {
        let (found, first) = (released.best_fit().lines.get(drawn.line)?, line_index(drawn.line));
        let covariance =
            Matrix4::from_fn(|i, j| released.covariance(first + i, first + j).unwrap_or_default());
        let seen = std::array::from_fn(|k| released.sigma(first + k).is_some());
        DrawnLineShift::of(drawn, found, &covariance, seen)
    };
    held.drawn_lines.iter().filter_map(shift).collect()
}
