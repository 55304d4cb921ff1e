//! The truth of a cell as `truth.json`: the fields that the project's judge of shop cells reads, in mm, degrees and s.

use super::truth::{CheckPoint, ShopTruth};
use nalgebra::Vector3;
use serde_json::{Map, Value, json};

const MM_PER_M: f64 = 1e3;
/// Digits after the point of lengths in mm and of directions.
const DIGITS: f64 = 1e9;

impl ShopTruth {
    /// The text of `truth.json`.
    #[must_use]
    pub fn to_json(&self) -> String {
        let pose = &self.tool_from_camera;
        let q = pose.rotation.quaternion();
        let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
        let rotation_wxyz = [q.w, q.i, q.j, q.k].map(|value| sign * value);
        let errors: Map<String, Value> = self
            .errors
            .iter()
            .map(|(row, size)| (row.name.to_owned(), json!({"size": size, "unit": row.unit.0})))
            .collect();
        let value = json!({
            "about": self.about(),
            "level": self.level.name(),
            "seed": self.seed,
            "motion": self.motion.name(),
            "sensor": self.sensor,
            "arm": self.arm,
            "duration_s": self.duration_s,
            "tilt_deg": self.tilt_rad.to_degrees(),
            "seen_share": self.seen_share,
            "outlier_share": self.outlier_share,
            "bound_mm": self.bound_m * MM_PER_M,
            "good_scan": self.is_good_scan(),
            "time_offset_s": self.time_offset_s,
            "time_offset_interval_s": self.time_offset_interval_s,
            "tool_from_camera": {
                "translation_mm": mm(&pose.translation.vector),
                "rotation_wxyz": rotation_wxyz,
            },
            "errors": errors,
            "t0_s": self.start_s,
            "speed_mm_s": self.speed_m_s * MM_PER_M,
            "points_in_tool_mm": self.each(|point| json!(mm(&point.in_tool))),
            "velocity_in_tool": self.each(|point| json!(rounded(&point.velocity_in_tool))),
            "reported_rotation": self.each(rows_of_rotation),
            "reported_position_mm": self.each(|point| json!(mm(&point.reported.translation.vector))),
            "torch_reference_mm": self.each(|point| json!(mm(&point.torch_reference.unwrap_or_default()))),
            "torch_reached": self.each(|point| json!(point.torch_reference.is_some())),
        });
        format!("{value:#}\n")
    }

    fn each(&self, of: impl Fn(&CheckPoint) -> Value) -> Value {
        Value::Array(self.points.iter().map(of).collect())
    }
}

fn rows_of_rotation(point: &CheckPoint) -> Value {
    let matrix = point.reported.rotation.to_rotation_matrix().into_inner();
    json!([0, 1, 2].map(|row| rounded(&matrix.row(row).transpose())))
}

fn mm(vector: &Vector3<f64>) -> [f64; 3] {
    rounded(&(vector * MM_PER_M))
}

fn rounded(vector: &Vector3<f64>) -> [f64; 3] {
    <[f64; 3]>::from(*vector).map(|value| (value * DIGITS).round() / DIGITS)
}
