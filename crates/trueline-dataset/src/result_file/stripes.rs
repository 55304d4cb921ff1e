//! The plates from whole stripes, and their answer beside that of the seam points.

use super::answer::{PoseEntry, Sigma};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A plate in base: normal · p = offset.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct PlaneEntry {
    /// Its number among the stripes.
    pub label: String,
    /// Unit normal; null if it is not observable.
    pub normal: Option<[f64; 3]>,
    /// Distance from the base's origin along the normal; null if it is not observable.
    pub offset_mm: Option<f64>,
    /// One standard deviation of the normal, about its least certain axis.
    pub sigma_deg: Option<f64>,
    /// One standard deviation of the offset in the middle of the scan.
    pub sigma_mm: Option<f64>,
    /// Largest distance of the visible surface from the plane that fits it best.
    pub bow_mm: f64,
}

/// An angle with its ±.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct AngleEntry {
    /// The angle.
    pub angle_deg: f64,
    /// One standard deviation.
    pub sigma_deg: f64,
}

/// A length with its ±.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct HeightStepEntry {
    /// The length.
    pub step_mm: f64,
    /// One standard deviation.
    pub sigma_mm: f64,
}

/// One of two answers of a scan.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct AnswerEntry {
    /// Time offset; null if it is not observable.
    pub time_offset_s: Option<f64>,
    /// Hand-eye transform, null likewise.
    pub tool_from_camera: PoseEntry,
    /// One standard deviation of everything that is accounted for.
    pub sigma: Sigma,
    /// Seam error, one standard deviation; null where the hand-eye is not all observable.
    pub seam_error_mm: Option<f64>,
    /// Its part from the scan alone.
    pub seam_error_scan_alone_mm: Option<f64>,
}

/// Use of a recording's stripes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct StripesEntry {
    /// Measurement used for the result: `seam`, `stripe` or `both`.
    pub used: String,
    /// Reason: `asked`, `agreement`, `disagreement`, `knows-less`, `shows-less`, `too-few-frames`,
    /// `held-at-guess`, `plates-missing`, `plates-without-plane`, `plates-not-converged`, `stripes-scattered`,
    /// `parallel-plates` or `edge-elsewhere`.
    pub decided_by: String,
    /// Frames with a seam point or a stripe.
    pub frames: usize,
    /// Frames with the stripes on both plates; for a joint with one visible plate, with its stripe and the seam point.
    pub frames_with_both: usize,
    /// Stripes that could not be used, by reason.
    pub skipped: BTreeMap<String, usize>,
    /// Stripes (and, with `both`, seam points) in the estimate.
    pub stripes: usize,
    /// Of the stripes, how many were left out as outliers.
    pub rejected: usize,
    /// Points of the edge of a lap, a step or one plate in the estimate.
    pub edge_points: usize,
    /// Of the edge points, how many were left out as outliers.
    pub rejected_edge_points: usize,
    /// How much larger their noise is than expected.
    pub noise_factor: Option<f64>,
    /// How far the answers of seam points and stripes are apart, in sigma.
    pub sigmas_apart: Option<f64>,
    /// The angle that the plates of each joint open.
    pub joint_angles: Vec<AngleEntry>,
    /// How far the lower plate of each lap or step lies below the other.
    pub joint_steps: Vec<HeightStepEntry>,
    /// The answer of the seam points.
    pub seam_answer: Option<AnswerEntry>,
    /// The answer of the stripes.
    pub stripe_answer: Option<AnswerEntry>,
}
