//! Reasons and warnings as in the file: a code, a sentence, and the values with their unit in the key.

use serde_json::{Value, json};
use std::collections::BTreeMap;
use trueline_dataset::result_file::Fact;
use trueline_dataset::unit::MM_PER_M;
use trueline_method::assess::cause_kind::CauseKind;
use trueline_method::assess::confounded_causes::ConfoundedCause;
use trueline_method::assess::drawn_line_shift::DrawnLineShift;
use trueline_method::assess::held_off::HeldOff;
use trueline_method::assess::lens::LensCorrection;
use trueline_method::assess::observability::{Group, Unobservable};
use trueline_method::assess::robot_field::RobotSigmas;
use trueline_method::assess::sensor_shape::SensorShape;
use trueline_method::axes::finding::AxisPart;
use trueline_method::input::skip::Skip;
use trueline_method::stripe::outcome::{Apart, Because};
use trueline_method::verdict::{Quantity, Reason, StreamName, Warning};

/// A reason as a fact of the file.
#[must_use]
pub fn reason(reason: &Reason) -> Fact {
    fact(reason.code(), reason.to_string(), reason_values(reason))
}

/// A warning as a fact of the file.
#[must_use]
pub fn warning(warning: &Warning) -> Fact {
    fact(warning.code(), warning.to_string(), warning_values(warning))
}

fn fact(code: &str, text: String, values: Value) -> Fact {
    let values = match values {
        Value::Object(map) => map.into_iter().collect(),
        _ => Default::default(),
    };
    Fact { code: code.to_owned(), text, values }
}

fn reason_values(reason: &Reason) -> Value {
    match reason {
        Reason::Unobservable(what) => unobservable(what),
        Reason::AtStops { stops } => {
            json!({ "parameter": Group::TimeOffset.name(), "directions": [], "stops": stops })
        }
        Reason::MirrorAmbiguity | Reason::UndeterminedTurn | Reason::StatementContradicted => json!({}),
        Reason::WorseMinimum { better_time_offset_s } => {
            json!({ "better_time_offset_s": better_time_offset_s })
        }
        Reason::WrongTimeOffset { time_offset_s, better_time_offset_s, explains, better_explains } => {
            offset_values([time_offset_s, better_time_offset_s], [explains, better_explains])
        }
        Reason::CurveCollapsed { length_m, before_m } => {
            json!({ "length_mm": length_m * MM_PER_M, "before_mm": before_m * MM_PER_M })
        }
        Reason::PartMoved { shift_m } => json!({ "shift_mm": shift_m * MM_PER_M }),
        Reason::BentStripes { because } => json!({ "stripes_decided_by": because.code() }),
        Reason::AmbiguousTimeOffset { answers, .. } => {
            json!({ "time_offsets_s": answers.iter().map(|answer| answer.time_offset_s).collect::<Vec<_>>() })
        }
        Reason::NotConverged { termination } => json!({ "termination": termination.to_string() }),
        Reason::SeamErrorTooLarge { rms_m, ceiling_m, mostly, weakest } => json!({
            "weakest_in_tool": weakest.map(|(direction, _)| direction),
            "rms_mm": rms_m * MM_PER_M, "ceiling_mm": ceiling_m * MM_PER_M, "mostly": mostly.name, "share": mostly.share,
        }),
        Reason::ResidualsTooLarge { noise_factor, .. } => json!({ "noise_factor": noise_factor }),
        Reason::SensorOff { shape, instead, beyond_stated } => {
            let mut facts = sensor_off(shape, instead);
            facts["beyond_stated"] = json!(beyond_stated);
            facts
        }
        Reason::HeldOff { off } => held_off(off),
        Reason::DrawnLineOff { shift } => drawn_line_off(shift),
        Reason::TooFewUsed { used, features, mostly, mostly_count } => {
            json!({ "used": used, "features": features, "mostly": mostly.code(), "mostly_count": mostly_count })
        }
        Reason::CoarseRobotStamps { repeated, rows } => json!({ "repeated": repeated, "rows": rows }),
        Reason::StripesContradict { sigmas, apart } => apart_values(*sigmas, apart),
        Reason::TooManyOutliers { outliers } => {
            json!({ "share": outliers.share(), "outliers": outliers.count, "of": outliers.of })
        }
        Reason::LineOfOutliers { line, outliers } => json!({
            "line": line, "share": outliers.share(), "outliers": outliers.count, "of": outliers.of,
        }),
        Reason::OtherTimeOffset { span_s, step_s, clock } => {
            json!({ "span_s": span_s, "step_s": step_s, "clock": clock.map(StreamName::name) })
        }
        Reason::RobotStreamFroze { span_s } => json!({ "span_s": span_s }),
        Reason::ClockStep { at_s, step_s, sigma_s, pictures } => {
            json!({ "at_s": at_s, "step_s": step_s, "sigma_s": sigma_s, "pictures": pictures })
        }
        Reason::RequirementMissed { quantity, sigma_si, required_si } => {
            measured(*quantity, &[("sigma", *sigma_si), ("required", *required_si)])
        }
        Reason::RequirementUnobservable { quantity, required_si } => {
            measured(*quantity, &[("required", *required_si)])
        }
    }
}

