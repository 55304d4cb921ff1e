//! Stage 4 for a plate: measured point of the stripe relative to the predicted stripe.
//!
//! The plate's surface cuts the laser sheet in a curve. A support point of the stripe gives its distance from that curve,
//! and nothing along it. So the residual is one number: the signed distance, in the sheet's reported coordinates, of the
//! measured point x̂ from the curve φ(x) = 0, with x ↦ base through shape, hand-eye and robot.
//!
//! With x* the foot of x̂ on the curve, ρ = ν·(x̂ − x*) with ν = ∇φ/|∇φ|. For every unknown θ, dρ/dθ = (∂φ/∂θ)/|∇φ| *at the foot*, because motion of
//! the foot along the curve does not change the distance. At the measured point the derivative would contain the measurement's noise and bias the
//! estimate of a shape, as in every errors-in-variables problem.

use crate::plate::PlateDistance;
use crate::{LaserSheet, Placement, Plate, PoseGradient, SheetShape};
use nalgebra::{ArrayStorage, Matrix2, Matrix3x2, Point3, SMatrix, SVector, Vector2, Vector3};

/// A plate nearer to the sheet than this (sine of the angle, 0.06°) has no usable stripe.
const MIN_SINE: f64 = 1e-3;
/// Maximum Newton steps to the foot. On a curve of radius R at a distance d, each reduces the error to d/R of it.
const FOOT_STEPS: usize = 3;
/// After a step below this the foot is exact to d/R of it, m, and its distance to its square.
const FOOT_FOUND_M: f64 = 1e-7;

/// A plate and the sensor that measures it.
#[derive(Clone, Copy, Debug)]
pub struct StripeOnPlate<'a> {
    /// The plate.
    pub plate: &'a Plate,
    /// The laser sheet.
    pub sheet: &'a LaserSheet,
    /// The sensor's shape; `None` is a sensor without error.
    pub shape: Option<&'a SheetShape>,
}

/// A residual with its Jacobian.
#[derive(Clone, Copy, Debug)]
pub struct StripeJacobian {
    /// ρ, m.
    pub residual: f64,
    /// ν, unit, in the sheet's reported coordinates.
    pub normal: Vector2<f64>,
    /// Gradient by the pose of the sensor, evaluated at the foot. [`Placement::carried`] maps it to time offset and hand-eye.
    pub by_pose: PoseGradient,
    /// dρ/d (θ_a, θ_o, δ) of the plate.
    pub d_plate: Vector3<f64>,
    /// dρ/dβ.
    pub d_surface: SVector<f64, 7>,
    /// dρ/dh.
    pub d_shape: SVector<f64, 5>,
}

impl StripeJacobian {
    pub(crate) const ZERO: Self = Self {
        residual: 0.0,
        normal: Vector2::new(0.0, 0.0),
        by_pose: PoseGradient::ZERO,
        d_plate: Vector3::new(0.0, 0.0, 0.0),
        d_surface: SVector::<f64, 7>::from_array_storage(ArrayStorage([[0.0; 7]; 1])),
        d_shape: SVector::<f64, 5>::from_array_storage(ArrayStorage([[0.0; 5]; 1])),
    };

    /// Adds a fraction of another row.
    #[inline]
    pub(crate) fn add(&mut self, row: &Self, part: f64) {
        macro_rules! add {
            ($($field:ident),*) => { $(self.$field += row.$field * part;)* };
        }
        add!(residual, normal, d_plate, d_surface, d_shape);
        self.by_pose.add(&row.by_pose, part);
    }
}

/// The laser sheet at the exposure of a frame: x ↦ origin + axes x, base, m.
pub(crate) struct SheetInBase {
    origin: Vector3<f64>,
    axes: Matrix3x2<f64>,
}

/// φ and its slopes at one point of the sheet.
pub(crate) struct Local {
    pub(crate) value: f64,
    pub(crate) gradient: Vector2<f64>,
    point_in_base: Vector3<f64>,
    /// ∂φ/∂ point in base.
    by_point: Vector3<f64>,
    /// ∂φ/∂ true sheet coordinates.
    by_true: Vector2<f64>,
}

impl Local {
    /// ∂φ along a direction of the sheet. `None` if the surface is parallel to it.
    pub(crate) fn steepness_along(&self, direction: &Vector2<f64>) -> Option<f64> {
        let steepness = self.gradient.dot(direction);
        (steepness > MIN_SINE).then_some(steepness)
    }
}

