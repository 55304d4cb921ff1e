//! The models of a scan that were fitted.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A model that was fitted to the scan.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct ModelEntry {
    /// Whether the answer is of this model.
    pub taken: bool,
    /// Reason for its fit: `asked`, `noise-alone` (start of an adjustment with all errors), `tests-what-is-held`,
    /// `residuals-show-lens`, `tests-lag` or `residuals-show-lag` (commanded poses), `other-measurements` (seam points or
    /// stripes, whichever do not give the answer), `line-refused`, `curve-explains` or `curve-no-better`.
    pub why: String,
    /// What it was fitted to: `seam`, `stripe` or `both`.
    pub measurements: String,
    /// Of each block (`time_offset`, `hand_eye`, `line`, `bow`, `seam_form`, `sensor`, `detector`, `edge_radius`, `robot`, `pose_lag`) whether it is
    /// `estimated`, `considered` (known with a covariance that the scan does not improve), or `held`.
    pub roles: BTreeMap<String, String>,
    /// Model of the seam: `line`, with a bow and a form, or `curve`.
    pub target: String,
    /// The clock of the images: `even`, `drifts`, `steps`, or `none` at stops.
    pub clock: String,
    /// How far the arm lags behind its recorded poses in it.
    pub robot_lag_s: f64,
    /// Logarithm of the likelihood of all measurements and of the prior, at the best fit, up to a constant. Models of the
    /// same measurements and blocks compare by it.
    pub log_evidence: f64,
    /// How much larger the residuals are than expected.
    pub noise_factor: f64,
}
