//! A calibration from pose sightings, in words and as the file of a result.

use crate::export::time_offset;
use crate::number::{positive_w, with_sigma};
pub use crate::round_result::RoundReport;
use crate::round_result::Shared;
use crate::summary::AT_STOPS;
use nalgebra::{SMatrix, Vector3};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fmt::Write;
use trueline_dataset::result_file::{
    Checks, Covariance, Fact, Observability, Options, PoseEntry, Residuals, ResultFile, RunnerUp,
    SCHEMA_VERSION, SensorEntry, SensorFileEntry, Sigma, Stamps, Status, TargetEntry, TimeOffsetUse, Tool,
    UnobservableEntry,
};
use trueline_dataset::unit::MM_PER_M;
use trueline_geometry::Pose;
use trueline_sensor::board_hand_eye::PoseFit;
use trueline_sensor::board_hand_eye::hidden;
use trueline_sensor::board_hand_eye::joint::{HAND_EYE, SIZE, TARGET, TIME_OFFSET};
use trueline_sensor::pose_verdict::{SightingRemark, Unshown};

/// A component that carries more than this part of a hidden unit direction has no value.
const SHARE: f64 = 0.05;
/// The three axes.
const AXES: [&str; 3] = ["x", "y", "z"];

/// A calibration from pose sightings.
pub struct PoseReport<'a> {
    /// Result of the fit.
    pub fit: &'a PoseFit,
    /// Covariance of all modelled errors: noise, and position errors of the robot.
    pub covariance: SMatrix<f64, SIZE, SIZE>,
    /// Why it is not accepted.
    pub reasons: &'a [SightingRemark],
    /// Warnings.
    pub warnings: &'a [SightingRemark],
    /// Noise of a recorded position of the robot, per axis, m.
    pub robot_noise_m: f64,
    /// Whether the robot stood at each sighting. Then there is no time offset.
    pub at_stops: bool,
    /// Whether the time offset was estimated; else there is none, or it was held fixed.
    pub estimates_offset: bool,
    /// Whether the camera stands beside the robot, which carries the target.
    pub beside_robot: bool,
    /// The sphere or cylinder, if that is the target.
    pub round: Option<RoundReport<'a>>,
    /// The options of the command.
    pub options: Options,
    /// SHA-256 of the inputs, by name.
    pub inputs: &'a BTreeMap<String, String>,
}

impl PoseReport<'_> {
    fn used(&self) -> usize {
        self.fit.used.iter().filter(|used| **used).count()
    }

    /// The time offset, if there is one.
    fn time_offset_s(&self) -> Option<f64> {
        let is_one = !self.at_stops && !self.fit.hidden.time_offset;
        is_one.then_some(self.fit.unknowns.time_offset_s)
    }

    /// Whether time offset and hand-eye transform have standard deviations.
    fn is_known(&self, k: usize) -> bool {
        let hidden = &self.fit.hidden;
        let free_of = |directions: &[Vector3<f64>], axis: usize| {
            directions.iter().all(|direction| direction[axis].powi(2) <= SHARE)
        };
        match k {
            TIME_OFFSET => self.estimates_offset && !hidden.time_offset,
            k if k < HAND_EYE + 3 => free_of(&hidden.rotation, k - HAND_EYE),
            k => free_of(&hidden.translation, k - HAND_EYE - 3),
        }
    }

    fn is_target_known(&self, first: usize, limit: f64) -> bool {
        (first..first + 3).all(|k| self.covariance[(k, k)] <= limit * limit)
    }
}