impl StripeOnPlate<'_> {
    /// The residual of a point at `reported` (sheet coordinates, m). `None` if the plate lies along the sheet.
    #[must_use]
    pub fn residual(&self, placement: &Placement, reported: &Vector2<f64>) -> Option<f64> {
        let (foot, local) = self.foot(&self.sheet_in_base(placement), reported)?;
        Some(local.gradient.dot(&(reported - foot)) / local.gradient.norm())
    }

    /// [`StripeOnPlate::residual`] with its derivatives.
    #[must_use]
    pub fn linearize(&self, placement: &Placement, reported: &Vector2<f64>) -> Option<StripeJacobian> {
        let (foot, local) = self.foot(&self.sheet_in_base(placement), reported)?;
        let normal = local.gradient.normalize();
        let distance_m = normal.dot(&(reported - foot));
        Some(self.jacobian_along(placement, &foot, &local, (&normal, distance_m)))
    }

    /// Distance from the stripe along a direction, with its derivatives, of a point with the stripe there.
    pub(crate) fn jacobian_along(
        &self,
        placement: &Placement,
        on_stripe: &Vector2<f64>,
        local: &Local,
        (direction, distance_m): (&Vector2<f64>, f64),
    ) -> StripeJacobian {
        let steepness = local.gradient.dot(direction);
        let by_point = local.by_point / steepness;
        let PlateDistance { d_plate, d_surface, .. } = self.plate.distance(&local.point_in_base);
        StripeJacobian {
            residual: distance_m,
            normal: local.gradient / steepness,
            by_pose: placement.by_pose(&local.point_in_base, &by_point),
            d_plate: d_plate / steepness,
            d_surface: d_surface / steepness,
            d_shape: self.true_by_shape(on_stripe).transpose() * local.by_true / steepness,
        }
    }

    /// The foot of a point on the predicted stripe, and φ there.
    fn foot(&self, sheet: &SheetInBase, reported: &Vector2<f64>) -> Option<(Vector2<f64>, Local)> {
        let mut foot = *reported;
        for _ in 0..FOOT_STEPS {
            let local = self.local(sheet, &foot)?;
            let off = local.value + local.gradient.dot(&(reported - foot));
            let next = reported - local.gradient * (off / local.gradient.norm_squared());
            let step = next - foot;
            foot = next;
            if step.norm_squared() < FOOT_FOUND_M * FOOT_FOUND_M {
                break;
            }
        }
        Some((foot, self.local(sheet, &foot)?))
    }

    /// The sheet at a placement.
    pub(crate) fn sheet_in_base(&self, placement: &Placement) -> SheetInBase {
        let base_from_camera = placement.base_from_camera();
        SheetInBase {
            origin: (base_from_camera * Point3::from(*self.sheet.origin())).coords,
            axes: base_from_camera.rotation.to_rotation_matrix() * self.sheet.axes(),
        }
    }

    #[inline]
    pub(crate) fn local(&self, sheet: &SheetInBase, at: &Vector2<f64>) -> Option<Local> {
        let exact = (*at, Matrix2::identity());
        let (there, d_reported) = self.shape.map_or(exact, |shape| shape.corrected(at));
        let point_in_base = sheet.origin + sheet.axes * there;
        let (value, by_point) = self.plate.height(&point_in_base);
        let by_true = sheet.axes.tr_mul(&by_point);
        let gradient = d_reported.tr_mul(&by_true);
        let is_cut = gradient.norm_squared() > MIN_SINE * MIN_SINE;
        is_cut.then_some(Local { value, gradient, point_in_base, by_point, by_true })
    }

    /// ∂ true / ∂h of a point reported at `at`. Zero without a shape.
    fn true_by_shape(&self, at: &Vector2<f64>) -> SMatrix<f64, 2, 5> {
        let Some(shape) = self.shape else { return SMatrix::zeros() };
        let origin = Vector2::from(shape.origin_m);
        let from = at - origin;
        let moved = shape.corrected(at).0 - origin;
        let w = 1.0 + shape.h[3] * from.x + shape.h[4] * from.y;
        SMatrix::from_columns(&[
            Vector2::new(from.x / w, 0.0),
            Vector2::new(0.0, from.y / w),
            Vector2::new(from.y / w, 0.0),
            -moved * (from.x / w),
            -moved * (from.y / w),
        ])
    }
}
