//! The options of the command.

use serde::{Deserialize, Serialize};

/// The options of a calibration.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct Options {
    /// Measurement used: `auto`, `seam`, `stripe` or `both`.
    #[serde(rename = "use")]
    pub measurements: String,
    /// Which residual.
    pub residual: String,
    /// Which loss, with its scale.
    pub loss: String,
    /// Whether the robot stood at each reading, so that there is no time offset.
    pub at_stops: bool,
    /// Quantities held fixed.
    pub fix: Vec<String>,
    /// Its uncertainty; null is exact.
    pub fixed_sigma: RequireOptions,
    /// Lines that were held where a drawing has them.
    pub drawn_lines: Vec<DrawnLineOptions>,
    /// The drawing of a curved seam; absent if there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seam_cad: Option<String>,
    /// How far the seam might be off it, one standard deviation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cad_tolerance_mm: Option<f64>,
    /// Scatter of the part's place between passes over its seam; absent if it stays.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub part_moves: Option<PartMovesOptions>,
    /// Expected noise of a feature where the recording does not say.
    pub feature_sigma_px: f64,
    /// The same of sensors that report lengths.
    pub feature_sigma_mm: f64,
    /// Noise of the robot's position; null if it was measured.
    pub robot_sigma_mm: Option<f64>,
    /// Jitter of an image stamp; null if it was measured.
    pub stamp_sigma_s: Option<f64>,
    /// Which stamps were used: `auto`, `raw` or `regular`.
    pub stamps: String,
    /// Treatment of the sensor's own calibration: `fixed`, `prior` or `free`.
    pub sensor: String,
    /// Absolute accuracy of the robot; null is the value of sensor.toml, or 0.5.
    pub robot_accuracy_mm: Option<f64>,
    /// Bias of the features per 10° of tilt.
    pub feature_bias_px: f64,
    /// Radius of the seam's edge; null is the value of sensor.toml, or 0.3.
    pub edge_radius_mm: Option<f64>,
    /// Waviness of the seam; null is the value of sensor.toml, or 0.06, which the scan corrects.
    pub waviness_mm: Option<f64>,
    /// Stated window of the time offset.
    pub offset_within_s: Option<f64>,
    /// Stated tool axis along which the sensor looks.
    pub looks: Option<String>,
    /// Whether unobservable quantities could be held at the guess.
    pub accept_partial: bool,
    /// Whether the ± is that of the true transform, as another robot needs it.
    pub strict: bool,
    /// Accuracy that was required.
    pub require: RequireOptions,
    /// Working speed of `at_torch`.
    pub speed_mm_s: f64,
    /// Working distance of `at_torch`; null is the scan's own.
    pub stand_off_mm: Option<f64>,
    /// The time offset was searched between plus and minus this.
    pub offset_search_s: f64,
}

/// A line of a drawing.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct DrawnLineOptions {
    /// Its number among the features.
    pub line: usize,
    /// A point of it, in base.
    pub anchor_mm: [f64; 3],
    /// Unit vector along it, in base.
    pub direction: [f64; 3],
    /// Standard deviation of its direction about any axis.
    pub direction_sigma_rad: f64,
    /// Standard deviation of its place to any side.
    pub offset_sigma_mm: f64,
}

/// Scatter of a part's place, one standard deviation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PartMovesOptions {
    /// Of the shift along each axis.
    pub shift_mm: f64,
    /// Of the turn about each axis.
    pub turn_deg: f64,
}

/// Standard deviations of the time offset and the hand-eye transform; null if there is none.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct RequireOptions {
    /// Of the time offset.
    pub time_offset_s: Option<f64>,
    /// Of the rotation.
    pub rotation_rad: Option<f64>,
    /// Of the translation.
    pub translation_mm: Option<f64>,
    /// Of a seam point that is measured later.
    pub seam_mm: Option<f64>,
}
