//! The summary in the terminal: what a welder reads.

use crate::number::with_sigma;
use std::fmt::Write;
use trueline::observability::rotation_is_seen;
use trueline::parameters::{ROTATION, TIME_OFFSET, TRANSLATION, line_index};
use trueline::{Calibration, Status};
use trueline_dataset::unit::MM_PER_M;

const MS_PER_S: f64 = 1e3;

/// The verdict in one sentence.
#[must_use]
pub fn verdict(c: &Calibration) -> String {
    match c.status {
        Status::Accepted => "accepted".to_owned(),
        Status::NotAccepted => format!("NOT accepted, for {} reason(s)", c.reasons.len()),
    }
}

/// The whole summary, a few lines of plain text.
#[must_use]
pub fn text(c: &Calibration) -> String {
    let mut out = String::new();
    // Writing to a String cannot fail.
    let _ = writeln!(out, "Calibration {}", verdict(c));
    for reason in &c.reasons {
        let _ = writeln!(out, "  - {reason}");
    }
    for warning in &c.warnings {
        let _ = writeln!(out, "  warning: {warning}");
    }
    let _ = writeln!(out);
    for (name, value) in rows(c) {
        let _ = writeln!(out, "  {name:<22} {value}");
    }
    out
}

/// Names and values of the summary's table; the report shows the same.
#[must_use]
pub fn rows(c: &Calibration) -> Vec<(String, String)> {
    let mut rows = vec![("time offset".to_owned(), time_offset(c))];
    for (k, axis) in ["x", "y", "z"].iter().enumerate() {
        rows.push((format!("translation {axis}"), translation(c, k)));
    }
    rows.push(("rotation (w x y z)".to_owned(), rotation(c)));
    rows.push(("rotation uncertainty".to_owned(), rotation_sigma(c)));
    for k in 0..c.parameters.lines.len() {
        rows.push((format!("line {k}"), line(c, k)));
    }
    rows.push(("residual".to_owned(), residual(c)));
    rows.push(("features".to_owned(), features(c)));
    rows.push(("robot stream".to_owned(), robot(c)));
    rows.push(("solver".to_owned(), format!("{} steps; {}", c.iterations.len(), c.termination)));
    rows
}

const UNSEEN: &str = "not visible in this scan";

fn time_offset(c: &Calibration) -> String {
    if !c.is_known(TIME_OFFSET) {
        return UNSEEN.to_owned();
    }
    let sigma = c.sigma(TIME_OFFSET).map(|s| s * MS_PER_S);
    let value = c.parameters.time_offset_s * MS_PER_S;
    let late = if value >= 0.0 { "images late" } else { "images early" };
    format!("{}  ({late})", with_sigma(value, sigma, "ms"))
}

fn translation(c: &Calibration, axis: usize) -> String {
    if !c.is_known(TRANSLATION + axis) {
        return UNSEEN.to_owned();
    }
    let value = c.parameters.tool_from_camera.translation.vector[axis] * MM_PER_M;
    with_sigma(value, c.sigma(TRANSLATION + axis).map(|s| s * MM_PER_M), "mm")
}

fn rotation(c: &Calibration) -> String {
    if !rotation_is_seen(&c.observability) {
        return UNSEEN.to_owned();
    }
    let [w, x, y, z] = crate::number::positive_w(&c.parameters.tool_from_camera.rotation);
    format!("{w:.6} {x:.6} {y:.6} {z:.6}")
}

fn rotation_sigma(c: &Calibration) -> String {
    let axis = |k: usize| {
        c.sigma(ROTATION + k).map_or_else(|| "–".to_owned(), |s| format!("± {:.4}°", s.to_degrees()))
    };
    format!("{}  {}  {}  about tool x, y, z", axis(0), axis(1), axis(2))
}

fn line(c: &Calibration, k: usize) -> String {
    let line = &c.parameters.lines[k];
    let first = line_index(k);
    if !(0..4).all(|j| c.is_known(first + j)) {
        return UNSEEN.to_owned();
    }
    let (p, d) = (line.anchor() * MM_PER_M, line.direction());
    format!("through ({:.2}, {:.2}, {:.2}) mm along ({:.5}, {:.5}, {:.5})", p.x, p.y, p.z, d.x, d.y, d.z)
}

fn residual(c: &Calibration) -> String {
    let mm = format!("{:.4} mm RMS from the line", c.residuals.rms_m * MM_PER_M);
    match c.residuals.rms_px {
        Some(px) => format!("{mm}, {px:.3} px in the image"),
        None => mm,
    }
}

fn features(c: &Calibration) -> String {
    let r = &c.residuals;
    let mut text = format!("{} used, {} of them outliers", r.used, r.outliers);
    for (reason, count) in &r.skipped {
        let _ = write!(text, "; {count} {reason}");
    }
    text
}

fn robot(c: &Calibration) -> String {
    let treated = if c.robot_smoothed { ", taken out by a local fit" } else { "" };
    format!(
        "{:.3} ms period, noise {:.4} mm{treated}",
        c.robot_stamps.median_period_s * MS_PER_S,
        c.robot_noise_m * MM_PER_M
    )
}
