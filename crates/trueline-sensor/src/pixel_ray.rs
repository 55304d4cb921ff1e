//! The ray of a pixel, and how it moves with the pixel and with the camera.

use crate::projection::{CAMERA_SIZE, project};
use nalgebra::{Matrix2, SMatrix, Vector2, Vector3};
use trueline_model::Camera;

/// The ray (x, y, 1) of a pixel.
pub(crate) struct PixelRay {
    /// The ray.
    pub ray: Vector3<f64>,
    /// d (x, y) / d pixel.
    pub d_pixel: Matrix2<f64>,
    /// d (x, y) / d camera.
    pub d_camera: SMatrix<f64, 2, CAMERA_SIZE>,
}

impl PixelRay {
    /// `None` where the pixel has no ray.
    #[must_use]
    pub(crate) fn of(camera: &Camera, pixel: &Vector2<f64>) -> Option<Self> {
        let (ray, _) = camera.ray(pixel).ok()?;
        let (_, d_pixel_d_camera, d_pixel_d_point) = project(camera, &ray)?;
        // At depth one the ray's x and y are the point's.
        let d_pixel = d_pixel_d_point.fixed_columns::<2>(0).try_inverse()?;
        Some(Self { ray, d_pixel, d_camera: -d_pixel * d_pixel_d_camera })
    }
}