/// Two time offsets, and the part of the features that each explains.
fn offset_values([own_s, better_s]: [&f64; 2], [explains, better_explains]: [&f64; 2]) -> Value {
    json!({
        "time_offset_s": own_s,
        "better_time_offset_s": better_s,
        "explains": explains,
        "better_explains": better_explains,
    })
}

/// A held quantity that the scan contradicts.
fn held_off(off: &HeldOff) -> Value {
    match off {
        HeldOff::TimeOffset { held_s, found_s, sigma_s } => {
            json!({ "held": "time-offset", "held_s": held_s, "found_s": found_s, "sigma_s": sigma_s })
        }
        HeldOff::HandEye { turned_rad, shifted_m, sigmas } => json!({
            "held": "hand-eye", "turned_deg": turned_rad.to_degrees(), "shifted_mm": shifted_m * MM_PER_M, "sigmas": sigmas,
        }),
    }
}

/// Distance between the answers of stripes and seam points.
fn apart_values(sigmas: f64, Apart { point_m, time_offset_s }: &Apart) -> Value {
    json!({ "sigmas": sigmas, "apart_mm": point_m * MM_PER_M, "time_offsets_apart_s": time_offset_s })
}

fn with_used(mut values: Value, used: bool) -> Value {
    values["used"] = json!(used);
    values
}

fn by_code(skipped: &BTreeMap<Skip, usize>) -> serde_json::Map<String, Value> {
    skipped.iter().map(|(why, count)| (why.code().to_owned(), json!(count))).collect()
}

/// Findings along the scan.
fn of_adjustment(warning: &Warning) -> Value {
    match *warning {
        Warning::OtherLine { span_s, features, beside_m } => {
            json!({ "span_s": span_s, "features": features, "beside_mm": beside_m * MM_PER_M })
        }
        Warning::OutlierStretch { span_s, features } => json!({ "span_s": span_s, "features": features }),
        Warning::WavySeam { rms_m }
        | Warning::WavyPlates { rms_m }
        | Warning::RobotMoves { rms_m }
        | Warning::JointLags { rms_m } => json!({ "rms_mm": rms_m * MM_PER_M }),
        Warning::ClockStep { at_s, step_s } => json!({ "at_s": at_s, "step_s": step_s }),
        Warning::KnotsNearWeave { spacing_m, weave_m } => {
            json!({ "spacing_mm": spacing_m * MM_PER_M, "weave_mm": weave_m * MM_PER_M })
        }
        Warning::CurveUntried { why } => json!({ "why": why }),
        Warning::UnusedOnCurve { ref options } => json!({ "options": options }),
        _ => json!({}),
    }
}

fn axis_not_shown(name: &str, part: AxisPart, cure: &str) -> Value {
    json!({ "axis": name, "part": part.code(), "cure": cure })
}

fn cross_validation_shift(warning: &Warning) -> Value {
    let Warning::CrossValidationShift { span_s, quantity, axis, moved_si, sigmas } = warning else {
        return json!({});
    };
    let mut values = measured(*quantity, &[("moved", *moved_si)]);
    values["span_s"] = json!(span_s);
    values["axis"] = json!(axis.map(|axis| axis.name()));
    values["sigmas"] = json!(sigmas);
    values
}

