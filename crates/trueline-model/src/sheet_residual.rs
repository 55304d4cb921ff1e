//! Stage 4, the default residual: measured point against the line's intersection with the laser sheet.
//!
//! The line meets the sheet at q; the sensor measured p in the same sheet; r = p − q is two numbers in the
//! sheet (m). Whitened by the measurement covariance it is maximum likelihood, and it cannot collapse:
//! a line that runs along the sheet has no q.
//!
//! With E the sheet's axes in base (3×2), n its normal in base and u₁ the line's direction, the oblique
//! projection along the line onto the sheet is B = Eᵀ − h nᵀ with h = Eᵀu₁ / (n·u₁), and
//! r = B (p_B − c): B u₁ = 0, so any point c of the line will do.
//!
//! Jacobians: q is fixed neither in space nor in the sheet. When the camera moves so that its own point
//! at q shifts by dx, q moves in the sheet by −B dx; when the line shifts by dl at q, by +B dl. So
//! dr = B (dx(q) − dl(q)): everything is evaluated at the predicted q, not at the measured p.

use crate::point_to_line::ResidualJacobian;
use crate::{LaserSheet, Placement};
use nalgebra::{Matrix2x3, Matrix3x4, Vector2, Vector3};
use trueline_geometry::Line;

/// A line nearer to the sheet than this (sine of the angle, 0.06°) has no usable intersection.
pub const MIN_SINE: f64 = 1e-3;

struct Projection {
    /// B, sheet coordinates from a displacement in base along the line.
    onto_sheet: Matrix2x3<f64>,
    /// p − q in the sheet, m.
    residual: Vector2<f64>,
}

fn project(
    placement: &Placement,
    sheet: &LaserSheet,
    point_in_camera: &Vector3<f64>,
    line: &Line,
) -> Option<Projection> {
    let base_from_camera = placement.base_from_camera().rotation.to_rotation_matrix().into_inner();
    let axes = base_from_camera * sheet.axes();
    let normal = base_from_camera * sheet.plane().normal().as_ref();
    let direction = line.direction();
    let sine = normal.dot(&direction);
    if sine.abs() < MIN_SINE {
        return None;
    }
    let onto_sheet = axes.transpose() - (axes.transpose() * direction / sine) * normal.transpose();
    let residual = onto_sheet * (placement.point_in_base(point_in_camera) - line.anchor());
    Some(Projection { onto_sheet, residual })
}

/// Measured minus predicted point in the sheet (m), or `None` if the line runs along the sheet.
#[must_use]
pub fn residual(
    placement: &Placement,
    sheet: &LaserSheet,
    point_in_camera: &Vector3<f64>,
    line: &Line,
) -> Option<Vector2<f64>> {
    Some(project(placement, sheet, point_in_camera, line)?.residual)
}

/// [`residual`] with its Jacobians, and B, which carries noise in base into the sheet.
#[must_use]
pub fn linearize(
    placement: &Placement,
    sheet: &LaserSheet,
    point_in_camera: &Vector3<f64>,
    line: &Line,
) -> Option<(ResidualJacobian, Matrix2x3<f64>)> {
    let Projection { onto_sheet, residual } = project(placement, sheet, point_in_camera, line)?;
    let predicted_in_camera = point_in_camera - sheet.axes() * residual;
    let motion = placement.jacobian(&predicted_in_camera);
    let predicted_in_base = placement.point_in_base(&predicted_in_camera);
    let jacobian = ResidualJacobian {
        residual,
        d_time_offset: onto_sheet * motion.d_point_d_time_offset,
        d_rotation: onto_sheet * motion.d_point_d_rotation,
        d_translation: onto_sheet * motion.d_point_d_translation,
        d_line: -onto_sheet * d_point_d_line(line, &predicted_in_base),
    };
    Some((jacobian, onto_sheet))
}

/// Shift of the line at its point `at`, for (θ₂, θ₃, δ₂, δ₃) of [`Line::retract`] (3×4).
fn d_point_d_line(line: &Line, at: &Vector3<f64>) -> Matrix3x4<f64> {
    let axes = line.axes();
    let (u2, u3): (Vector3<f64>, Vector3<f64>) = (axes.column(1).into(), axes.column(2).into());
    let arm = at - line.anchor();
    Matrix3x4::from_columns(&[u2.cross(&arm), u3.cross(&arm), u2, u3])
}
