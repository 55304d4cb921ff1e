//! Contribution of the robot's errors, which follow its pose.
//!
//! The curve absorbs errors that all passes share. Differences between passes move clock and hand-eye transform.

use crate::assess::robot_field::{RobotField, RobotSigmas};
use crate::curve::fit::Fitted;
use crate::curve::moved::Moves;
use crate::curve::readings::Readings;
use crate::curve::rows::Moved;
use crate::curve::sight::moving;
use trueline_geometry::{Pose, se3};

/// Readings at which the robot's errors are evaluated. Of more, every n-th represents the others, because these errors change
/// slowly.
pub(crate) const MOST_READINGS: usize = 800;

/// Displacement of the readings by each mode of the robot's errors, of unit variance, at `most` of the readings.
#[must_use]
pub(crate) fn moves(readings: &Readings, fitted: &Fitted, sigmas: RobotSigmas, most: usize) -> Moves {
    let every = readings.list.len().div_ceil(most).max(1);
    let poses = poses(readings, fitted, every);
    let path: Vec<Pose> = poses.iter().map(|(_, pose)| *pose).collect();
    let Some(field) = RobotField::new(sigmas, &path) else { return Moves::default() };
    let by_pose = |(k, pose): &(usize, Pose)| {
        let seen = fitted.sights[*k].as_ref()?;
        let shift = seen.by_shift * field.sigmas.position_m * every as f64;
        let turn = seen.turn_about(&pose.translation.vector) * field.sigmas.attitude_rad * every as f64;
        let mut by = Moved::zeros(6 * field.modes());
        for (mode, part) in field.at(pose).iter().enumerate() {
            by.columns_mut(6 * mode, 3).copy_from(&(shift * *part));
            by.columns_mut(6 * mode + 3, 3).copy_from(&(turn * *part));
        }
        Some((*k, by))
    };
    let readings = poses.iter().filter_map(by_pose).collect();
    Moves { errors: 6 * field.modes(), readings, every }
}

/// Every n-th reading with a weight, with the robot's pose at each.
fn poses(readings: &Readings, fitted: &Fitted, every: usize) -> Vec<(usize, Pose)> {
    let carries = |k: &usize| fitted.weights[*k] > 0.0;
    let pose = |k: usize| {
        let moving = moving(readings, &readings.list[k], &fitted.state.at)?;
        let attitude = nalgebra::Rotation3::from_matrix_unchecked(moving.attitude);
        let rotation = nalgebra::UnitQuaternion::from_rotation_matrix(&attitude);
        Some((k, se3::from_parts(rotation, moving.position)))
    };
    (0..readings.list.len()).step_by(every).filter(carries).filter_map(pose).collect()
}
