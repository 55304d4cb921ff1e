//! Stage 1: pixel → ray in the camera, and back.
//!
//! Pinhole with Brown–Conrady distortion. Camera frame: x right, y down, z forward. Rays are (x, y, 1).

use crate::BrownConrady;
use nalgebra::{Matrix2, Matrix3x2, Vector2, Vector3};

/// A pinhole camera with lens distortion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Image width and height, px.
    pub size: [u32; 2],
    /// Focal lengths, px.
    pub focal: Vector2<f64>,
    /// Principal point, px; (0, 0) is the centre of the top-left pixel.
    pub centre: Vector2<f64>,
    /// Lens distortion.
    pub distortion: BrownConrady,
}

/// Reason that a pixel has no ray.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PixelError {
    /// The pixel is not in the image.
    #[error("pixel ({u:.2}, {v:.2}) is outside the image of {width} x {height}")]
    OutsideImage {
        /// Column, px.
        u: f64,
        /// Row, px.
        v: f64,
        /// Image width, px.
        width: u32,
        /// Image height, px.
        height: u32,
    },
    /// The lens distortion cannot be inverted there.
    #[error("the lens distortion cannot be inverted at pixel ({u:.2}, {v:.2})")]
    NotInvertible {
        /// Column, px.
        u: f64,
        /// Row, px.
        v: f64,
    },
}

impl Camera {
    /// The ray (x, y, 1) through a distorted pixel, and d ray / d pixel (3×2).
    ///
    /// # Errors
    /// [`PixelError`] for a pixel outside the image, or where the distortion has no safe inverse.
    pub fn ray(&self, pixel: &Vector2<f64>) -> Result<(Vector3<f64>, Matrix3x2<f64>), PixelError> {
        let [width, height] = self.size;
        // A pixel reaches half a pixel around its centre.
        let inside = |x: f64, n: u32| x >= -0.5 && x <= f64::from(n) - 0.5;
        if !(inside(pixel.x, width) && inside(pixel.y, height)) {
            return Err(PixelError::OutsideImage { u: pixel.x, v: pixel.y, width, height });
        }
        let distorted = (pixel - self.centre).component_div(&self.focal);
        let (ideal, d_ideal_d_distorted) = self
            .distortion
            .undistort(&distorted)
            .ok_or(PixelError::NotInvertible { u: pixel.x, v: pixel.y })?;
        let d_ideal_d_pixel = d_ideal_d_distorted * self.inverse_focal();
        let mut d_ray_d_pixel = Matrix3x2::zeros();
        d_ray_d_pixel.fixed_rows_mut::<2>(0).copy_from(&d_ideal_d_pixel);
        Ok((Vector3::new(ideal.x, ideal.y, 1.0), d_ray_d_pixel))
    }

    /// The distorted pixel of a point in the camera frame (m).
    ///
    /// `None` for a point behind the camera, outside the image, or beyond the radius at which the distortion folds back.
    #[must_use]
    pub fn project(&self, point_in_camera: &Vector3<f64>) -> Option<Vector2<f64>> {
        if point_in_camera.z <= 0.0 {
            return None;
        }
        let ideal = point_in_camera.xy() / point_in_camera.z;
        if ideal.norm_squared() >= self.distortion.invertible_radius_squared() {
            return None;
        }
        let pixel = self.distortion.distort(&ideal).0.component_mul(&self.focal) + self.centre;
        let inside = |x: f64, n: u32| x >= -0.5 && x <= f64::from(n) - 0.5;
        (inside(pixel.x, self.size[0]) && inside(pixel.y, self.size[1])).then_some(pixel)
    }

    fn inverse_focal(&self) -> Matrix2<f64> {
        Matrix2::new(1.0 / self.focal.x, 0.0, 0.0, 1.0 / self.focal.y)
    }
}
