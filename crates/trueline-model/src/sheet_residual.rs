//! Stage 4, the default residual: measured point minus the line's intersection with the laser sheet.
//!
//! The line meets the sheet at q. The sensor measured p in the same sheet. r = p − q is two numbers in the sheet (m). Whitened by the measurement
//! covariance it gives the maximum likelihood estimate. It cannot collapse, because a line along the sheet has no q.
//!
//! Let E be the sheet's axes in base (3×2), n its normal in base and u₁ the line's direction. The oblique
//! projection along the line onto the sheet is B = Eᵀ − h nᵀ with h = Eᵀu₁ / (n·u₁), and r = B (p_B − c). As
//! B u₁ = 0, any point c of the line will do.
//!
//! Jacobians: q is fixed neither in space nor in the sheet. If the camera's own point at q shifts by dx, q
//! moves in the sheet by −B dx. If the line shifts by dl at q, it moves by +B dl. So dr = B (dx(q) − dl(q)):
//! everything is evaluated at the predicted q, not at the measured p.

use crate::point_to_line::ResidualJacobian;
use crate::sheet_shape::ReportedPoint;
use crate::{Curvature, LaserSheet, Placement, SheetShape};
use nalgebra::{Matrix2, Matrix2x3, Matrix3, Matrix3x4, SMatrix, Vector2, Vector3};
use trueline_geometry::Line;

/// A line nearer to the sheet than this (sine of the angle, 0.06°) has no usable intersection.
pub const MIN_SINE: f64 = 1e-3;

struct Projection {
    /// B maps a displacement in base to sheet coordinates, along the line.
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

/// Measured minus predicted point in the sheet (m). `None` if the line runs along the sheet.
#[must_use]
pub fn residual(
    placement: &Placement,
    sheet: &LaserSheet,
    point_in_camera: &Vector3<f64>,
    line: &Line,
) -> Option<Vector2<f64>> {
    Some(project(placement, sheet, point_in_camera, line)?.residual)
}

/// [`residual`] with its derivatives. That by a shift of the sensor is B.
#[must_use]
pub fn linearize(
    placement: &Placement,
    sheet: &LaserSheet,
    point_in_camera: &Vector3<f64>,
    line: &Line,
) -> Option<ResidualJacobian> {
    let Projection { onto_sheet, residual } = project(placement, sheet, point_in_camera, line)?;
    let predicted_in_camera = point_in_camera - sheet.axes() * residual;
    let predicted_in_base = placement.point_in_base(&predicted_in_camera);
    Some(ResidualJacobian {
        residual,
        by_pose: placement.by_pose_of_two(&predicted_in_base, &onto_sheet),
        d_line: -onto_sheet * d_point_d_line(line, &predicted_in_base),
    })
}

/// The same with a bowed seam and a sensor with errors of its sheet.
#[derive(Clone, Copy, Debug)]
pub struct SeamInSheet<'a> {
    /// The straight part of the seam, in base.
    pub line: &'a Line,
    /// Its bow.
    pub curvature: &'a Curvature,
    /// The sensor's shape; `None` is a sensor without error.
    pub shape: Option<&'a SheetShape>,
}

/// A residual with the columns of its bow and shape in the Jacobian.
#[derive(Clone, Copy, Debug)]
pub struct SeamJacobian {
    /// The residual, reported minus predicted report (m), and its derivatives as for a straight seam.
    pub straight: ResidualJacobian,
    /// d r / d (κ₂, κ₃).
    pub d_curvature: Matrix2<f64>,
    /// d r / d h.
    pub d_shape: SMatrix<f64, 2, 5>,
}

/// Newton steps from the straight line's intersection to the bowed one's. Each squares an error of (bow/length)².
const INTERSECTION_STEPS: usize = 2;

