//! A pixel of the laser's stripe on a board, against the laser plane.
//!
//! Let r be the ray of the pixel and m the board's normal. The surface is m·X = m·t + z + b, where z is the height of the
//! bent sheet and b the bulge at that point. Then X = λ r, and s = n·X − d is the signed distance from the laser plane.
//! Derivatives are along the normal of the surface at the crossing, m less the slope of the sheet.

use crate::board::Board;
use crate::bundle_state::{BoardState, PICTURE_SIZE, SENSOR_SIZE, SHARED_SIZE};
use crate::pixel_ray::PixelRay;
use crate::projection::CAMERA_SIZE;
use crate::sheet::{SHEET_SIZE, SheetShape, Surface};
use crate::sheet_tilt;
use nalgebra::{SMatrix, Vector2, Vector3};
use trueline_geometry::{Plane, Pose, so3};
use trueline_model::Camera;

/// A pixel of the stripe. The scale from metres to pixels is taken from an earlier estimate and held fixed; the fit
/// is then repeated with better values. So derivatives are exact and the estimate is that of distances in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StripePixel {
    /// Place of the stripe, px.
    pub pixel: Vector2<f64>,
    /// Pixels across the stripe for each metre off the laser plane.
    pub px_per_m: f64,
    /// Place along the stripe on the board, from its middle, m.
    pub along_m: f64,
}

/// A pixel of the stripe, put on the board.
#[derive(Clone, Debug)]
pub(crate) struct StripePoint {
    /// Signed distance from the laser plane, m.
    pub distance_m: f64,
    /// d distance / d (camera, plane).
    pub d_shared: SMatrix<f64, 1, SHARED_SIZE>,
    /// d distance / d (pose, bulge, twist).
    pub d_own: SMatrix<f64, 1, PICTURE_SIZE>,
    /// Its place in the camera frame, m.
    pub point_in_camera: Vector3<f64>,
    /// Pixels across the stripe for each metre off the laser plane.
    pub px_per_m: f64,
}

impl StripePoint {
    /// The point that a pixel of the stripe shows. `None` where the pixel has no ray, or the ray does not meet the board.
    #[must_use]
    pub(crate) fn of(
        camera: &Camera,
        plane: &Plane,
        (board, sheet): (&BoardState, Sheet<'_>),
        stripe: &StripePixel,
    ) -> Option<Self> {
        let ray = PixelRay::of(camera, &stripe.pixel)?;
        let pose = &board.camera_from_board;
        let bulge_m = board.bulge_m + board.twist * stripe.along_m;
        let Met { lambda, normal: board_normal, surface } = sheet.met(pose, &ray.ray, bulge_m)?;
        let toward = board_normal.dot(&ray.ray);
        let point = ray.ray * lambda;
        let normal = plane.normal().into_inner();

        // ds = λ n·dr + n·r dλ, and dλ = −λ m·dr / m·r along the ray's move.
        let across = normal.dot(&ray.ray);
        let d_ray = (normal - board_normal * (across / toward)).xy().transpose() * lambda;
        let mut d_shared = SMatrix::<f64, 1, SHARED_SIZE>::zeros();
        d_shared.fixed_columns_mut::<CAMERA_SIZE>(0).copy_from(&(d_ray * ray.d_camera));
        let d_plane = point.transpose() * sheet_tilt::axes(plane);
        d_shared[CAMERA_SIZE] = d_plane[0];
        d_shared[CAMERA_SIZE + 1] = d_plane[1];
        d_shared[CAMERA_SIZE + 2] = -1.0;

        // Turning the board by δ turns m by δ × m about the board's origin t: m·(t − X) changes by δ·(m × (t − X)).
        let d_lambda = across / toward;
        let arm = pose.translation.vector - point;
        let d_rotation = (so3::hat(&board_normal) * arm).transpose() * d_lambda;
        let d_translation = board_normal.transpose() * d_lambda;
        d_shared.fixed_columns_mut::<SHEET_SIZE>(SENSOR_SIZE).copy_from(&(surface.d_shape * d_lambda));
        let mut d_own = SMatrix::<f64, 1, PICTURE_SIZE>::zeros();
        d_own.fixed_columns_mut::<3>(0).copy_from(&d_rotation);
        d_own.fixed_columns_mut::<3>(3).copy_from(&d_translation);
        d_own[6] = d_lambda;
        d_own[7] = d_lambda * stripe.along_m;
        Some(Self {
            distance_m: normal.dot(&point) - plane.offset(),
            d_shared,
            d_own,
            point_in_camera: point,
            px_per_m: 1.0 / (d_ray * ray.d_pixel).norm(),
        })
    }
}

/// A board and the shape of its sheet.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sheet<'a> {
    /// The board.
    pub board: &'a Board,
    /// Its sheet's shape.
    pub shape: &'a SheetShape,
}

/// Crossing of a ray with a sheet.
pub(crate) struct Met {
    /// Ray lengths from the camera.
    pub lambda: f64,
    /// Gradient of the surface there in the camera frame: the board's normal less the slope of the sheet.
    pub normal: Vector3<f64>,
    /// The sheet there.
    pub surface: Surface,
}

/// Rounds until a ray's meeting with a bent sheet stands still: each leaves the slope's part of the error before, a twentieth.
const ROUNDS: usize = 12;

impl Sheet<'_> {
    /// The point of the sheet that a pixel shows, in the camera frame, m.
    pub(crate) fn seen(&self, camera: &Camera, pose: &Pose, pixel: &Vector2<f64>) -> Option<Vector3<f64>> {
        let (ray, _) = camera.ray(pixel).ok()?;
        Some(ray * self.met(pose, &ray, 0.0)?.lambda)
    }

    /// Crossing of a ray from the camera with the sheet, lifted by a bulge. `None` if there is no crossing.
    pub(crate) fn met(&self, pose: &Pose, ray: &Vector3<f64>, bulge_m: f64) -> Option<Met> {
        let flat = pose.rotation * Vector3::z();
        let place = |lambda: f64| (pose.rotation.inverse() * (ray * lambda - pose.translation.vector)).xy();
        let mut lambda = flat.dot(&pose.translation.vector) / flat.dot(ray);
        if !(lambda > 0.0 && lambda.is_finite()) {
            return None;
        }
        let mut surface = self.shape.surface(self.board, &place(lambda));
        let mut normal = flat;
        for _ in 0..ROUNDS {
            normal = pose.rotation * Vector3::new(-surface.slope.x, -surface.slope.y, 1.0);
            let above = flat.dot(&(ray * lambda - pose.translation.vector)) - surface.height_m - bulge_m;
            let step = above / normal.dot(ray);
            lambda -= step;
            surface = self.shape.surface(self.board, &place(lambda));
            if step.abs() < 1e-15 * lambda.abs() {
                break;
            }
        }
        (lambda > 0.0 && lambda.is_finite()).then_some(Met { lambda, normal, surface })
    }
}
