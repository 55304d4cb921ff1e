//! What a cut is off its prediction by, and how that follows the target's pose in the camera, its radius and the sensor's shape.
//!
//! With c the target's origin in the camera and d the direction of a cylinder's axis (zero of a sphere) a point x of the arc is off by
//!
//! ```text
//! r = |(I − d dᵀ)(x − c)| − R
//! ```
//!
//! and a cut by the means of r times each polynomial along the arc.

use super::cut::{ArcPoint, Cut};
use super::sheet_frame::SheetFrame;
use super::target::{ROWS, RoundTarget, Rows, Square};
use nalgebra::{SMatrix, SVector, Vector2, Vector3};
use trueline_geometry::Pose;

/// An error of a point acts at least by this part: where a start has the sheet along the surface, it would not act at all.
const LEAST_SEEN: f64 = 0.3;

/// Derivatives of what a cut is off by, and its noise.
pub(super) struct Look {
    /// By a turn of the target about its origin and a shift of it, in the camera's axes.
    pub d_target: SMatrix<f64, ROWS, 6>,
    /// By the radius.
    pub d_radius: Rows,
    /// By the sensor's shape.
    pub d_shape: SMatrix<f64, ROWS, 5>,
    /// Covariance by the noise of the points, m²; the identity beyond the target's rows.
    pub noise: Square,
}

/// The target in the sheet's axes, before a sensor of some shape.
struct InSheet<'a> {
    center_m: Vector3<f64>,
    along: Vector3<f64>,
    radius_m: f64,
    shape: &'a SVector<f64, 5>,
}

/// A point beside the target.
struct Beside {
    /// Unit vector from the centre or the axis.
    outward: Vector3<f64>,
    /// How far along the axis it is, m.
    along_m: f64,
    /// How far it is outside, m.
    off_m: f64,
}

impl<'a> InSheet<'a> {
    fn of(
        cut: &Cut,
        sheet: &SheetFrame,
        camera_from_target: &Pose,
        radius_m: f64,
        shape: &'a SVector<f64, 5>,
    ) -> Self {
        let along = match cut.target {
            RoundTarget::Sphere => Vector3::zeros(),
            RoundTarget::Cylinder => sheet.axes().transpose() * (camera_from_target.rotation * Vector3::y()),
        };
        let center_m = sheet.coordinates(&camera_from_target.translation.vector);
        Self { center_m, along, radius_m, shape }
    }

    fn beside(&self, point: &ArcPoint) -> Beside {
        let in_sheet: Vector2<f64> = point.at_m + point.d_shape * self.shape;
        let from = Vector3::new(in_sheet.x, in_sheet.y, 0.0) - self.center_m;
        let along_m = self.along.dot(&from);
        let across = from - self.along * along_m;
        let distance_m = across.norm();
        Beside { outward: across / distance_m, along_m, off_m: distance_m - self.radius_m }
    }
}

/// Measured less predicted, m, of a cut with the target at a pose in the camera, before a sensor of some shape.
pub(super) fn off_m(
    cut: &Cut,
    sheet: &SheetFrame,
    camera_from_target: &Pose,
    radius_m: f64,
    shape: &SVector<f64, 5>,
) -> Rows {
    let target = InSheet::of(cut, sheet, camera_from_target, radius_m, shape);
    let all = cut.points.iter().map(|point| point.powers * target.beside(point).off_m);
    all.sum::<Rows>() / cut.points.len() as f64
}

impl Look {
    /// Of a cut, with the target at a pose in the camera, before a sensor of some shape.
    pub(super) fn of(
        cut: &Cut,
        sheet: &SheetFrame,
        camera_from_target: &Pose,
        radius_m: f64,
        shape: &SVector<f64, 5>,
    ) -> Self {
        let target = InSheet::of(cut, sheet, camera_from_target, radius_m, shape);
        let part = 1.0 / cut.points.len() as f64;
        let mut look = Self {
            d_target: SMatrix::zeros(),
            d_radius: Rows::zeros(),
            d_shape: SMatrix::zeros(),
            noise: Square::zeros(),
        };
        for point in &cut.points {
            let Beside { outward, along_m, .. } = target.beside(point);
            let powers = point.powers * part;
            let in_sheet = Vector2::new(outward.x, outward.y);
            // A turn ε moves d by ε × d, and r by −(d·(x − c)) ε·(d × outward).
            let turn = target.along.cross(&outward) * -along_m;
            let moves = SMatrix::<f64, 1, 6>::new(turn.x, turn.y, turn.z, -outward.x, -outward.y, -outward.z);
            look.d_target += powers * moves;
            look.d_radius -= powers;
            look.d_shape += powers * (in_sheet.transpose() * point.d_shape);
            let variance = point.variance * in_sheet.norm_squared().max(LEAST_SEEN * LEAST_SEEN);
            look.noise += powers * (powers.transpose() * variance);
        }
        for first in [0, 3] {
            let in_camera = look.d_target.fixed_columns::<3>(first) * sheet.axes().transpose();
            look.d_target.fixed_columns_mut::<3>(first).copy_from(&in_camera);
        }
        for k in cut.target.row().rows..ROWS {
            look.noise[(k, k)] = 1.0;
        }
        look
    }
}
