//! How far off a seam point is that is measured later.

use serde::{Deserialize, Serialize};

/// Seam error: one standard deviation, three-dimensional, tool frame, root mean square over the field.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct SeamErrorEntry {
    /// All of it.
    pub rms_mm: f64,
    /// The part from the scan alone: noise, stamps and the seam's form.
    pub scan_alone_mm: f64,
    /// The part of the laser plane that the scan visited.
    pub field: FieldEntry,
    /// Its sources; the squares add up.
    pub budget_mm: BudgetEntry,
    /// The best remedy for the largest part: a statement, or a motion.
    pub remedy: Option<String>,
    /// Robot accuracy that was assumed or stated.
    pub robot_accuracy_mm: f64,
    /// Whether it was stated.
    pub robot_is_stated: bool,
    /// Feature bias per 10° of tilt that was assumed or stated.
    pub feature_bias_px: f64,
    /// Radius of the seam's edge that was assumed or stated.
    pub edge_radius_mm: f64,
    /// Whether it was stated.
    pub edge_is_stated: bool,
}

/// A rectangle of the laser plane.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct FieldEntry {
    /// Along the stripe.
    pub width_mm: f64,
    /// Away from the sensor.
    pub depth_mm: f64,
}

/// The parts of a seam error.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct BudgetEntry {
    /// Noise of features, robot and stamps.
    pub noise: f64,
    /// Error common to all stamps: it acts like an error of the time offset.
    pub stamps: f64,
    /// The sensor's own calibration.
    pub sensor: f64,
    /// The robot's accuracy.
    pub robot: f64,
    /// The seam's form.
    pub seam_form: f64,
    /// The rest of the features' bias with the tilt, if it is not a block of an adjustment.
    pub feature_bias: f64,
    /// Quantities held fixed and not known exactly.
    pub held: f64,
    /// The radius of the seam's edge.
    pub edge_radius: f64,
    /// The detector's bias with the tilt, as a block of an adjustment.
    pub detector: f64,
    /// The robot's lag behind its recorded poses.
    pub pose_lag: f64,
    /// Prior knowledge of external axes; absent without axes.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub axes: f64,
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde asks with a reference")]
fn is_zero(share: &f64) -> bool {
    *share == 0.0
}