impl SeamInSheet<'_> {
    /// Reported minus predicted point (m) with its Jacobians. `None` if the seam runs along the sheet.
    ///
    /// The seam meets the sheet at q. The predicted report of the sensor is g(q), with g the inverse of its shape, and r = s − g(q). As for a
    /// straight line, −dq = B (dx(q) − dl(q)) with the seam's tangent at q in place of the line's direction. Hence dr = (∂g/∂q) B (dx(q) − dl(q)),
    /// and dr = −∂g/∂h for the shape.
    #[must_use]
    pub fn linearize(
        &self,
        placement: &Placement,
        sheet: &LaserSheet,
        point_in_camera: &Vector3<f64>,
    ) -> Option<SeamJacobian> {
        let base_from_camera = placement.base_from_camera();
        let turn = base_from_camera.rotation.to_rotation_matrix().into_inner();
        let (axes, normal) = (turn * sheet.axes(), turn * sheet.plane().normal().as_ref());
        let measured = placement.point_in_base(point_in_camera);
        let seam = self.meeting(&normal, &measured)?;
        let onto_sheet = axes.transpose()
            - (axes.transpose() * seam.tangent / normal.dot(&seam.tangent)) * normal.transpose();
        let off_predicted = axes.transpose() * (measured - seam.point);
        let reported = sheet.coordinates(point_in_camera);
        let exact = ReportedPoint {
            reported: reported - off_predicted,
            d_true: Matrix2::identity(),
            d_shape: SMatrix::zeros(),
        };
        let predicted = self.shape.map_or(exact, |shape| shape.reported(&exact.reported));
        let onto_sheet = predicted.d_true * onto_sheet;
        let line_axes = self.line.axes();
        let across = Matrix2::from_columns(&[
            (onto_sheet * line_axes.column(1)).into_owned(),
            (onto_sheet * line_axes.column(2)).into_owned(),
        ]);
        Some(SeamJacobian {
            straight: ResidualJacobian {
                residual: reported - predicted.reported,
                by_pose: placement.by_pose_of_two(&seam.point, &onto_sheet),
                d_line: -onto_sheet * d_point_d_line(self.line, &seam.point),
            },
            d_curvature: -across * seam.form,
            d_shape: -predicted.d_shape,
        })
    }

    /// Point at which the seam meets the sheet through `measured`, all in base.
    fn meeting(&self, normal: &Vector3<f64>, measured: &Vector3<f64>) -> Option<Meeting> {
        let axes: Matrix3<f64> = self.line.axes();
        let direction: Vector3<f64> = axes.column(0).into();
        let [bow_2, bow_3] = self.curvature.bow_m;
        let bow = axes.column(1) * bow_2 + axes.column(2) * bow_3;
        let sine = normal.dot(&direction);
        if sine.abs() < MIN_SINE {
            return None;
        }
        let mut along = normal.dot(&(measured - self.line.anchor())) / sine;
        let seam_at = |along: f64| {
            let (form, slope) = self.curvature.form(along);
            let point = self.line.anchor() + direction * along + bow * form;
            Meeting { point, tangent: direction + bow * slope, form }
        };
        for _ in 0..INTERSECTION_STEPS {
            let seam = seam_at(along);
            along -= normal.dot(&(seam.point - measured)) / normal.dot(&seam.tangent);
        }
        let seam = seam_at(along);
        (normal.dot(&seam.tangent).abs() >= MIN_SINE).then_some(seam)
    }
}

struct Meeting {
    point: Vector3<f64>,
    tangent: Vector3<f64>,
    form: f64,
}

/// Shift of the line at its point `at`, for (θ₂, θ₃, δ₂, δ₃) of [`Line::retract`] (3×4).
fn d_point_d_line(line: &Line, at: &Vector3<f64>) -> Matrix3x4<f64> {
    let axes = line.axes();
    let (u2, u3): (Vector3<f64>, Vector3<f64>) = (axes.column(1).into(), axes.column(2).into());
    let arm = at - line.anchor();
    Matrix3x4::from_columns(&[u2.cross(&arm), u3.cross(&arm), u2, u3])
}
