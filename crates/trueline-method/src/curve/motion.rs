//! The robot's pose at any time with its velocities. Velocities use more than one interval of the stream.

use nalgebra::{Matrix3, Vector3};
use trueline_geometry::{Trajectory, so3};

/// Velocities are differences over twice this, s. Over one interval of 4 ms the noise of the stream would be 7 mm/s.
const HALF_S: f64 = 0.02;
/// Spacing of the stored velocities, s: a swing of the tool at 5 Hz changes them by 0.1 % of its size in between.
const GRID_S: f64 = 0.004;

/// The path with its velocities.
#[derive(Clone, Debug)]
pub(crate) struct Motion {
    trajectory: Trajectory,
    start_s: f64,
    grid: Vec<Node>,
}

/// The robot at a time of the grid.
#[derive(Clone, Copy, Debug)]
struct Node {
    /// Attitude and position; `None` in gaps.
    pose: Option<(Matrix3<f64>, Vector3<f64>)>,
    /// Body rate in the tool, rad/s, and velocity in base, m/s.
    rates: [Vector3<f64>; 2],
}

/// The robot at a time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moving {
    /// Attitude of the tool in base.
    pub attitude: Matrix3<f64>,
    /// Its position in base, m.
    pub position: Vector3<f64>,
    /// Body rate, rad/s, in the tool's frame.
    pub body_rate: Vector3<f64>,
    /// Velocity in base, m/s.
    pub velocity: Vector3<f64>,
}

impl Motion {
    /// Of a path.
    #[must_use]
    pub(crate) fn new(trajectory: &Trajectory) -> Self {
        let (start_s, end_s) = trajectory.span();
        let count = ((end_s - start_s) / GRID_S).ceil() as usize + 1;
        let node = |k: usize| {
            let time_s = start_s + k as f64 * GRID_S;
            let pose = trajectory.segment_at(time_s).map(|segment| segment.pose_at(time_s));
            let pose =
                pose.map(|pose| (pose.rotation.to_rotation_matrix().into_inner(), pose.translation.vector));
            Node { pose, rates: rates(trajectory, time_s) }
        };
        Self { trajectory: trajectory.clone(), start_s, grid: (0..count).map(node).collect() }
    }

    /// The nodes about a time, s, and the fraction of the way between them.
    #[inline]
    fn about(&self, time_s: f64) -> (&Node, &Node, f64) {
        let place = (time_s - self.start_s) / GRID_S;
        let before = (place.max(0.0) as usize).min(self.grid.len() - 1);
        let after = (before + 1).min(self.grid.len() - 1);
        (&self.grid[before], &self.grid[after], (place - before as f64).clamp(0.0, 1.0))
    }

    /// The same to within a few micrometres, several times faster: linear between two times of the grid.
    #[must_use]
    #[inline]
    pub(crate) fn nearly_at(&self, time_s: f64) -> Option<Moving> {
        let end_s = self.start_s + (self.grid.len() - 1) as f64 * GRID_S;
        if !(self.start_s..=end_s).contains(&time_s) {
            return None;
        }
        let (before, after, part) = self.about(time_s);
        let ((from, at_m), (to, then_m)) = (before.pose?, after.pose?);
        let between = |k: usize| before.rates[k] * (1.0 - part) + after.rates[k] * part;
        Some(Moving {
            attitude: from * (1.0 - part) + to * part,
            position: at_m * (1.0 - part) + then_m * part,
            body_rate: between(0),
            velocity: between(1),
        })
    }

    /// At a time, s; `None` outside of the recording and in gaps.
    #[must_use]
    #[inline]
    pub(crate) fn at(&self, time_s: f64) -> Option<Moving> {
        let pose = self.trajectory.segment_at(time_s)?.pose_at(time_s);
        let (before, after, part) = self.about(time_s);
        let between = |k: usize| before.rates[k] * (1.0 - part) + after.rates[k] * part;
        Some(Moving {
            attitude: pose.rotation.to_rotation_matrix().into_inner(),
            position: pose.translation.vector,
            body_rate: between(0),
            velocity: between(1),
        })
    }
}

/// Velocities about a time, s; near a gap those of one interval.
fn rates(trajectory: &Trajectory, time_s: f64) -> [Vector3<f64>; 2] {
    let (start_s, end_s) = trajectory.span();
    let [from_s, to_s] = [time_s - HALF_S, time_s + HALF_S].map(|at_s| at_s.clamp(start_s, end_s));
    match (trajectory.pose_at(from_s), trajectory.pose_at(to_s)) {
        (Some(from), Some(to)) if to_s > from_s => {
            let lasts_s = to_s - from_s;
            let turn = so3::log(&(from.rotation.inverse() * to.rotation));
            [turn / lasts_s, (to.translation.vector - from.translation.vector) / lasts_s]
        }
        _ => trajectory
            .segment_at(time_s.clamp(start_s, end_s))
            .map_or([Vector3::zeros(); 2], |segment| [segment.body_rate, segment.velocity]),
    }
}