/// The result as a file: that of a line, with a target in place of lines.
#[must_use]
pub fn of(report: &PoseReport<'_>) -> ResultFile {
    let fit = report.fit;
    let facts = |remarks: &[SightingRemark]| -> Vec<Fact> { remarks.iter().map(fact).collect() };
    let is_accepted = report.reasons.is_empty();
    let time_offset_s = report.time_offset_s();
    ResultFile {
        schema_version: SCHEMA_VERSION,
        tool: Tool { name: "trueline".to_owned(), version: env!("CARGO_PKG_VERSION").to_owned() },
        status: Some(if is_accepted { Status::Accepted } else { Status::NotAccepted }),
        reasons: facts(report.reasons),
        warnings: facts(report.warnings),
        time_offset_s,
        time_offset_use: time_offset_s.filter(|_| is_accepted).map(time_offset_use),
        tool_from_camera: hand_eye(report),
        base_from_target: report.round.is_none().then(|| target(report)),
        cylinder: report.round.as_ref().and_then(|of| of.cylinder(&of_round(report))),
        sphere: report.round.as_ref().and_then(|of| of.sphere(&of_round(report))),
        sigma: sigma(report, &report.covariance),
        sigma_noise: sigma(report, &fit.covariance),
        covariance: covariance(report),
        observability: observability(fit),
        residuals: residuals(report),
        stamps: Stamps { robot_noise_mm: report.robot_noise_m * MM_PER_M, ..Stamps::default() },
        checks: Checks {
            runner_up: runner_up(fit),
            held_out: report.round.as_ref().and_then(RoundReport::held_out),
            ..Checks::default()
        },
        mounted: report.beside_robot.then(|| "fixed".to_owned()),
        sensor: SensorEntry {
            file: sensor_file(report),
            ..report.round.as_ref().map_or_else(poses, RoundReport::sensor)
        },
        options: report.options.clone(),
        termination: report.round.as_ref().map_or("poses", RoundReport::name).to_owned(),
        inputs: report.inputs.clone(),
        ..ResultFile::default()
    }
}

fn fact(remark: &SightingRemark) -> Fact {
    let values = match values(remark) {
        Value::Object(map) => map.into_iter().collect(),
        _ => BTreeMap::new(),
    };
    Fact { code: remark.code().to_owned(), text: remark.to_string(), values }
}

fn values(remark: &SightingRemark) -> Value {
    match remark {
        SightingRemark::Unobservable(what) => {
            let directions: Vec<[f64; 3]> = what.directions().iter().map(|d| (*d).into()).collect();
            json!({ "parameter": what.parameter(), "directions": directions })
        }
        SightingRemark::AtStops { stops } => {
            json!({ "parameter": Unshown::TimeOffset.parameter(), "directions": [], "stops": stops })
        }
        SightingRemark::AmbiguousTimeOffset { time_offsets_s, z } => {
            json!({ "time_offsets_s": time_offsets_s, "z": z })
        }
        SightingRemark::AmbiguousHandEye { turn_rad, z } => json!({ "turn_rad": turn_rad, "z": z }),
        SightingRemark::FewSightings { count, of } | SightingRemark::SightingsLeftOut { count, of } => {
            json!({ "count": count, "of": of })
        }
        SightingRemark::OtherScale { factor, sigma } => json!({ "factor": factor, "sigma": sigma }),
        SightingRemark::LargerThanStated { factor } | SightingRemark::LastingResiduals { factor } => {
            json!({ "factor": factor })
        }
        SightingRemark::HandEyeUncertain { rotation_rad, translation_m } => {
            json!({ "rotation_rad": rotation_rad, "translation_mm": translation_m * MM_PER_M })
        }
        SightingRemark::TimeOffsetUncertain { sigma_s } => json!({ "sigma_s": sigma_s }),
        _ => Value::Null,
    }
}

fn time_offset_use(offset_s: f64) -> TimeOffsetUse {
    let [python, cpp, rapid] = time_offset::snippets(offset_s).map(|snippet| snippet.text);
    let advice = time_offset::advice(offset_s).to_vec();
    TimeOffsetUse { rule: time_offset::rule(offset_s), advice, python, cpp, rapid }
}

fn hand_eye(report: &PoseReport<'_>) -> PoseEntry {
    let pose = &report.fit.unknowns.tool_from_camera;
    let known = |k: usize| report.is_known(HAND_EYE + 3 + k).then(|| pose.translation.vector[k] * MM_PER_M);
    PoseEntry {
        translation_mm: [0, 1, 2].map(known),
        rotation_wxyz: report.fit.hidden.rotation.is_empty().then(|| positive_w(&pose.rotation)),
    }
}

fn target(report: &PoseReport<'_>) -> TargetEntry {
    let pose = &report.fit.unknowns.base_from_target;
    let turns = report.is_target_known(TARGET, hidden::MOST_TURN_RAD);
    let shifts = report.is_target_known(TARGET + 3, hidden::MOST_SHIFT_M);
    let sigma = |k: usize| report.covariance[(k, k)].max(0.0).sqrt();
    let noise = &report.fit.sigma;
    TargetEntry {
        translation_mm: [0, 1, 2].map(|k| shifts.then(|| pose.translation.vector[k] * MM_PER_M)),
        rotation_wxyz: turns.then(|| positive_w(&pose.rotation)),
        sigma_rotation_rad: [0, 1, 2].map(|k| turns.then(|| sigma(TARGET + k))),
        sigma_translation_mm: [0, 1, 2].map(|k| shifts.then(|| sigma(TARGET + 3 + k) * MM_PER_M)),
        sighting_rotation_deg: [0, 1, 2].map(|k| noise[k].to_degrees()),
        sighting_translation_mm: [3, 4, 5].map(|k| noise[k] * MM_PER_M),
        noise_stated: report.fit.sigma_is_stated,
        scale: report.fit.scale.as_ref().map(|scale| scale.factor),
        sigma_scale: report.fit.scale.as_ref().map(|scale| scale.sigma),
    }
}

