//! How what a cut is off by follows the unknowns and the robot, and its whitening.

use super::cut::Cut;
use super::look::{self, Look};
use super::sheet_frame::SheetFrame;
use super::target::{ROWS, Rows, Square};
use crate::board_hand_eye::robot_path::ToolState;
use crate::board_hand_eye::sight_model::{derivative, predicted, robot_derivative};
use crate::board_hand_eye::unknowns::{self, ErrorModel, HAND_EYE, TARGET, TIME_OFFSET, Unknowns};
use nalgebra::{Matrix6, SMatrix, SVector, Vector3, Vector6};
use trueline_model::SheetShape;

/// Number of unknowns: those of a sighted target, the radius, and the sensor's shape.
pub const SIZE: usize = unknowns::SIZE + 1 + SheetShape::DIMENSION;
/// Index of the radius.
pub const RADIUS: usize = unknowns::SIZE;
/// First index of the shape.
pub const SHAPE: usize = RADIUS + 1;

/// What is sought.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoundState {
    /// Time offset, hand-eye transform and the target's pose. Steps of the pose are in the target's own axes.
    pub unknowns: Unknowns,
    /// Radius, m.
    pub radius_m: f64,
    /// The sensor's shape h₁ … h₅, beside the one in its file.
    pub shape: SVector<f64, 5>,
}

/// Measured less predicted, m.
pub(super) fn difference(cut: &Cut, sheet: &SheetFrame, tool: &ToolState, at: &RoundState) -> Rows {
    look::off_m(cut, sheet, &predicted(tool, &at.unknowns), at.radius_m, &at.shape)
}

/// How a cut follows all that it depends on.
pub(super) struct Follows {
    /// d difference / d unknowns.
    pub(super) unknowns: SMatrix<f64, ROWS, SIZE>,
    /// d difference / d (turn of the tool about its origin, its shift), in the carrier's axes.
    pub(super) robot: SMatrix<f64, ROWS, 6>,
    /// Covariance of the difference by the points' noise, m².
    noise: Square,
}

impl Follows {
    /// Of a cut before a tool that moves.
    pub(super) fn of(
        cut: &Cut,
        sheet: &SheetFrame,
        tool: &ToolState,
        noise: &ErrorModel,
        at: &RoundState,
    ) -> Self {
        let seen = predicted(tool, &at.unknowns);
        let look = Look::of(cut, sheet, &seen, at.radius_m, &at.shape);
        // What moves a sighted target's residual moves its prediction the other way.
        let mut moves = -derivative(&seen, tool, &at.unknowns);
        let own_axes = at.unknowns.base_from_target.rotation.to_rotation_matrix().into_inner();
        for first in [TARGET, TARGET + 3] {
            let turned = moves.fixed_columns::<3>(first) * own_axes;
            moves.fixed_columns_mut::<3>(first).copy_from(&turned);
        }
        let mut unknowns = SMatrix::<f64, ROWS, SIZE>::zeros();
        unknowns.fixed_columns_mut::<{ unknowns::SIZE }>(0).copy_from(&(look.d_target * moves));
        unknowns.set_column(RADIUS, &look.d_radius);
        unknowns.fixed_columns_mut::<5>(SHAPE).copy_from(&look.d_shape);
        let robot = look.d_target * robot_derivative(tool, noise.carries, &at.unknowns);
        Self { unknowns, robot, noise: look.noise }
    }

    /// W with WᵀW the inverse covariance of a residual: points, robot and stamp err together.
    pub(super) fn whitening(&self, noise: &ErrorModel) -> Option<Square> {
        let (turn, shift) = (noise.rotation_rad.powi(2), noise.position_m.powi(2));
        let robot = Matrix6::from_diagonal(&Vector6::new(turn, turn, turn, shift, shift, shift));
        let by_time = self.unknowns.column(TIME_OFFSET) * noise.stamp_s;
        let covariance =
            self.noise + self.robot * robot * self.robot.transpose() + by_time * by_time.transpose();
        covariance.cholesky()?.l().try_inverse()
    }
}

/// The state moved by a step.
pub(super) fn moved(state: &RoundState, step: &SVector<f64, SIZE>) -> RoundState {
    use trueline_geometry::se3;
    let part = |first: usize| -> Vector3<f64> { step.fixed_rows::<3>(first).into() };
    let of = &state.unknowns;
    let own_axes = of.base_from_target.rotation;
    RoundState {
        unknowns: Unknowns {
            time_offset_s: of.time_offset_s + step[TIME_OFFSET],
            tool_from_camera: se3::retract_decoupled(
                &of.tool_from_camera,
                &part(HAND_EYE),
                &part(HAND_EYE + 3),
            ),
            base_from_target: se3::retract_decoupled(
                &of.base_from_target,
                &(own_axes * part(TARGET)),
                &(own_axes * part(TARGET + 3)),
            ),
        },
        radius_m: state.radius_m + step[RADIUS],
        shape: state.shape + step.fixed_rows::<5>(SHAPE),
    }
}
