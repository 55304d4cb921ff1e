//! A calibration before a moving board, in words and as the file of a result.

use crate::number::{positive_w, with_sigma};
use crate::summary::AT_STOPS;
use nalgebra::SMatrix;
use std::collections::BTreeMap;
use std::fmt::Write;
use trueline_dataset::result_file::{
    Covariance, Fact, Observability, Options, PoseEntry, Residuals, ResultFile, SCHEMA_VERSION, Sigma,
    Stamps, Status, Tool,
};
use trueline_dataset::unit::MM_PER_M;
use trueline_sensor::board_hand_eye::joint::{BoardFit, HAND_EYE, SIZE, TIME_OFFSET};
use trueline_sensor::verdict::Remark;

/// A calibration before a moving board.
pub struct BoardReport<'a> {
    /// Result of the fit.
    pub fit: &'a BoardFit,
    /// Covariance of all included effects: noise, and the camera's uncertainty.
    pub covariance: SMatrix<f64, SIZE, SIZE>,
    /// Why it is not accepted.
    pub reasons: &'a [Remark],
    /// Warnings.
    pub warnings: &'a [Remark],
    /// Noise of a corner along each axis, px.
    pub corner_sigma_px: f64,
    /// Noise of a recorded position of the robot, per axis, m.
    pub robot_noise_m: f64,
    /// Pictures that show no whole, sharp board, by reason.
    pub skipped: &'a BTreeMap<String, usize>,
    /// Whether the robot stood at each picture. Then there is no time offset.
    pub at_stops: bool,
    /// Whether the time offset was estimated; else there is none, or it was held fixed.
    pub shows_time_offset: bool,
    /// SHA-256 of the inputs, by name.
    pub inputs: &'a BTreeMap<String, String>,
}

impl BoardReport<'_> {
    fn used(&self) -> usize {
        self.fit.used.iter().filter(|used| **used).count()
    }
}

/// The result as a file: that of a line, without lines.
#[must_use]
pub fn of(report: &BoardReport<'_>) -> ResultFile {
    let (fit, unknowns) = (report.fit, &report.fit.unknowns);
    let translation_mm: [f64; 3] = (unknowns.tool_from_camera.translation.vector * MM_PER_M).into();
    let facts = |remarks: &[Remark]| -> Vec<Fact> { remarks.iter().map(fact).collect() };
    ResultFile {
        schema_version: SCHEMA_VERSION,
        tool: Tool { name: "trueline".to_owned(), version: env!("CARGO_PKG_VERSION").to_owned() },
        status: Some(if report.reasons.is_empty() { Status::Accepted } else { Status::NotAccepted }),
        reasons: facts(report.reasons),
        warnings: facts(report.warnings),
        time_offset_s: (!report.at_stops).then_some(unknowns.time_offset_s),
        tool_from_camera: PoseEntry {
            translation_mm: translation_mm.map(Some),
            rotation_wxyz: Some(positive_w(&unknowns.tool_from_camera.rotation)),
        },
        sigma: sigma(&report.covariance, report.shows_time_offset),
        sigma_noise: sigma(&fit.covariance, report.shows_time_offset),
        covariance: covariance(&report.covariance, report.shows_time_offset),
        observability: {
            let size = if report.shows_time_offset { SIZE } else { SIZE - 1 };
            Observability { rank: size, size, ..Observability::default() }
        },
        residuals: Residuals {
            rms_px: Some(report.corner_sigma_px * std::f64::consts::SQRT_2),
            rms_mm: Some(fit.shift_rms_m * MM_PER_M),
            inliers: report.used(),
            outliers: fit.used.len() - report.used(),
            used: fit.used.len(),
            skipped: report.skipped.clone(),
            noise_factor: fit.squares_per_freedom.sqrt(),
            ..Residuals::default()
        },
        stamps: Stamps { robot_noise_mm: report.robot_noise_m * MM_PER_M, ..Stamps::default() },
        options: Options { at_stops: report.at_stops, ..Options::default() },
        termination: "board".to_owned(),
        inputs: report.inputs.clone(),
        ..ResultFile::default()
    }
}

fn fact(remark: &Remark) -> Fact {
    Fact { code: remark.code().to_owned(), text: remark.to_string(), ..Fact::default() }
}

