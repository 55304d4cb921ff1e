//! Derivatives of a cut's residual by the unknowns and the robot, and its whitening.

use super::cut::Cut;
use super::look::Look;
use super::target::{ROWS, Rows, Square};
use crate::board_hand_eye::robot_path::ToolState;
use crate::board_hand_eye::sight_model::{derivative, predicted, robot_derivative};
use crate::board_hand_eye::unknowns::{self, ErrorModel, HAND_EYE, TARGET, TIME_OFFSET, Unknowns};
use nalgebra::{Matrix3, Matrix6, SMatrix, SVector, Vector3, Vector6};
use trueline_model::{LaserSheet, SheetShape};

/// Number of unknowns: those of a sighted target, the radius, and the sensor's shape.
pub const SIZE: usize = unknowns::SIZE + 1 + SheetShape::DIMENSION;
/// Index of the radius.
pub const RADIUS: usize = unknowns::SIZE;
/// First index of the shape.
pub const SHAPE: usize = RADIUS + 1;
/// Least effect of an error of a cut: without it the effect would vanish for a start with the sheet along a cylinder.
const LEAST_SEEN: f64 = 0.3;

/// The unknowns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoundState {
    /// Time offset, hand-eye transform and the target's pose. Steps of the pose are in the target's own axes.
    pub unknowns: Unknowns,
    /// Radius, m.
    pub radius_m: f64,
    /// Correction of the sensor's shape h₁ … h₅ relative to its file.
    pub shape: SVector<f64, 5>,
}

/// The sheet in the camera frame.
#[derive(Clone, Copy, Debug)]
pub struct SheetFrame {
    origin_m: Vector3<f64>,
    /// Columns e₁, e₂, n.
    axes: Matrix3<f64>,
}

impl SheetFrame {
    /// Of a sheet.
    #[must_use]
    pub fn of(sheet: &LaserSheet) -> Self {
        let axes = sheet.axes();
        let (e1, e2) = (axes.column(0).into_owned(), axes.column(1).into_owned());
        Self { origin_m: *sheet.origin(), axes: Matrix3::from_columns(&[e1, e2, e1.cross(&e2)]) }
    }

    /// A point of the camera frame in the sheet's axes: two coordinates and the distance, m.
    #[must_use]
    pub fn coordinates(&self, point_in_camera: &Vector3<f64>) -> Vector3<f64> {
        self.axes.transpose() * (point_in_camera - self.origin_m)
    }

    /// The sheet's axes in the camera frame: e₁, e₂, n.
    #[must_use]
    pub fn axes(&self) -> &Matrix3<f64> {
        &self.axes
    }

    /// Its origin in the camera frame, m.
    #[must_use]
    pub fn origin_m(&self) -> &Vector3<f64> {
        &self.origin_m
    }
}

/// Measured minus predicted, m.
pub(super) fn difference(cut: &Cut, sheet: &SheetFrame, tool: &ToolState, at: &RoundState) -> Rows {
    Look::of(cut, sheet, &predicted(tool, &at.unknowns), at).off_m
}

/// d difference / d unknowns.
pub(super) fn jacobian(
    cut: &Cut,
    sheet: &SheetFrame,
    tool: &ToolState,
    at: &RoundState,
) -> SMatrix<f64, ROWS, SIZE> {
    let seen = predicted(tool, &at.unknowns);
    let look = Look::of(cut, sheet, &seen, at);
    // The prediction of a sighted target moves opposite to its residual.
    let mut moves = -derivative(&seen, tool, &at.unknowns);
    let own_axes = at.unknowns.base_from_target.rotation.to_rotation_matrix().into_inner();
    for first in [TARGET, TARGET + 3] {
        let turned = moves.fixed_columns::<3>(first) * own_axes;
        moves.fixed_columns_mut::<3>(first).copy_from(&turned);
    }
    let mut jacobian = SMatrix::<f64, ROWS, SIZE>::zeros();
    jacobian.fixed_columns_mut::<{ unknowns::SIZE }>(0).copy_from(&(look.d_target * moves));
    jacobian.set_column(RADIUS, &look.d_radius);
    jacobian.fixed_columns_mut::<5>(SHAPE).copy_from(&look.d_shape);
    jacobian
}

/// d difference / d (turn of the tool about its origin, its shift), in the carrier's axes.
pub(super) fn d_robot(
    cut: &Cut,
    sheet: &SheetFrame,
    tool: &ToolState,
    noise: &ErrorModel,
    at: &RoundState,
) -> SMatrix<f64, ROWS, 6> {
    let look = Look::of(cut, sheet, &predicted(tool, &at.unknowns), at);
    look.d_target * robot_derivative(tool, noise.carries, &at.unknowns)
}

/// W with WᵀW the inverse covariance of a residual: errors of cut, robot and stamp together.
pub(super) fn whitening(
    cut: &Cut,
    sheet: &SheetFrame,
    tool: &ToolState,
    noise: &ErrorModel,
    at: &RoundState,
) -> Option<Square> {
    let d_robot = d_robot(cut, sheet, tool, noise, at);
    let (turn, shift) = (noise.rotation_rad.powi(2), noise.position_m.powi(2));
    let robot = Matrix6::from_diagonal(&Vector6::new(turn, turn, turn, shift, shift, shift));
    let by_time = jacobian(cut, sheet, tool, at).column(TIME_OFFSET) * noise.stamp_s;
    let look = Look::of(cut, sheet, &predicted(tool, &at.unknowns), at);
    let d_seen = Square::from_diagonal(&look.d_seen.map(|d| d.abs().max(LEAST_SEEN)));
    let of_cut = d_seen * cut.covariance * d_seen;
    let covariance = of_cut + d_robot * robot * d_robot.transpose() + by_time * by_time.transpose();
    covariance.cholesky()?.l().try_inverse()
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
