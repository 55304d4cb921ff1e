//! Assumptions of a placer about its streams.

/// Kind of a stream's stamps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum StampRule {
    /// The samples' times, unchanged: for calibrations with stamps as recorded.
    #[default]
    AsStamped,
    /// Times of arrival of an even clock, delayed to one side: samples are dated by the line along the earliest ones.
    LowerEnvelope,
}

/// When the points of one frame were exposed, after the first of them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Readout {
    /// All at once.
    #[default]
    AtOnce,
    /// One after the other in the order of the slice, s from one to the next.
    ByIndex(f64),
    /// Row by row of the picture, s per row; for pixels.
    ByRow(f64),
    /// Column by column of the picture, s per column; for pixels.
    ByColumn(f64),
}

impl Readout {
    /// When a point is exposed after the first one, s: by its index, and if it is a pixel by its place (u, v).
    #[must_use]
    #[inline]
    pub fn after_s(self, index: usize, pixel: [f64; 2]) -> f64 {
        match self {
            Self::AtOnce => 0.0,
            Self::ByIndex(step_s) => step_s * index as f64,
            Self::ByRow(step_s) => step_s * pixel[1],
            Self::ByColumn(step_s) => step_s * pixel[0],
        }
    }
}

/// How a placer works; the defaults suit a robot that reports its pose every 1 to 12 ms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Kind of stamps of poses.
    pub pose_stamps: StampRule,
    /// Kind of stamps of frames.
    pub frame_stamps: StampRule,
    /// Kind of stamps of external axes.
    pub axis_stamps: StampRule,
    /// Standard deviation of a frame's time that nothing else states, s.
    pub stamp_sigma_s: f64,
    /// When the points of one frame were exposed. The stamp is that of the first index, row 0 or column 0.
    pub readout: Readout,
    /// Half the window of the local fit to the poses, s: that of the calibration.
    pub half_window_s: f64,
    /// Longest time beyond the last pose for which one is predicted, s.
    pub longest_prediction_s: f64,
    /// Standard deviation of the acceleration by which the robot, or an external axis, may leave its present motion, m/s².
    pub acceleration_m_s2: f64,
    /// The same of its rotation, rad/s².
    pub angular_acceleration_rad_s2: f64,
    /// Two poses with a faster tool between them are not a motion, m/s.
    pub fastest_m_s: f64,
    /// The same of its rotation, rad/s.
    pub fastest_rad_s: f64,
    /// Samples of the robot, and of each external axis, that are remembered.
    pub poses_kept: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            pose_stamps: StampRule::AsStamped,
            frame_stamps: StampRule::AsStamped,
            axis_stamps: StampRule::AsStamped,
            stamp_sigma_s: 0.0,
            readout: Readout::AtOnce,
            half_window_s: trueline_geometry::smooth::HALF_WINDOW_S,
            longest_prediction_s: 0.020,
            acceleration_m_s2: 2.0,
            angular_acceleration_rad_s2: 4.0,
            fastest_m_s: 10.0,
            fastest_rad_s: 20.0,
            poses_kept: 4096,
        }
    }
}

/// Fewest poses that are remembered: a local fit needs them.
const FEWEST_POSES: usize = 64;
/// Most of them: an hour at 1 kHz, 0.7 GiB.
const MOST_POSES: usize = 3_600_000;

impl Settings {
    /// The first setting that cannot be, by its name.
    #[must_use]
    pub(crate) fn problem(&self) -> Option<&'static str> {
        let is_positive = |number: f64| number.is_finite() && number > 0.0;
        let is_no_less = |number: f64| number.is_finite() && number >= 0.0;
        let step_s = match self.readout {
            Readout::AtOnce => 0.0,
            Readout::ByIndex(step_s) | Readout::ByRow(step_s) | Readout::ByColumn(step_s) => step_s,
        };
        [
            (is_no_less(self.stamp_sigma_s), "stamp_sigma_s"),
            (step_s.is_finite(), "readout"),
            (is_positive(self.half_window_s) && self.half_window_s <= 1.0, "half_window_s"),
            (
                is_no_less(self.longest_prediction_s) && self.longest_prediction_s <= 1.0,
                "longest_prediction_s",
            ),
            (is_no_less(self.acceleration_m_s2), "acceleration_m_s2"),
            (is_no_less(self.angular_acceleration_rad_s2), "angular_acceleration_rad_s2"),
            (is_positive(self.fastest_m_s), "fastest_m_s"),
            (is_positive(self.fastest_rad_s), "fastest_rad_s"),
            ((FEWEST_POSES..=MOST_POSES).contains(&self.poses_kept), "poses_kept"),
        ]
        .into_iter()
        .find_map(|(is_good, name)| (!is_good).then_some(name))
    }
}
