//! The sizes of all errors as an adjustment estimates them, and whether these explain the residuals.

use crate::adjustment::coloured::Coloured;
use crate::assess::outliers::Outliers;

/// Estimated errors.
#[derive(Clone, Debug, PartialEq)]
pub struct Amplitudes {
    /// Standard deviation of the white noise of each residual of a frame, in units of the expected noise: two of a seam point, two of each plate, one
    /// of an edge point.
    pub white: Vec<f64>,
    /// The correlated part of the noise of each.
    pub lasting: Vec<Coloured>,
    /// RMS of the form of the seam, or of the plates, over the frames, m.
    pub form_m: f64,
    /// Size of each form relative to the expected one.
    pub forms: Vec<f64>,
    /// RMS of the robot's error at the measured point that the hand-eye transform does not absorb, m.
    pub robot_m: f64,
    /// Robot error relative to its class. `None` for an ideal robot.
    pub robot: Option<f64>,
    /// Whether the robot error is at its upper bound.
    pub robot_is_worst: bool,
    /// The square of a lag of the robot behind its poses, estimated beside all blocks, and its standard deviation, s².
    pub squared_lag_s2: (f64, f64),
    /// The assumed lag, s.
    pub lag_s: f64,
    /// RMS of what the joints' own lags move across the seam, m. `None` if they were not estimated.
    pub joint_lags_m: Option<f64>,
    /// A step of the time offset, estimated beside all blocks, and its standard deviation, s. `None` if the residuals from noise alone show no step.
    pub step_s: Option<(f64, f64)>,
    /// Frames that were left out, among those used.
    pub out: Outliers,
    /// Frames that deviate themselves. A frame between two of them is left out too.
    pub outliers: Outliers,
}

/// Least size of a significant step, standard deviations.
const STEP_SIGMAS: f64 = 4.0;

impl Amplitudes {
    /// Whether a step of the time offset stays significant beside correlated noise and all other errors.
    #[must_use]
    pub fn show_a_step(&self) -> bool {
        self.step_s.is_some_and(|(step_s, sigma_s)| step_s.abs() > STEP_SIGMAS * sigma_s)
    }

    /// Whether form or robot exceed what they can be.
    #[must_use]
    pub fn are_beyond(&self) -> bool {
        self.forms.iter().any(|form| *form > MOST_FORM)
            || (self.robot_is_worst && self.robot_m > WORST_SHIFT_M)
    }

    /// Total noise relative to the expected noise, in the direction where it is larger.
    #[must_use]
    pub fn noise_times(&self) -> f64 {
        let times = |(noise, white): (&Coloured, &f64)| white * (1.0 + noise.lasting()).sqrt();
        self.lasting.iter().zip(&self.white).map(times).fold(0.0, f64::max)
    }
}

/// Largest robot error along a scan that the hand-eye transform does not absorb, m.
const WORST_SHIFT_M: f64 = 1e-3;
/// A form above this multiple of the expected size belongs to another seam.
const MOST_FORM: f64 = 9.0;
