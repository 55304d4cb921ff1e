//! Residuals, and checks of the estimate.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Residual figures.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct Residuals {
    /// Root mean square in the image; null if features are not pixels.
    pub rms_px: Option<f64>,
    /// Root mean square distance from the line in base; null if no feature could be used.
    pub rms_mm: Option<f64>,
    /// Root mean square angle between sighted and predicted attitude of a target; absent if no target was sighted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rms_deg: Option<f64>,
    /// Features within the range of noise.
    pub inliers: usize,
    /// Features beyond it.
    pub outliers: usize,
    /// Both together.
    pub used: usize,
    /// Features that could not be used, by the code of the reason.
    pub skipped: BTreeMap<String, usize>,
    /// How much larger the residuals are than expected.
    pub noise_factor: f64,
    /// RMS of the points about the laser plane that was fitted to them; null if the plane was given.
    pub sheet_fit_rms_mm: Option<f64>,
    /// Every outlier.
    pub outlier_list: Vec<OutlierEntry>,
}

/// A feature beyond the range of noise.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct OutlierEntry {
    /// Its row among the features, from 0.
    pub row: u32,
    /// Its line.
    pub line: u32,
    /// Its stamp as recorded, ns.
    pub stamp_ns: i64,
    /// How far off it is in standard deviations.
    pub sigmas: f64,
}

/// Checks of the estimate.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct Checks {
    /// The next best time offset; null if there is none within the searched range.
    pub runner_up: Option<RunnerUp>,
    /// Parts of the scan against each other; null for a scan that is too short.
    pub held_out: Option<CrossValidation>,
    /// The most likely step of a clock, even if it is not significant.
    pub largest_clock_step: Option<ClockStep>,
    /// Stretches of the scan that do not belong to the rest.
    pub disruptions: Vec<Disruption>,
}

/// Another minimum over the time offset.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct RunnerUp {
    /// Its time offset.
    pub time_offset_s: f64,
    /// Part of the features that it explains.
    pub explains: f64,
    /// The same of the best.
    pub best_explains: f64,
    /// How clearly the best is better: z of the paired test over frames.
    pub z: f64,
    /// Whether it lost by more than chance can do.
    pub decided: bool,
}

/// Each part of the scan left out in turn.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct CrossValidation {
    /// `passes` over the line, or `blocks of time`.
    pub parts: String,
    /// Root mean square distance from the prediction of the other parts.
    pub rms_mm: f64,
    /// The same if nothing but noise is at work.
    pub expected_rms_mm: f64,
    /// Root mean square distance of the same points from the fitted line.
    pub fitted_rms_mm: f64,
    /// The parts.
    pub left_out: Vec<LeftOut>,
}

/// One part left out.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct LeftOut {
    /// First and last stamp.
    pub span_s: [f64; 2],
    /// Root mean square distance of its points from the prediction of the rest.
    pub rms_mm: f64,
    /// How the estimate moves without it.
    pub moved: Moved,
    /// The largest of these in standard deviations.
    pub largest_sigmas: f64,
}

/// A change of the estimate.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Moved {
    /// Of the time offset.
    pub time_offset_s: f64,
    /// Of the rotation about the tool's axes.
    pub rotation_rad: [f64; 3],
    /// Of the translation along the tool's axes.
    pub translation_mm: [f64; 3],
}

/// A step of a clock.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ClockStep {
    /// When.
    pub at_s: f64,
    /// How high.
    pub step_s: f64,
    /// Its standard deviation.
    pub sigma_s: f64,
}

/// A stretch of the scan that does not belong to the rest.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Disruption {
    /// First and last stamp.
    pub span_s: [f64; 2],
    /// Features in it.
    pub features: usize,
    /// `robot_stood_still`, `clock_step`, `other_line` or `unknown`.
    pub cause: String,
    /// `step_s` of a clock, `beside_mm` of another line.
    pub amount: Option<BTreeMap<String, f64>>,
}

/// Error of a seam point in use, one standard deviation.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct AtTorch {
    /// Speed along the seam.
    pub speed_mm_s: f64,
    /// Distance of the seam from the sensor.
    pub stand_off_mm: f64,
    /// Along the seam.
    pub sigma_along_mm: f64,
    /// Across it.
    pub sigma_across_mm: f64,
    /// Towards the sensor.
    pub sigma_height_mm: f64,
    /// The same as an ellipsoid.
    pub ellipsoid: Ellipsoid,
}

/// An ellipsoid of one standard deviation.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Ellipsoid {
    /// Semi-axes, longest first.
    pub semi_axes_mm: [f64; 3],
    /// Their unit directions in base.
    pub directions_in_base: [[f64; 3]; 3],
}
