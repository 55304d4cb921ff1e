//! Inputs of an adjustment beside its sights and a state.

use crate::adjustment::clamped::Clamped;
use crate::adjustment::coloured::Coloured;
use crate::adjustment::error_sizes::Amplitudes;
use crate::assess::levels::SystematicLevels;
use crate::assess::robot_field::RobotField;

/// Inputs of an adjustment beside a problem and a state.
#[derive(Clone, Copy)]
pub(crate) struct Settings<'a> {
    /// Components of the tangent that are held.
    pub fixed: &'a [usize],
    /// Held components that are not exactly known, with their standard deviations, SI.
    pub held_sigmas: &'a [(usize, f64)],
    /// Assumed levels of the systematic errors.
    pub levels: SystematicLevels,
    /// Initial RMS of the seam's form beyond its bow, m. 0 for none.
    pub waviness_m: f64,
    /// Ratio of the actual noise to the expected noise by which the problem is whitened.
    pub noise_factor: f64,
    /// A possible step of the clocks: its time, s, and its size, s.
    pub step: Option<(f64, f64)>,
    /// Lag of the robot behind the poses of the problem, as assumed there, s. 0 for none.
    pub lag_s: f64,
    /// Prior standard deviation of the joints' own lags, s. 0 for none.
    pub joint_lags_s: f64,
    /// Passes of a part that moves between them. `None` for a part at rest.
    pub part: Option<&'a Clamped>,
    /// Prior standard deviation of each number of the external axes, SI. Empty without axes.
    pub axis_sigmas: &'a [f64],
    /// Errors of the robot over the poses of the same scan. `None` for those over the poses of these frames.
    pub field: Option<&'a RobotField>,
    /// Noise of a similar model of the same scan, from which the search of the likeliest noise starts. `None` for a search over all.
    pub noise: Option<[Coloured; 2]>,
    /// Threads that share the work.
    pub threads: usize,
}

impl Settings<'_> {
    /// The same for a similar model of a scan of seam points that was adjusted already, with these errors.
    #[must_use]
    pub(crate) fn near(&self, found: &Amplitudes) -> Self {
        Self { noise: found.lasting.as_slice().try_into().ok(), ..*self }
    }
}
