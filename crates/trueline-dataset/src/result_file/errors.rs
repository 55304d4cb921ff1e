//! Estimates of errors that are not noise, if the answer was adjusted with them.

use serde::{Deserialize, Serialize};

/// The sizes of the errors that the answer was adjusted with.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct ErrorsFoundEntry {
    /// White noise of both directions of a reading, in units of the expected one.
    pub white_noise: [f64; 2],
    /// Standard deviation of the noise that lasts from frame to frame, in units of the white noise of its direction.
    pub lasting_noise: [f64; 2],
    /// How long it is alike.
    pub lasts_s: f64,
    /// Root mean square of the seam's form beyond its bow.
    pub seam_form_mm: f64,
    /// Root mean square error of the arm's poses, across the seam.
    pub robot_mm: f64,
    /// How many times as far off as stated or assumed the arm is; null for an ideal one.
    pub robot_times: Option<f64>,
    /// Lag of the arm behind its recorded poses, if these were commanded; else 0.
    pub robot_lag_s: f64,
    /// Frames that were left out.
    pub frames_left_out: usize,
    /// Frames that took part.
    pub frames: usize,
}