fn sigma(report: &PoseReport<'_>, covariance: &SMatrix<f64, SIZE, SIZE>) -> Sigma {
    let of = |k: usize| report.is_known(k).then(|| covariance[(k, k)].max(0.0).sqrt());
    Sigma {
        time_offset_s: of(TIME_OFFSET),
        rotation_rad: [0, 1, 2].map(|k| of(HAND_EYE + k)),
        translation_mm: [0, 1, 2].map(|k| Some(of(HAND_EYE + 3 + k)? * MM_PER_M)),
    }
}

/// Time offset and hand-eye transform: as in a result of a line, in the same units.
fn covariance(report: &PoseReport<'_>) -> Covariance {
    let names = std::iter::once("time_offset_s".to_owned())
        .chain(AXES.map(|axis| format!("rotation_{axis}_rad")))
        .chain(AXES.map(|axis| format!("translation_{axis}_mm")));
    let scale = |k: usize| if k >= HAND_EYE + 3 { MM_PER_M } else { 1.0 };
    let entry = |i: usize, j: usize| {
        let is_known = report.is_known(i) && report.is_known(j);
        is_known.then(|| report.covariance[(i, j)] * scale(i) * scale(j))
    };
    let row = |i: usize| (0..TARGET).map(|j| entry(i, j)).collect();
    Covariance { order: names.collect(), matrix: (0..TARGET).map(row).collect() }
}

fn observability(fit: &PoseFit) -> Observability {
    let entries = |what: Unshown| {
        let entry = |direction: Option<[f64; 3]>| UnobservableEntry {
            parameter: what.parameter().to_owned(),
            direction,
            advice: what.to_string(),
        };
        let directions: Vec<Option<[f64; 3]>> =
            what.directions().iter().map(|direction| Some((*direction).into())).collect();
        let directions = if directions.is_empty() { vec![None] } else { directions };
        directions.into_iter().map(entry).collect::<Vec<_>>()
    };
    Observability {
        rank: fit.hidden.rank,
        size: fit.hidden.size,
        condition: Some(fit.hidden.condition).filter(|condition| condition.is_finite()),
        unobservable: Unshown::of(fit).into_iter().flat_map(entries).collect(),
        ..Observability::default()
    }
}

fn residuals(report: &PoseReport<'_>) -> Residuals {
    let fit = report.fit;
    let placed = fit.used.len() - fit.unplaced;
    let skipped = (fit.unplaced > 0).then(|| ("no-robot-pose".to_owned(), fit.unplaced));
    Residuals {
        rms_mm: Some(fit.rms_m * MM_PER_M),
        rms_deg: report.round.is_none().then(|| fit.rms_rad.to_degrees()),
        inliers: report.used(),
        outliers: placed.saturating_sub(report.used()),
        used: placed,
        skipped: skipped.into_iter().collect(),
        noise_factor: fit.squares_per_freedom.sqrt(),
        ..Residuals::default()
    }
}

fn runner_up(fit: &PoseFit) -> Option<RunnerUp> {
    let other = fit.runner_up?;
    Some(RunnerUp {
        time_offset_s: other.time_offset_s,
        explains: other.explains,
        best_explains: other.best_explains,
        z: other.z,
        decided: other.is_decided(),
    })
}

fn sensor_file(report: &PoseReport<'_>) -> Option<SensorFileEntry> {
    let (name, sha256) = report.inputs.get_key_value("sensor.toml")?;
    Some(SensorFileEntry { name: name.clone(), sha256: sha256.clone(), corrected: false })
}

