//! What a result was checked against, as JSON: stamps, clocks, other minima, held-out parts, use.

use serde_json::{Value, json};
use trueline_dataset::unit::MM_PER_M;
use trueline_method::Calibration;
use trueline_method::assess::cross_validation::HeldOut;
use trueline_method::assess::outlier_segments::{Cause, OutlierSegment};
use trueline_method::input::timestamps::StampReport;
use trueline_method::problem::parameters::{ROTATION, TIME_OFFSET, TRANSLATION};

/// Stamps of both streams. Times in the result are seconds since `zero_s`, the stamp of the first robot row.
#[must_use]
pub fn stamps(c: &Calibration) -> Value {
    let mut features = stream(&c.image_stamps);
    features["drift_ppm"] = json!(c.drift.map(|d| d.ppm));
    features["drift_sigma_ppm"] = json!(c.drift.map(|d| d.sigma_ppm));
    features["drift_taken_out"] = json!(c.drifted.is_some());
    features["drift_about_s"] = json!(c.drift.map(|d| d.about_s));
    let mut robot = stream(&c.robot_stamps);
    robot["drift_ppm"] = json!(c.robot_stamps.device_drift_ppm);
    json!({
        "zero_s": c.origin_ns as f64 * 1e-9,
        "robot": robot,
        "features": features,
        "robot_noise_mm": c.robot_noise_m * MM_PER_M,
        "robot_smoothed": c.robot_smoothed,
        "robot_poses_repeated": c.robot_poses_repeated,
    })
}

fn stream(s: &StampReport) -> Value {
    json!({
        "count": s.count,
        "repeated": s.doubles,
        "median_period_s": s.median_period_s,
        "longest_gap_s": s.longest_gap_s,
        "period_s": s.period_s,
        "jitter_s": s.jitter_s,
        "drops": s.missing,
        "silences": s.silences,
        "device_drift_ppm": s.device_drift_ppm,
        "one_sided": s.one_sided,
        "grain_s": s.grain_s,
        "steps": s.steps.iter().map(|(at_s, step_s)| json!({ "at_s": at_s, "step_s": step_s })).collect::<Vec<_>>(),
        "used": if s.dejittered { "regular" } else { "raw" },
    })
}

/// Checks of the estimate.
#[must_use]
pub fn checks(c: &Calibration) -> Value {
    let step = c.step.map(|s| json!({ "at_s": s.at_s, "step_s": s.step_s, "sigma_s": s.sigma_s }));
    json!({
        "runner_up": c.ambiguity.runner_up.map(|r| json!({
            "time_offset_s": r.time_offset_s,
            "explains": r.explains,
            "best_explains": r.best_explains,
            "z": r.z,
            "decided": r.decided(),
        })),
        "held_out": c.held_out.as_ref().map(held_out),
        "largest_clock_step": step,
        "disruptions": c.disruptions.iter().map(disruption).collect::<Vec<_>>(),
    })
}

fn held_out(check: &HeldOut) -> Value {
    let part = |p: &trueline_method::assess::cross_validation::Part| {
        let three = |first: usize, scale: f64| [0, 1, 2].map(|k| p.moved[first + k] * scale);
        json!({
            "span_s": p.span_s,
            "rms_mm": p.rms_m * MM_PER_M,
            "moved": {
                "time_offset_s": p.moved[TIME_OFFSET],
                "rotation_rad": three(ROTATION, 1.0),
                "translation_mm": three(TRANSLATION, MM_PER_M),
            },
            "largest_sigmas": p.sigmas.amax(),
        })
    };
    json!({
        "parts": if check.passes { "passes" } else { "blocks of time" },
        "rms_mm": check.rms_m * MM_PER_M,
        "expected_rms_mm": check.expected_rms_m * MM_PER_M,
        "fitted_rms_mm": check.fitted_rms_m * MM_PER_M,
        "left_out": check.parts.iter().map(part).collect::<Vec<_>>(),
    })
}

fn disruption(d: &OutlierSegment) -> Value {
    let (cause, amount) = match d.cause {
        Cause::RobotStoodStill => ("robot_stood_still", json!({})),
        Cause::ClockStep(step_s) => ("clock_step", json!({ "step_s": step_s })),
        Cause::OtherLine(beside_m) => ("other_line", json!({ "beside_mm": beside_m * MM_PER_M })),
        Cause::Unknown => ("unknown", Value::Null),
    };
    json!({ "span_s": d.span_s, "features": d.features, "cause": cause, "amount": amount })
}

/// What the calibration means at the torch; null if the hand-eye is not all seen.
#[must_use]
pub fn at_torch(c: &Calibration) -> Value {
    let Some(torch) = &c.at_torch else { return Value::Null };
    let [along, across, height] = torch.sigma_m.map(|s| s * MM_PER_M);
    json!({
        "speed_mm_s": torch.speed_m_s * MM_PER_M,
        "stand_off_mm": torch.stand_off_m * MM_PER_M,
        "sigma_along_mm": along,
        "sigma_across_mm": across,
        "sigma_height_mm": height,
        "ellipsoid": {
            "semi_axes_mm": torch.semi_axes_m.map(|s| s * MM_PER_M),
            "directions_in_base": torch.directions_in_base,
        },
    })
}