fn sigma(covariance: &SMatrix<f64, SIZE, SIZE>, shows_time_offset: bool) -> Sigma {
    let of = |k: usize| covariance[(k, k)].max(0.0).sqrt();
    let three = |first: usize, scale: f64| [0, 1, 2].map(|k| Some(of(first + k) * scale));
    Sigma {
        time_offset_s: shows_time_offset.then(|| of(TIME_OFFSET)),
        rotation_rad: three(HAND_EYE, 1.0),
        translation_mm: three(HAND_EYE + 3, MM_PER_M),
    }
}

/// Time offset and hand-eye transform: as in a result of a line, in the same units.
fn covariance(of: &SMatrix<f64, SIZE, SIZE>, shows_time_offset: bool) -> Covariance {
    let axes = ["x", "y", "z"];
    let names = std::iter::once("time_offset_s".to_owned())
        .chain(axes.map(|axis| format!("rotation_{axis}_rad")))
        .chain(axes.map(|axis| format!("translation_{axis}_mm")));
    let scale = |k: usize| if k >= HAND_EYE + 3 { MM_PER_M } else { 1.0 };
    let known = |i: usize| shows_time_offset || i != TIME_OFFSET;
    let entry = |i: usize, j: usize| (known(i) && known(j)).then(|| of[(i, j)] * scale(i) * scale(j));
    let row = |i: usize| (0..7).map(|j| entry(i, j)).collect();
    Covariance { order: names.collect(), matrix: (0..7).map(row).collect() }
}

/// The result in a few lines.
#[must_use]
pub fn text(report: &BoardReport<'_>) -> String {
    let (unknowns, mut out) = (&report.fit.unknowns, String::new());
    // Writing to a String cannot fail.
    if report.reasons.is_empty() {
        let _ = writeln!(out, "Calibration accepted");
    } else {
        let _ = writeln!(out, "Calibration NOT accepted:");
        for reason in report.reasons {
            let _ = writeln!(out, "  - {reason}");
        }
    }
    for warning in report.warnings {
        let _ = writeln!(out, "  warning: {warning}");
    }
    let sigma = |k: usize| report.covariance[(k, k)].max(0.0).sqrt();
    let (shift, turn) =
        (unknowns.tool_from_camera.translation.vector, unknowns.tool_from_camera.rotation.scaled_axis());
    let offset = if report.at_stops {
        AT_STOPS.to_owned()
    } else {
        let sigma_ms = report.shows_time_offset.then(|| sigma(TIME_OFFSET) * 1e3);
        with_sigma(unknowns.time_offset_s * 1e3, sigma_ms, "ms")
    };
    let _ = writeln!(out, "\n  {:<18} {offset}", "time offset");
    for (k, axis) in ["x", "y", "z"].into_iter().enumerate() {
        let value = with_sigma(shift[k] * MM_PER_M, Some(sigma(HAND_EYE + 3 + k) * MM_PER_M), "mm");
        let _ = writeln!(out, "  {:<18} {value}", format!("translation {axis}"));
    }
    for (k, axis) in ["x", "y", "z"].into_iter().enumerate() {
        let value = with_sigma(turn[k].to_degrees(), Some(sigma(HAND_EYE + k).to_degrees()), "deg");
        let _ = writeln!(out, "  {:<18} {value}", format!("rotation vector {axis}"));
    }
    let board = unknowns.base_from_target.translation.vector * MM_PER_M;
    let _ = writeln!(
        out,
        "\n  {:<18} at [{:.2}, {:.2}, {:.2}] mm in base, its first inner corner\n  {:<18} {} of {} pictures with a whole board\n  {:<18} corners {:.3} px, robot {:.4} mm, board {:.4} mm rms from where it should be",
        "board",
        board.x,
        board.y,
        board.z,
        "used",
        report.used(),
        report.fit.used.len() + report.skipped.values().sum::<usize>(),
        "noise",
        report.corner_sigma_px,
        report.robot_noise_m * MM_PER_M,
        report.fit.shift_rms_m * MM_PER_M,
    );
    for (reason, count) in report.skipped {
        let _ = writeln!(out, "  {count} pictures left out: {reason}");
    }
    out
}
