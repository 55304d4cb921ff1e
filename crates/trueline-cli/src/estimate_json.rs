//! A recording that is under way as JSON, for viewers that plot numbers.

use serde_json::{Value, json};
use trueline_cell::{CellState, Progress, RobotBrief};

/// Counts, and the estimate as far as there is one: `null` where a value is not observable yet.
pub(crate) fn of(brief: &RobotBrief, state: &CellState) -> Value {
    let camera = state.camera.unwrap_or_default();
    let mut json = json!({
        "seam_points": 0,
        "time_offset_ms": null,
        "time_offset_sigma_ms": null,
        "translation_sigma_mm": null,
        "rotation_sigma_deg": null,
        "is_enough": null,
        "advice": [],
        "why": null,
        "poses": brief.poses,
        "frames": camera.frames,
        "frames_missing": camera.missing,
    });
    match &state.estimate {
        None => {}
        Some(Progress::Waiting { seam_points, .. }) => json["seam_points"] = json!(seam_points),
        Some(Progress::Refused { seam_points, why }) => {
            json["seam_points"] = json!(seam_points);
            json["why"] = json!(why.to_string());
        }
        Some(Progress::Estimated(estimated)) => {
            let [offset_s, sigma_s] = estimated.time_offset_s.map_or([None; 2], |both| both.map(Some));
            json["seam_points"] = json!(estimated.seam_points);
            json["time_offset_ms"] = json!(offset_s.map(|s| 1e3 * s));
            json["time_offset_sigma_ms"] = json!(sigma_s.map(|s| 1e3 * s));
            json["translation_sigma_mm"] = json!(estimated.translation_sigma_m.map(|m| 1e3 * m));
            json["rotation_sigma_deg"] = json!(estimated.rotation_sigma_rad.map(f64::to_degrees));
            json["is_enough"] = json!(estimated.is_enough);
            json["advice"] = json!(estimated.advice);
        }
    }
    json
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use trueline_cell::Estimated;

    #[test]
    fn what_is_not_observable_is_null_and_units_are_those_of_the_names() {
        let estimated = Estimated {
            seam_points: 400,
            time_offset_s: Some([0.017, 2e-5]),
            translation_sigma_m: None,
            rotation_sigma_rad: Some(0.01),
            is_enough: Some(false),
            advice: vec!["tilt about x".to_owned()],
        };
        let state = CellState { camera: None, estimate: Some(Progress::Estimated(estimated)) };
        let json = of(&RobotBrief::default(), &state);
        assert_eq!(json["seam_points"], 400);
        assert!((json["time_offset_ms"].as_f64().unwrap() - 17.0).abs() < 1e-9);
        assert!((json["time_offset_sigma_ms"].as_f64().unwrap() - 0.02).abs() < 1e-9);
        assert!(json["translation_sigma_mm"].is_null() && json["why"].is_null());
        // 0.01 rad = 0.57296°
        assert!((json["rotation_sigma_deg"].as_f64().unwrap() - 0.572_958).abs() < 1e-6);
    }
}
