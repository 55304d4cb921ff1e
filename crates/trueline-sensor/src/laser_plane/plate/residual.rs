//! A pixel of the stripe on the plate, against the laser plane, with its derivatives.
//!
//! With the pixel's ray r, the plate's normal m in the camera frame and its distance δ from the camera: X = λ r, λ = δ/(m·r), and
//! s = n·X − d is the signed distance from the laser plane.

use super::state::{CAMERA, HAND_EYE, LASER_PLANE, PLATE, PlateState, SIZE};
use crate::pixel_ray::PixelRay;
use crate::projection::CAMERA_SIZE;
use crate::sheet_tilt;
use nalgebra::{SMatrix, Vector2, Vector3};
use trueline_geometry::Pose;

/// A pixel of the stripe, put on the plate.
pub(super) struct OnPlate {
    /// Signed distance from the laser plane, m.
    pub distance_m: f64,
    /// d distance / d unknowns.
    pub d_unknowns: SMatrix<f64, 1, SIZE>,
    /// d distance / d (the plate's surface, along its normal).
    pub d_surface: f64,
    /// Pixels across the stripe for each metre off the laser plane.
    pub px_per_m: f64,
    /// Its place in the camera frame, m.
    pub point_in_camera: Vector3<f64>,
}

impl OnPlate {
    /// `None` where the pixel has no ray, or the ray does not meet the plate.
    pub(super) fn of(state: &PlateState, base_from_tool: &Pose, pixel: &Vector2<f64>) -> Option<Self> {
        let pixel_ray = PixelRay::of(&state.camera, pixel)?;
        let ray = pixel_ray.ray;
        let base_from_camera = base_from_tool * state.tool_from_camera;
        let (normal_in_base, normal) =
            (state.plate_in_base.normal(), state.laser_plane_in_camera.normal().into_inner());
        let normal_in_tool = base_from_tool.rotation.inverse() * normal_in_base.into_inner();
        let plate_normal = state.tool_from_camera.rotation.inverse() * normal_in_tool;
        let toward = plate_normal.dot(&ray);
        let lambda = -state.plate_in_base.signed_distance(&base_from_camera.translation.vector) / toward;
        if !(lambda > 0.0 && lambda.is_finite()) {
            return None;
        }
        let point = ray * lambda;
        // ds = λ n·dr + n·r dλ, and dλ = (dδ − X·dm)/(m·r) − λ m·dr/(m·r).
        let d_surface = normal.dot(&ray) / toward;
        let d_ray = (normal - plate_normal * d_surface).xy().transpose() * lambda;
        let mut d = SMatrix::<f64, 1, SIZE>::zeros();
        d.fixed_columns_mut::<CAMERA_SIZE>(CAMERA).copy_from(&(d_ray * pixel_ray.d_camera));
        let tilts = point.transpose() * sheet_tilt::axes(&state.laser_plane_in_camera);
        d.fixed_columns_mut::<2>(LASER_PLANE).copy_from(&tilts);
        d[LASER_PLANE + 2] = -1.0;
        // Turning the camera on the tool by ω turns m by −ω, seen from the tool: X·dm = −ω·(n × R X). Shifting it takes n·dt off δ.
        let d_turn = normal_in_tool.cross(&(state.tool_from_camera.rotation * point));
        d.fixed_columns_mut::<3>(HAND_EYE).copy_from(&(d_turn.transpose() * d_surface));
        d.fixed_columns_mut::<3>(HAND_EYE + 3).copy_from(&(-normal_in_tool.transpose() * d_surface));
        let in_base = base_from_camera * nalgebra::Point3::from(point);
        let tilts = in_base.coords.transpose() * sheet_tilt::axes(&state.plate_in_base);
        d.fixed_columns_mut::<2>(PLATE).copy_from(&(-tilts * d_surface));
        d[PLATE + 2] = d_surface;
        Some(Self {
            distance_m: normal.dot(&point) - state.laser_plane_in_camera.offset(),
            d_unknowns: d,
            d_surface,
            px_per_m: 1.0 / (d_ray * pixel_ray.d_pixel).norm(),
            point_in_camera: point,
        })
    }
}
