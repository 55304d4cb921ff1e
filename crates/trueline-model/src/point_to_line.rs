//! Stage 4, the paper's residual: offset of the point from the line in base \[Yang2025, Eq. 10\].
//!
//! The paper's F = p_B × v − n has three components of rank two. Here the same distance is two numbers,
//! r = (u₂·(p_B − c), u₃·(p_B − c)), with |r| = |F|.
//!
//! Beware: this distance does not ask where on the sheet the line should have been seen. A sensor laid
//! along the line makes every distance small, so it can collapse under outliers; see `sheet_residual`.

use crate::Placement;
use nalgebra::{Matrix2x3, Matrix2x4, Vector2, Vector3};
use trueline_geometry::Line;

/// Two numbers with their Jacobians by group of unknowns.
#[derive(Clone, Copy, Debug)]
pub struct ResidualJacobian {
    /// The residual, m.
    pub residual: Vector2<f64>,
    /// d r / d t_d, m/s.
    pub d_time_offset: Vector2<f64>,
    /// d r / d δ of the hand-eye rotation, m/rad.
    pub d_rotation: Matrix2x3<f64>,
    /// d r / d p_EC.
    pub d_translation: Matrix2x3<f64>,
    /// d r / d (θ₂, θ₃, δ₂, δ₃) of [`Line::retract`].
    pub d_line: Matrix2x4<f64>,
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
    let motion = placement.jacobian(point_in_camera);
    let axes = line.axes();
    let across: Matrix2x3<f64> = axes.fixed_columns::<2>(1).transpose();
    ResidualJacobian {
        residual: across * (point_in_base - line.anchor()),
        d_time_offset: across * motion.d_point_d_time_offset,
        d_rotation: across * motion.d_point_d_rotation,
        d_translation: across * motion.d_point_d_translation,
        d_line: d_offset_d_line(&axes, &(point_in_base - line.anchor())),
    }
}

/// d (u₂·w, u₃·w) / d (θ₂, θ₃, δ₂, δ₃) with w = p_B − c.
///
/// Turning the triad by θ moves u_k by θ × u_k, so u_k·w changes by (θ × u_k)·w: u₂ × u₂ = 0,
/// u₃ × u₂ = −u₁, u₂ × u₃ = u₁. Differs from Eq. (11), which has the sign of its second term wrong.
fn d_offset_d_line(axes: &nalgebra::Matrix3<f64>, from_anchor: &Vector3<f64>) -> Matrix2x4<f64> {
    let along = axes.column(0).dot(from_anchor);
    Matrix2x4::new(0.0, -along, -1.0, 0.0, along, 0.0, 0.0, -1.0)
}
