//! The models of a scan that were fitted.

use serde::{Deserialize, Serialize};

/// A model that was fitted to the seam points.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct ModelEntry {
    /// Whether the answer is of this model.
    pub taken: bool,
    /// Why it was fitted: `asked`, `noise-alone` (where an adjustment with all errors begins), `tests-what-is-held`, `residuals-show-lens`,
    /// `tests-lag` or `residuals-show-lag` (poses that were commanded), `line-refused`, `curve-explains` or `curve-no-better`.
    pub because: String,
    /// What it takes the seam for, `seam` (a straight line with a bow) or `curve`; absent where no curve was tried.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
    /// Logarithm of the restricted likelihood, by which line and curve compare; absent where no curve was tried.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub log_evidence: Option<f64>,
    /// How far the arm lags behind its recorded poses in it.
    pub robot_lag_s: f64,
    /// The sensor's own shape: `estimated`, `considered` (known with a covariance that the scan does not improve), or `held`.
    pub sensor: String,
    /// The time offset: `estimated` or `held`.
    pub time_offset: String,
    /// Lines that are held where a drawing has them.
    pub drawn_lines: usize,
    /// The features' bias with the tilt: `estimated`, `considered` or `held`.
    pub feature_bias: String,
    /// The clock of the images: `even`, `drifts`, `steps`, or `none` at stops.
    pub clock: String,
    /// Logarithm of the likelihood of all features and of what was known beforehand, at the best fit; 0 for no residuals at all.
    pub log_likelihood: f64,
    /// How much larger the residuals are than expected.
    pub noise_factor: f64,
}
