//! The result as JSON, schema version 1; the same that Python returns.
//!
//! What is not seen is null, never a made-up number; so is the sigma of what was held fixed.

use crate::trust;
use serde_json::{Map, Value, json};
use trueline_dataset::unit::MM_PER_M;
use trueline_geometry::Line;
use trueline_method::hypotheses::ambiguity::RivalAnswer;
use trueline_method::hypotheses::choice::DecidedBy;
use trueline_method::problem::parameters::{ROTATION, TIME_OFFSET, TRANSLATION, line_index};
use trueline_method::{Calibration, Status};

/// Version of the schema below.
pub const SCHEMA_VERSION: u32 = 1;

/// The whole result.
#[must_use]
pub fn result(c: &Calibration) -> Value {
    let status = match c.status {
        Status::Accepted => "accepted",
        Status::NotAccepted => "not_accepted",
    };
    json!({
        "schema_version": SCHEMA_VERSION,
        "tool": { "name": "trueline", "version": env!("CARGO_PKG_VERSION") },
        "status": status,
        "reasons": c.reasons,
        "warnings": c.warnings,
        "time_offset_s": c.is_known(TIME_OFFSET).then_some(c.parameters.time_offset_s),
        "tool_from_camera": tool_from_camera(c),
        "lines": (0..c.parameters.lines.len()).map(|k| line(c, k)).collect::<Vec<_>>(),
        "sigma": sigma(c),
        "covariance": covariance(c),
        "observability": observability(c),
        "residuals": residuals(c),
        "stamps": trust::stamps(c),
        "checks": trust::checks(c),
        "rivals": c.ambiguity.rivals.iter().map(rival).collect::<Vec<_>>(),
        "decided_by": c.ambiguity.decided_by.map(DecidedBy::name),
        "at_torch": trust::at_torch(c),
        "termination": c.termination.to_string(),
        "iterations": iterations(c),
        "inputs": c.inputs,
        "options": options(&c.config),
    })
}

fn tool_from_camera(c: &Calibration) -> Value {
    let t = c.parameters.tool_from_camera.translation.vector * MM_PER_M;
    let translation: Vec<Option<f64>> = (0..3).map(|k| c.is_known(TRANSLATION + k).then_some(t[k])).collect();
    let q = crate::number::positive_w(&c.parameters.tool_from_camera.rotation);
    json!({
        "translation_mm": translation,
        "rotation_wxyz": c.rotation_is_known().then_some(q),
    })
}

/// A complete answer that the scan does not tell from the one given.
fn rival(rival: &RivalAnswer) -> Value {
    let pose = &rival.parameters.tool_from_camera;
    let t = pose.translation.vector * MM_PER_M;
    let lines: Vec<Value> =
        rival.parameters.lines.iter().enumerate().map(|(k, line)| line_entry(k, line, [true; 2])).collect();
    json!({
        "time_offset_s": rival.parameters.time_offset_s,
        "tool_from_camera": {
            "translation_mm": [t.x, t.y, t.z],
            "rotation_wxyz": crate::number::positive_w(&pose.rotation),
        },
        "lines": lines,
        "explains": rival.test.explains,
        "z": rival.test.z,
        "noise_factor": rival.noise_factor,
        "statements": rival.statements.iter().map(ToString::to_string).collect::<Vec<_>>(),
    })
}

fn line(c: &Calibration, k: usize) -> Value {
    let first = line_index(k);
    let direction_seen = c.is_known(first) && c.is_known(first + 1);
    let seen = direction_seen && c.is_known(first + 2) && c.is_known(first + 3);
    line_entry(k, &c.parameters.lines[k], [direction_seen, seen])
}

fn line_entry(k: usize, line: &Line, [direction_seen, seen]: [bool; 2]) -> Value {
    let pluecker = line.to_pluecker();
    let direction: [f64; 3] = pluecker.direction.into();
    let point: [f64; 3] = (line.anchor() * MM_PER_M).into();
    let moment: [f64; 3] = (pluecker.moment * MM_PER_M).into();
    let orthonormal = pluecker.to_orthonormal().map(|o| {
        let w = o.rotation_vector();
        [w.x, w.y, w.z, o.distance * MM_PER_M]
    });
    json!({
        "label": k.to_string(),
        "point_mm": seen.then_some(point),
        "direction": direction_seen.then_some(direction),
        "pluecker": seen.then(|| json!({ "moment_mm": moment, "direction": direction })),
        "orthonormal": orthonormal.filter(|_| seen),
    })
}

fn sigma(c: &Calibration) -> Value {
    let three = |first: usize, scale: f64| -> Vec<Option<f64>> {
        (0..3).map(|k| c.sigma(first + k).map(|s| s * scale)).collect()
    };
    json!({
        "time_offset_s": c.sigma(TIME_OFFSET),
        "rotation_rad": three(ROTATION, 1.0),
        "translation_mm": three(TRANSLATION, MM_PER_M),
    })
}