fn warning_values(warning: &Warning) -> Value {
    match warning {
        Warning::FeaturesSkipped { skipped } => json!({ "skipped": by_code(skipped) }),
        Warning::DecidedByUser { by, other_time_offsets_s } => {
            json!({ "by": by.name(), "other_time_offsets_s": other_time_offsets_s })
        }
        Warning::StripeNoise { noise_factor } => json!({ "noise_factor": noise_factor }),
        Warning::WidenedByProfile { by } => json!({ "by": by }),
        Warning::RobotWorse { seems, taken, stated } => robot_worse(*seems, *taken, *stated),
        Warning::PoorlyKnown { scan_alone_m, all_m } => {
            json!({ "seam_error_mm": scan_alone_m * MM_PER_M, "seam_error_with_assumed_mm": all_m * MM_PER_M })
        }
        Warning::StripesSkipped { skipped } => json!({ "skipped": by_code(skipped) }),
        Warning::StripesUnused { why } => json!({ "why": Because::Plates(*why).code() }),
        Warning::StripesStampedApart { later_s } => json!({ "later_s": later_s }),
        Warning::StripesDisagree { sigmas, apart, used } => with_used(apart_values(*sigmas, apart), *used),
        Warning::UncertaintyNotApplied
        | Warning::SensorOfItsOwnScan
        | Warning::MirrorBySensor
        | Warning::CurveFromOnePass => json!({}),
        Warning::AxisNotShown { name, part, cure } => axis_not_shown(name, *part, cure),
        Warning::SensorOff { shape, instead } => sensor_off(shape, instead),
        Warning::LensOff { lens } => lens_off(lens),
        Warning::LikelyCause { kind, size_si, sigma_si, .. } => likely_cause(*kind, *size_si, *sigma_si),
        Warning::FeatureBias { bias, .. } => {
            json!({ "px_per_10deg": bias.px, "sigma_px_per_10deg": bias.sigma_px, "wald": bias.wald })
        }
        Warning::HeldAtGuess { held } => json!({ "held": held.iter().map(unobservable).collect::<Vec<_>>() }),
        Warning::DrawnLineNotNeeded { with_m, without_m } => {
            json!({ "with_mm": with_m * MM_PER_M, "without_mm": without_m * MM_PER_M })
        }
        Warning::OtherLine { .. }
        | Warning::OutlierStretch { .. }
        | Warning::WavySeam { .. }
        | Warning::WavyPlates { .. }
        | Warning::RobotMoves { .. }
        | Warning::JointLags { .. }
        | Warning::ClockStep { .. }
        | Warning::KnotsNearWeave { .. }
        | Warning::CurveUntried { .. }
        | Warning::UnusedOnCurve { .. } => of_adjustment(warning),
        Warning::UnusualNoise { noise_factor, .. } => json!({ "noise_factor": noise_factor }),
        Warning::StructuredResiduals { left } => json!({ "neighbour_correlation": left }),
        Warning::ManyOutliers { share } => json!({ "share": share }),
        Warning::ClockDrift { ppm, sigma_ppm, about_s } => {
            json!({ "drift_ppm": ppm, "drift_sigma_ppm": sigma_ppm, "about_s": about_s })
        }
        Warning::RobotSamplesMissing { missing, of } => json!({ "missing": missing, "of": of }),
        Warning::RepeatedPoses { repeated, rows } => json!({ "repeated": repeated, "rows": rows }),
        Warning::RepeatedRobotStamps { repeated } => json!({ "repeated": repeated }),
        Warning::CoarseStamps { stream, grain_s } => json!({ "stream": stream.name(), "grain_s": grain_s }),
        Warning::StampSteps { stream, steps, period_s } => {
            json!({ "stream": stream.name(), "steps": stamp_steps(steps), "period_s": period_s })
        }
        Warning::CrossValidationMisfit { rms_m, fitted_rms_m } => {
            json!({ "rms_mm": rms_m * MM_PER_M, "fitted_rms_mm": fitted_rms_m * MM_PER_M })
        }
        Warning::CrossValidationShift { .. } => cross_validation_shift(warning),
        Warning::NoPointAtStandOff { stand_off_m } => json!({ "stand_off_mm": stand_off_m * MM_PER_M }),
    }
}

