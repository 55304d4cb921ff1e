//! Pose of a simulated robot while its own program moves it.

use nalgebra::Vector3;
use trueline_dataset::RobotSample;
use trueline_geometry::trajectory::TrajectoryError;
use trueline_geometry::{Pose, Trajectory, so3};

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

    /// Duration, s.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        let (begins_s, ends_s) = self.path.span();
        ends_s - begins_s + 2.0 * self.rest_s
    }
}

/// Half a metre along x in 20 s, weaving 20 mm and tilting, from rest to rest.
#[must_use]
pub fn small_s() -> Trajectory {
    let down = so3::exp(&Vector3::new(std::f64::consts::PI, 0.0, 0.0));
    let (mut times, mut poses) = (Vec::new(), Vec::new());
    for k in 0..=5000 {
        let time_s = f64::from(k) * 0.004;
        let done = time_s / 20.0;
        let eased = done.powi(3) * (10.0 - 15.0 * done + 6.0 * done * done);
        let phase = std::f64::consts::TAU * 4.0 * eased;
        let position = Vector3::new(0.7 + 0.5 * eased, 0.02 * phase.sin(), 0.6);
        let turn = Vector3::new(0.15 * (1.5 * phase).sin(), 0.1 * phase.sin(), 0.0);
        times.push(time_s);
        poses.push(Pose::from_parts(position.into(), down * so3::exp(&turn)));
    }
    Trajectory::new(times, &poses).unwrap_or_else(|_| unreachable!("its times rise"))
}

/// The trajectory through a path's poses, from time zero.
///
/// # Errors
/// Times that do not rise.
pub fn through(path: &[RobotSample]) -> Result<Trajectory, TrajectoryError> {
    let times = path.iter().map(|p| (p.stamp_ns - path[0].stamp_ns) as f64 * 1e-9).collect();
    let poses: Vec<Pose> = path.iter().map(|p| p.base_from_tool).collect();
    Trajectory::new(times, &poses)
}
