//! Stage 4, the paper's residual: offset of the point from the line in base \[Yang2025, Eq. 10\].
//!
//! The paper's F = p_B × v − n has three components of rank two. Here the same distance is two numbers,
//! r = (u₂·(p_B − c), u₃·(p_B − c)), with |r| = |F|.
//!
//! Caution: this distance ignores the place on the sheet at which the line should have been seen. A sensor laid along the line makes every distance
//! small, so the estimate can collapse under outliers. See `sheet_residual`.

use crate::{Placement, PoseGradient};
use nalgebra::{Matrix2x3, Matrix2x4, SMatrix, Vector2, Vector3};
use trueline_geometry::Line;

/// Two numbers with their derivatives.
#[derive(Clone, Copy, Debug)]
pub struct ResidualJacobian {
    /// The residual, m.
    pub residual: Vector2<f64>,
    /// Gradients by the pose of the sensor.
    pub by_pose: [PoseGradient; 2],
    /// d r / d (θ₂, θ₃, δ₂, δ₃) of [`Line::retract`].
    pub d_line: Matrix2x4<f64>,
}

impl ResidualJacobian {
    /// Jacobian by time offset, hand-eye rotation and hand-eye translation, for a placement of the sensor.
    #[must_use]
    pub fn by_links(&self, placement: &Placement) -> SMatrix<f64, 2, 7> {
        let [a, b] = self.by_pose.each_ref().map(|by_pose| placement.carried(by_pose));
        SMatrix::from_rows(&[a.transpose(), b.transpose()])
    }

    /// Jacobian by a shift of the sensor in base.
    #[must_use]
    pub fn by_shift(&self) -> Matrix2x3<f64> {
        let [a, b] = self.by_pose.each_ref().map(|by_pose| by_pose.by_shift.transpose());
        Matrix2x3::from_rows(&[a, b])
    }

    /// Jacobian by a rotation of the sensor about the tool's origin, axes of base.
    #[must_use]
    pub fn by_turn(&self) -> Matrix2x3<f64> {
        let [a, b] = self.by_pose.each_ref().map(|by_pose| by_pose.by_turn.transpose());
        Matrix2x3::from_rows(&[a, b])
    }
}

/// Offset of a measured point from the line, m.
#[must_use]
pub fn residual(placement: &Placement, point_in_camera: &Vector3<f64>, line: &Line) -> Vector2<f64> {
    line.offset_of(&placement.point_in_base(point_in_camera))
}

/// [`residual`] with its Jacobians.
#[must_use]
pub fn linearize(placement: &Placement, point_in_camera: &Vector3<f64>, line: &Line) -> ResidualJacobian {
    let point_in_base = placement.point_in_base(point_in_camera);
    let axes = line.axes();
    let across: Matrix2x3<f64> = axes.fixed_columns::<2>(1).transpose();
    ResidualJacobian {
        residual: across * (point_in_base - line.anchor()),
        by_pose: placement.by_pose_of_two(&point_in_base, &across),
        d_line: d_offset_d_line(&axes, &(point_in_base - line.anchor())),
    }
}

/// d (u₂·w, u₃·w) / d (θ₂, θ₃, δ₂, δ₃) with w = p_B − c.
///
/// Turning the triad by θ moves u_k by θ × u_k, so u_k·w changes by (θ × u_k)·w: u₂ × u₂ = 0, u₃ × u₂ = −u₁, u₂ × u₃ = u₁. Differs from Eq. (11),
/// whose second term has the wrong sign.
fn d_offset_d_line(axes: &nalgebra::Matrix3<f64>, from_anchor: &Vector3<f64>) -> Matrix2x4<f64> {
    let along = axes.column(0).dot(from_anchor);
    Matrix2x4::new(0.0, -along, -1.0, 0.0, along, 0.0, 0.0, -1.0)
}
