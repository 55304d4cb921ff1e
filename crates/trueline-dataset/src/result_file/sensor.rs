//! What the scan says of the sensor's own calibration.

use super::answer::PoseEntry;
use serde::{Deserialize, Serialize};

/// The sensor's own calibration.
///
/// With (a, b) in mm along the stripe and in depth from `shape_origin_mm`, the sensor reports (a, b) of a point at
/// ((1 + h1) a + h3 b, (1 + h2) b)/w, w = 1 + h4 a + h5 b.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct SensorEntry {
    /// `fixed`, `prior` or `free`.
    pub mode: String,
    /// h1, h2, h3, h4 per mm, h5 per mm: the whole correction, with what sensor.toml corrects already; null where it was
    /// held.
    pub shape: Option<[f64; 5]>,
    /// One standard deviation of each.
    pub shape_sigma: Option<[f64; 5]>,
    /// Where in the sheet the shape counts from.
    pub shape_origin_mm: Option<[f64; 2]>,
    /// The standard deviations before the scan.
    pub prior_sigma: Option<[f64; 5]>,
    /// Whether sensor.toml states these; else they are assumed.
    pub prior_stated: bool,
    /// Whether the scan tells more of the shape than was known before.
    pub improved: bool,
    /// hᵀ C⁻¹ h of what was found: chi-squared with 5 degrees of freedom for a sensor without fault; above 25 it is off.
    pub wald: Option<f64>,
    /// What was found, in words.
    pub words: Vec<String>,
    /// The hand-eye transform that goes with the file of `--write-sensor`; of a camera it is not `tool_from_camera`, which
    /// goes with the camera and laser plane that were given, and the shape.
    pub corrected_tool_from_camera: Option<PoseEntry>,
    /// What a sensor that takes no correction is served best by.
    pub uncorrected: Option<UncorrectedEntry>,
}

/// The best hand-eye transform for a sensor that takes no correction.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct UncorrectedEntry {
    /// The transform.
    pub tool_from_camera: PoseEntry,
    /// How far off its points then are, RMS over the scan's points, on top of the seam error.
    pub remains_mm: f64,
}