/// Names and covariance in the units of the names: lengths in mm, angles in rad, time in s.
fn covariance(c: &Calibration) -> Value {
    let names = trueline_method::problem::parameters::names(c.parameters.lines.len());
    let scale = |name: &str| if name.ends_with("_m") { MM_PER_M } else { 1.0 };
    let wire_name = |name: &String| match name.strip_suffix("_m") {
        Some(stem) => format!("{stem}_mm"),
        None => name.clone(),
    };
    let known: Vec<bool> = (0..names.len()).map(|k| c.sigma(k).is_some()).collect();
    let row = |i: usize| -> Vec<Option<f64>> {
        (0..names.len())
            .map(|j| {
                (known[i] && known[j]).then(|| c.covariance[(i, j)] * scale(&names[i]) * scale(&names[j]))
            })
            .collect()
    };
    json!({
        "order": names.iter().map(wire_name).collect::<Vec<_>>(),
        "matrix": (0..names.len()).map(row).collect::<Vec<_>>(),
    })
}

fn observability(c: &Calibration) -> Value {
    let o = &c.observability;
    let unobservable: Vec<Value> = (o.unseen.iter())
        .map(|u| json!({ "parameter": u.group.name(), "direction": u.direction, "advice": u.advice }))
        .collect();
    json!({
        "rank": o.rank,
        "size": o.size,
        "condition": o.condition.is_finite().then_some(o.condition),
        "threshold": trueline_method::assess::observability::RANK_THRESHOLD,
        "unobservable": unobservable,
        "held_at_guess": c.held_at_guess,
    })
}

fn residuals(c: &Calibration) -> Value {
    let r = &c.residuals;
    let outliers: Vec<Value> = c
        .features
        .iter()
        .zip(&c.feature_stamps_ns)
        .filter(|(f, _)| f.is_outlier())
        .map(|(f, stamp_ns)| json!({ "row": f.row, "line": f.line, "stamp_ns": stamp_ns, "sigmas": f.normalised }))
        .collect();
    json!({
        "rms_px": r.rms_px,
        "rms_mm": r.rms_m * MM_PER_M,
        "inliers": r.inliers,
        "outliers": r.outliers,
        "used": r.used,
        "skipped": r.skipped,
        "noise_factor": c.noise_factor,
        "sheet_fit_rms_mm": c.sheet_fit_rms_m.map(|m| m * MM_PER_M),
        "outlier_list": outliers,
    })
}

fn iterations(c: &Calibration) -> Vec<Value> {
    c.iterations
        .iter()
        .map(|i| {
            let t = i.parameters.tool_from_camera.translation.vector * MM_PER_M;
            let q = crate::number::positive_w(&i.parameters.tool_from_camera.rotation);
            json!({
                "cost": i.cost,
                "rms_mm": i.rms_m * MM_PER_M,
                "time_offset_s": i.parameters.time_offset_s,
                "translation_mm": [t.x, t.y, t.z],
                "rotation_wxyz": q,
                "lines": i.parameters.lines.iter().map(|l| {
                    let (p, d) = (l.to_pluecker().nearest_point_to_origin() * MM_PER_M, l.direction());
                    json!({ "nearest_point_mm": [p.x, p.y, p.z], "direction": [d.x, d.y, d.z] })
                }).collect::<Vec<_>>(),
                "accepted": i.accepted,
            })
        })
        .collect()
}

/// The options of a calibration.
#[must_use]
pub fn options(config: &trueline_method::Config) -> Value {
    let mut options = Map::new();
    options.insert("residual".into(), json!(config.residual.name()));
    options.insert("loss".into(), json!(format!("{:?}", config.final_loss())));
    options.insert("fix".into(), json!(config.hold.iter().map(|h| h.name()).collect::<Vec<_>>()));
    options.insert("feature_sigma_px".into(), json!(config.feature_sigma_px));
    options.insert("feature_sigma_mm".into(), json!(config.feature_sigma_m * MM_PER_M));
    options.insert("robot_sigma_mm".into(), json!(config.robot_sigma_m.map(|m| m * MM_PER_M)));
    options.insert("stamp_sigma_s".into(), json!(config.stamp_sigma_s));
    options.insert("stamps".into(), json!(config.stamps.name()));
    options.insert("offset_within_s".into(), json!(config.known.offset_within_s));
    options.insert("looks".into(), json!(config.known.looks.map(|axis| axis.name())));
    options.insert("accept_partial".into(), json!(config.accept_partial));
    options.insert(
        "require".into(),
        json!({
            "time_offset_s": config.require.time_s,
            "rotation_rad": config.require.rotation_rad,
            "translation_mm": config.require.translation_m.map(|m| m * MM_PER_M),
        }),
    );
    options.insert("speed_mm_s".into(), json!(config.used_at.speed_m_s * MM_PER_M));
    options.insert("stand_off_mm".into(), json!(config.used_at.stand_off_m.map(|m| m * MM_PER_M)));
    options.insert("offset_search_s".into(), json!(config.offset_search_s));
    Value::Object(options)
}