/// The result in a few lines.
#[must_use]
pub fn text(report: &PoseReport<'_>) -> String {
    let mut out = String::new();
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
    let carrier = if report.beside_robot { "camera in base" } else { "camera on the tool" };
    let _ = writeln!(out, "\n  {:<18} {}", "time offset", offset_text(report));
    let _ = writeln!(out, "  {carrier}:");
    write_hand_eye(&mut out, report);
    match &report.round {
        Some(round) => round.write(&mut out, &of_round(report)),
        None => write_target(&mut out, report),
    }
    out
}

fn offset_text(report: &PoseReport<'_>) -> String {
    if report.at_stops {
        return AT_STOPS.to_owned();
    }
    let Some(offset_s) = report.time_offset_s() else { return "cannot be determined".to_owned() };
    let sigma_ms =
        report.estimates_offset.then(|| report.covariance[(TIME_OFFSET, TIME_OFFSET)].max(0.0).sqrt() * 1e3);
    with_sigma(offset_s * 1e3, sigma_ms, "ms")
}

fn write_hand_eye(out: &mut String, report: &PoseReport<'_>) {
    let pose = &report.fit.unknowns.tool_from_camera;
    let turn = pose.rotation.scaled_axis();
    let sigma = |k: usize| report.covariance[(k, k)].max(0.0).sqrt();
    let mut row = |name: String, known: bool, value: String| {
        let value = if known { value } else { "cannot be determined".to_owned() };
        let _ = writeln!(out, "  {name:<18} {value}");
    };
    for (k, axis) in AXES.into_iter().enumerate() {
        let place = HAND_EYE + 3 + k;
        let sigma_mm = Some(sigma(place) * MM_PER_M);
        let value = with_sigma(pose.translation.vector[k] * MM_PER_M, sigma_mm, "mm");
        row(format!("translation {axis}"), report.is_known(place), value);
    }
    for (k, axis) in AXES.into_iter().enumerate() {
        let value = with_sigma(turn[k].to_degrees(), Some(sigma(HAND_EYE + k).to_degrees()), "deg");
        row(format!("rotation vector {axis}"), report.fit.hidden.rotation.is_empty(), value);
    }
}

fn write_target(out: &mut String, report: &PoseReport<'_>) {
    let fit = report.fit;
    let target: &Pose = &fit.unknowns.base_from_target;
    let at = target.translation.vector * MM_PER_M;
    let frame = if report.beside_robot { "the tool" } else { "base" };
    let placed = if report.is_target_known(TARGET + 3, hidden::MOST_SHIFT_M) {
        format!("at [{:.2}, {:.2}, {:.2}] mm in {frame}", at.x, at.y, at.z)
    } else {
        "its position cannot be determined".to_owned()
    };
    let noise = &fit.sigma;
    let source = if fit.sigma_is_stated { "stated" } else { "estimated" };
    let _ = writeln!(
        out,
        "\n  {:<18} {placed}\n  {:<18} {} of {} sightings\n  {:<18} a sighting {:.3} mm across and {:.3} mm along the view, {:.3} and {:.3} deg \
         ({source}); robot {:.4} mm\n  {:<18} {:.3} mm and {:.3} deg rms",
        "target",
        "used",
        report.used(),
        fit.used.len(),
        "noise",
        noise[3] * MM_PER_M,
        noise[5] * MM_PER_M,
        noise[0].to_degrees(),
        noise[2].to_degrees(),
        report.robot_noise_m * MM_PER_M,
        "residuals",
        fit.rms_m * MM_PER_M,
        fit.rms_rad.to_degrees(),
    );
    if let Some(scale) = &fit.scale {
        let value = with_sigma(scale.factor, Some(scale.sigma), "");
        let _ = writeln!(out, "  {:<18} {} times the reported lengths", "scale", value.trim_end());
    }
    if fit.unplaced > 0 {
        let _ = writeln!(out, "  {} sightings are outside the robot's recording", fit.unplaced);
    }
}

/// The part of a report that a round target's own part needs.
fn of_round(report: &PoseReport<'_>) -> Shared {
    Shared {
        covariance: report.covariance.fixed_view::<6, 6>(TARGET, TARGET).into(),
        is_turn_known: report.is_target_known(TARGET, hidden::MOST_TURN_RAD),
        is_place_known: report.is_target_known(TARGET + 3, hidden::MOST_SHIFT_M),
        in_tool: report.beside_robot,
        used: report.used(),
        robot_noise_m: report.robot_noise_m,
    }
}

/// The sensor of pose sightings, which has no file of its own.
fn poses() -> SensorEntry {
    SensorEntry { kind: Some("poses".to_owned()), ..SensorEntry::default() }
}
