//! What a cut should be, how that follows the unknowns and the robot, and the whitening of what it is off by.
//!
//! With c the sphere's centre in the camera, (e₁, e₂, n) the sheet's axes, and (a, b, ρ) measured:
//!
//! ```text
//! r = (a − e₁·c, b − e₂·c, (ρ² + (n·c)² − R²) / 2ρ)
//! ```
//!
//! The third is ρ − √(R² − (n·c)²) to first order, and is defined also where a start lays the sheet beside the sphere.

use super::cut::Cut;
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
/// A sphere looks the same however it is turned: its attitude is held.
pub const ATTITUDE: [usize; 3] = [TARGET, TARGET + 1, TARGET + 2];

/// What is sought.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphereState {
    /// Time offset, hand-eye transform, and the sphere's centre as the target's place.
    pub unknowns: Unknowns,
    /// Radius, m.
    pub radius_m: f64,
    /// The sensor's shape h₁ … h₅, beside the one in its file.
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

/// Measured less predicted, m: centre and radius.
pub(super) fn difference(cut: &Cut, sheet: &SheetFrame, tool: &ToolState, at: &SphereState) -> Vector3<f64> {
    let center = sheet.coordinates(&predicted(tool, &at.unknowns).translation.vector);
    let seen = cut.measured() + cut.d_shape * at.shape;
    let radius = (seen.z.powi(2) + center.z.powi(2) - at.radius_m.powi(2)) / (2.0 * seen.z);
    Vector3::new(seen.x - center.x, seen.y - center.y, radius)
}

/// d difference / d centre in the camera frame.
pub(super) fn d_center(cut: &Cut, sheet: &SheetFrame, tool: &ToolState, at: &SphereState) -> Matrix3<f64> {
    let center = sheet.coordinates(&predicted(tool, &at.unknowns).translation.vector);
    let seen = cut.measured() + cut.d_shape * at.shape;
    Matrix3::from_diagonal(&Vector3::new(-1.0, -1.0, center.z / seen.z)) * sheet.axes.transpose()
}

/// d difference / d unknowns.
pub(super) fn jacobian(
    cut: &Cut,
    sheet: &SheetFrame,
    tool: &ToolState,
    at: &SphereState,
) -> SMatrix<f64, 3, SIZE> {
    let seen = cut.measured() + cut.d_shape * at.shape;
    let center = predicted(tool, &at.unknowns);
    // What moves a sighted target's residual moves its prediction the other way.
    let moves = -derivative(&center, tool, &at.unknowns).fixed_rows::<3>(3).into_owned();
    let radius = difference(cut, sheet, tool, at).z;
    // d (ρ² + n² − R²)/2ρ / dρ = 1 − r/ρ.
    let d_seen = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 1.0 - radius / seen.z));
    let mut jacobian = SMatrix::<f64, 3, SIZE>::zeros();
    let by_center = d_center(cut, sheet, tool, at) * moves;
    jacobian.fixed_columns_mut::<{ unknowns::SIZE }>(0).copy_from(&by_center);
    jacobian[(2, RADIUS)] = -at.radius_m / seen.z;
    jacobian.fixed_columns_mut::<5>(SHAPE).copy_from(&(d_seen * cut.d_shape));
    jacobian
}

/// d difference / d (turn of the tool about its origin, its shift), in the carrier's axes.
pub(super) fn d_robot(
    cut: &Cut,
    sheet: &SheetFrame,
    tool: &ToolState,
    noise: &ErrorModel,
    at: &SphereState,
) -> SMatrix<f64, 3, 6> {
    let moves = robot_derivative(tool, noise.carries, &at.unknowns);
    d_center(cut, sheet, tool, at) * moves.fixed_rows::<3>(3)
}

/// W with WᵀW the inverse covariance of a residual: cut, robot and stamp err together.
pub(super) fn whitening(
    cut: &Cut,
    sheet: &SheetFrame,
    tool: &ToolState,
    noise: &ErrorModel,
    at: &SphereState,
) -> Option<Matrix3<f64>> {
    let d_robot = d_robot(cut, sheet, tool, noise, at);
    let (turn, shift) = (noise.rotation_rad.powi(2), noise.position_m.powi(2));
    let robot = Matrix6::from_diagonal(&Vector6::new(turn, turn, turn, shift, shift, shift));
    let by_time = jacobian(cut, sheet, tool, at).column(TIME_OFFSET) * noise.stamp_s;
    let covariance = cut.covariance + d_robot * robot * d_robot.transpose() + by_time * by_time.transpose();
    covariance.cholesky()?.l().try_inverse()
}

/// The state moved by a step.
pub(super) fn moved(state: &SphereState, step: &SVector<f64, SIZE>) -> SphereState {
    use trueline_geometry::se3;
    let part = |first: usize| -> Vector3<f64> { step.fixed_rows::<3>(first).into() };
    let of = &state.unknowns;
    SphereState {
        unknowns: Unknowns {
            time_offset_s: of.time_offset_s + step[TIME_OFFSET],
            tool_from_camera: se3::retract_decoupled(
                &of.tool_from_camera,
                &part(HAND_EYE),
                &part(HAND_EYE + 3),
            ),
            base_from_target: se3::retract_decoupled(&of.base_from_target, &part(TARGET), &part(TARGET + 3)),
        },
        radius_m: state.radius_m + step[RADIUS],
        shape: state.shape + step.fixed_rows::<5>(SHAPE),
    }
}
