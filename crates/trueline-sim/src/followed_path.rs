//! A robot that follows a path that was written down, pose by pose.

use trueline_geometry::trajectory::TrajectoryError;
use trueline_geometry::{Pose, Trajectory};

/// Poses over time, straight and at constant rate between them; at rest before the first and after the last.
#[derive(Clone, Debug)]
pub struct FollowedPath {
    trajectory: Trajectory,
    ends: [Pose; 2],
}

impl FollowedPath {
    /// The path through poses at rising times, s.
    ///
    /// # Errors
    /// Fewer than two poses, or times that do not rise.
    pub fn new(times_s: Vec<f64>, poses: &[Pose]) -> Result<Self, TrajectoryError> {
        let trajectory = Trajectory::new(times_s, poses)?;
        let last = *poses.last().ok_or(TrajectoryError::TooFewSamples)?;
        Ok(Self { trajectory, ends: [poses[0], last] })
    }

    /// Time of the last pose, s.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.trajectory.span().1
    }

    /// True pose of the tool at a time, s.
    #[must_use]
    pub fn base_from_tool(&self, time_s: f64) -> Pose {
        let (start_s, end_s) = self.trajectory.span();
        let index = self.trajectory.bracket(time_s.clamp(start_s, end_s));
        let segment = index.and_then(|index| self.trajectory.segments().get(index));
        segment.map_or(self.ends[usize::from(time_s > end_s)], |segment| {
            segment.pose_at(time_s.clamp(start_s, end_s))
        })
    }
}
