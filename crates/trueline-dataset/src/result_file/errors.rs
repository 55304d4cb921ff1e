//! Estimates of errors that are not noise, if the answer was adjusted with them.

use serde::{Deserialize, Serialize};

/// The sizes of the errors that the answer was adjusted with.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct ErrorsFoundEntry {
    /// White noise of each residual of a frame, in units of the expected one: of both directions of a seam point; of two
    /// support points on each plate, and of an edge point.
    pub white_noise: Vec<f64>,
    /// Standard deviation of the noise of each that lasts from frame to frame, in units of its white noise.
    pub lasting_noise: Vec<f64>,
    /// How long that of the first is alike.
    pub lasts_s: f64,
    /// Root mean square of the form of the seam beyond its bow, or of the plates beyond their bow and twist.
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