fn stamp_steps(steps: &[(f64, f64)]) -> Vec<Value> {
    steps.iter().map(|(at_s, step_s)| json!({ "at_s": at_s, "step_s": step_s })).collect()
}

/// Size and standard deviation, with the unit of the kind in the key.
fn likely_cause(kind: CauseKind, size_si: f64, sigma_si: f64) -> Value {
    let values = [("size", size_si), ("sigma", sigma_si)];
    Value::Object(values.map(|(name, value)| size_of(kind, name, value)).into_iter().collect())
}

/// A size of a cause, in the unit that its name ends with.
fn size_of(kind: CauseKind, name: &str, value: f64) -> (String, Value) {
    let (unit, scale) = match kind {
        CauseKind::Flex => ("mm_per_m_s2", MM_PER_M),
        CauseKind::Backlash => ("mm", MM_PER_M),
        CauseKind::AttitudeLag | CauseKind::RollingShutter => ("s", 1.0),
        CauseKind::SideBias => ("px", 1.0),
        CauseKind::CommandedPose => ("s2", 1.0),
        CauseKind::Lens => ("k1", 1.0),
        CauseKind::TiltBias => ("px_per_10deg", 1.0),
    };
    (format!("{name}_{unit}"), json!(value * scale))
}

fn lens_off(lens: &LensCorrection) -> Value {
    let [[k1, k2], [sigma_k1, sigma_k2]] = [lens.distortion, lens.sigma];
    json!({ "k1": k1, "k2": k2, "sigma_k1": sigma_k1, "sigma_k2": sigma_k2 })
}

fn sensor_off(shape: &SensorShape, instead: &[ConfoundedCause]) -> Value {
    let [h1, h2, h3, h4, h5] = shape.found.h;
    let found = [h1, h2, h3, h4 / MM_PER_M, h5 / MM_PER_M];
    let instead = instead.iter().map(|cause| {
        let (name, size) = size_of(cause.kind, "size", cause.size);
        Value::Object([("code".to_owned(), json!(cause.kind.code())), (name, size)].into_iter().collect())
    });
    json!({ "shape": found, "wald": shape.wald, "words": shape.words(), "instead": instead.collect::<Vec<_>>() })
}

fn robot_worse(seems: RobotSigmas, taken: RobotSigmas, stated: bool) -> Value {
    json!({
        "position_mm": seems.position_m * MM_PER_M,
        "attitude_deg": seems.attitude_rad.to_degrees(),
        "taken_position_mm": taken.position_m * MM_PER_M,
        "taken_attitude_deg": taken.attitude_rad.to_degrees(),
        "stated": stated,
    })
}

fn drawn_line_off(shift: &DrawnLineShift) -> Value {
    let (beside, turned) = (shift.beside_m.unzip(), shift.turned_rad.unzip());
    json!({
        "line": shift.line,
        "beside_mm": beside.0.map(|m| m * MM_PER_M),
        "beside_sigma_mm": beside.1.map(|m| m * MM_PER_M),
        "turned_rad": turned.0,
        "turned_sigma_rad": turned.1,
    })
}

fn unobservable(what: &Unobservable) -> Value {
    json!({ "parameter": what.group.name(), "directions": what.directions })
}

/// Values of a quantity, with the unit of the file in the key.
fn measured(quantity: Quantity, values: &[(&str, f64)]) -> Value {
    let (name, unit, scale) = match quantity {
        Quantity::TimeOffset => ("time_offset", "s", 1.0),
        Quantity::Rotation => ("hand_eye_rotation", "rad", 1.0),
        Quantity::Translation => ("hand_eye_translation", "mm", MM_PER_M),
        Quantity::SeamPoint => ("seam_point", "mm", MM_PER_M),
    };
    let mut object = json!({ "parameter": name });
    for (key, value_si) in values {
        object[format!("{key}_{unit}")] = json!(value_si * scale);
    }
    object
}
