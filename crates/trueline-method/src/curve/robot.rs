//! Effect of the robot on the answer: errors that follow its pose, as columns beside the unknowns \[Schmidt1966\].
//!
//! With r = J x + Z ξ the answer is off by M⁻¹ Jᵀ W Z ξ, with the prior of the curve in M. What all passes share goes into the
//! curve and does no harm; what differs between them goes into clock and hand-eye transform.

use crate::assess::robot_field::{RobotField, RobotSigmas};
use crate::curve::arrow::{ArrowRoot, SHARED};
use crate::curve::equations::{self, COLUMNS};
use crate::curve::fit::Fitted;
use crate::curve::readings::Readings;
use crate::curve::sight::moving;
use nalgebra::{DMatrix, DVector, Vector2};
use trueline_geometry::{Pose, se3, so3};

/// Readings on which the robot's errors are looked at; of more, one in several represents the rest, for these errors change slowly.
const SAMPLE: usize = 800;

/// How far each mode of the robot's errors moves all unknowns: one column each, of unit variance.
#[must_use]
pub(crate) fn columns(
    readings: &Readings,
    fitted: &Fitted,
    root: &ArrowRoot,
    sigmas: RobotSigmas,
) -> DMatrix<f64> {
    let state = &fitted.state;
    let size = 2 * state.spline.control.len() + state.of_place() + SHARED;
    let every = readings.list.len().div_ceil(SAMPLE).max(1);
    let poses = poses(readings, fitted, every);
    let path: Vec<Pose> = poses.iter().map(|(_, pose)| *pose).collect();
    let Some(field) = RobotField::new(sigmas, &path) else {
        return DMatrix::zeros(size, 0);
    };
    let mut sums = DMatrix::zeros(size, 6 * field.modes());
    let normals = state.normals();
    let mut found = [(0, Vector2::zeros()); COLUMNS];
    for (k, pose) in &poses {
        let Some(seen) = &fitted.sights[*k] else { continue };
        let weight = fitted.weights[*k] * every as f64;
        let whitener = &fitted.whiteners[*k];
        let by_point = whitener * seen.by_point * weight;
        let [shift, turn] = [
            by_point * field.sigmas.position_m,
            by_point * -so3::hat(&seen.lever) * field.sigmas.attitude_rad,
        ];
        let count = equations::columns(state, &normals, (seen, whitener), &mut found);
        for (mode, part) in field.at(pose).iter().enumerate() {
            for axis in 0..6 {
                let moved =
                    if axis < 3 { shift.column(axis) } else { turn.column(axis - 3) }.into_owned() * *part;
                let mut column = sums.column_mut(6 * mode + axis);
                for (index, own) in &found[..count] {
                    column[*index] += own.dot(&moved);
                }
            }
        }
    }
    for mut column in sums.column_iter_mut() {
        let solved = root.solve(&DVector::from_column_slice(column.as_slice()));
        column.copy_from(&solved);
    }
    sums
}

/// One in several readings that carry weight, with the robot's pose at each.
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
