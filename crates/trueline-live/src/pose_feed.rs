//! Where a simulated robot is while its own program moves it.

use trueline_geometry::{Pose, Trajectory};

/// A path with a rest before and after it.
#[derive(Clone, Debug)]
pub struct PoseFeed {
    path: Trajectory,
    rest_s: f64,
}

impl PoseFeed {
    /// Rests, moves along the path, rests.
    #[must_use]
    pub fn new(path: Trajectory, rest_s: f64) -> Self {
        Self { path, rest_s }
    }

    /// `base_from_tool` at a time after the start.
    #[must_use]
    pub fn at(&self, time_s: f64) -> Pose {
        let (begins_s, ends_s) = self.path.span();
        let at_s = (begins_s + time_s - self.rest_s).clamp(begins_s, ends_s);
        self.path.pose_at(at_s).unwrap_or_else(Pose::identity)
    }

    /// How long it takes, s.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        let (begins_s, ends_s) = self.path.span();
        ends_s - begins_s + 2.0 * self.rest_s
    }
}
