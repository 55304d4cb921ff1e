//! Residual of a cut, and its derivatives by the target's pose in the camera, its radius and the sensor's shape.
//!
//! With c the target's origin in the camera and (e₁, e₂, n) the sheet's axes, the residual of a sphere's circle measured as (a,
//! b, ρ) is:
//!
//! ```text
//! r = (a − e₁·c, b − e₂·c, (ρ² + (n·c)² − R²) / 2ρ)
//! ```
//!
//! The third is ρ − √(R² − (n·c)²) to first order, and is defined also if a start has the sheet beside the sphere. The residual
//! of a cylinder about the direction d is, for each point x of the arc:
//!
//! ```text
//! r = |(I − d dᵀ)(x − c)| − R
//! ```

use super::cut::Cut;
use super::model::{RoundState, SheetFrame};
use super::target::{ROWS, RoundTarget, Rows};
use nalgebra::{Matrix3, SMatrix, Vector2, Vector3};
use trueline_geometry::Pose;

/// Residual (measured minus predicted), m, and its derivatives.
pub(super) struct Look {
    /// Measured minus predicted, m.
    pub off_m: Rows,
    /// By a turn of the target about its origin and its shift, in the camera's axes.
    pub d_target: SMatrix<f64, ROWS, 6>,
    /// By the radius.
    pub d_radius: Rows,
    /// By an error of each coordinate of the cut.
    pub d_seen: Rows,
    /// By the sensor's shape.
    pub d_shape: SMatrix<f64, ROWS, 5>,
}

impl Look {
    /// For a cut, with the target at a pose in the camera.
    pub(super) fn of(cut: &Cut, sheet: &SheetFrame, camera_from_target: &Pose, at: &RoundState) -> Self {
        match cut.target {
            RoundTarget::Sphere => Self::of_sphere(cut, sheet, camera_from_target, at),
            RoundTarget::Cylinder => Self::of_cylinder(cut, sheet, camera_from_target, at),
        }
    }

    fn of_sphere(cut: &Cut, sheet: &SheetFrame, camera_from_target: &Pose, at: &RoundState) -> Self {
        let center = sheet.coordinates(&camera_from_target.translation.vector);
        let moved = cut.d_shape * at.shape;
        let seen = cut.measured() + moved.fixed_rows::<3>(0);
        let radius = (seen.z.powi(2) + center.z.powi(2) - at.radius_m.powi(2)) / (2.0 * seen.z);
        let d_center = Matrix3::from_diagonal(&Vector3::new(-1.0, -1.0, center.z / seen.z));
        let mut look = Self {
            off_m: Rows::from([seen.x - center.x, seen.y - center.y, radius, 0.0, 0.0]),
            d_target: SMatrix::zeros(),
            d_radius: Rows::zeros(),
            d_seen: Rows::repeat(1.0),
            d_shape: cut.d_shape,
        };
        look.d_target.fixed_view_mut::<3, 3>(0, 3).copy_from(&(d_center * sheet.axes().transpose()));
        look.d_radius[2] = -at.radius_m / seen.z;
        // d (ρ² + n² − R²)/2ρ / dρ = 1 − r/ρ.
        look.d_shape.row_mut(2).scale_mut(1.0 - radius / seen.z);
        look
    }

    fn of_cylinder(cut: &Cut, sheet: &SheetFrame, camera_from_target: &Pose, at: &RoundState) -> Self {
        let along = camera_from_target.rotation * Vector3::y();
        let moved = cut.d_shape * at.shape;
        let mut look = Self {
            off_m: Rows::zeros(),
            d_target: SMatrix::zeros(),
            d_radius: Rows::repeat(-1.0),
            d_seen: Rows::zeros(),
            d_shape: cut.d_shape,
        };
        let in_camera = |v: &Vector2<f64>| sheet.axes() * Vector3::new(v.x, v.y, 0.0);
        for (k, [point, normal]) in cut.supports.iter().enumerate() {
            let normal = in_camera(normal);
            let point = sheet.origin_m() + in_camera(point) + normal * moved[k];
            let from = point - camera_from_target.translation.vector;
            let across = from - along * along.dot(&from);
            let outward = across.normalize();
            look.off_m[k] = across.norm() - at.radius_m;
            // A turn ε moves d by ε × d, and r by −(d·(x − c)) ε·(d × outward).
            let turn = along.cross(&outward) * -along.dot(&from);
            look.d_target.fixed_view_mut::<1, 3>(k, 0).copy_from(&turn.transpose());
            look.d_target.fixed_view_mut::<1, 3>(k, 3).copy_from(&-outward.transpose());
            look.d_seen[k] = outward.dot(&normal);
            look.d_shape.row_mut(k).scale_mut(look.d_seen[k]);
        }
        look
    }
}
