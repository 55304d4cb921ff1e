//! Focal lengths, centre and distortion that a calibration of the camera has missed.

use super::super::drawn_errors::DrawnErrors;
use super::super::error_table::ShopError;
use nalgebra::Vector2;
use trueline_model::Camera;

/// Centre (px) and k1 that go with a focal length that is off by 1: 1.5 px and 0.004 with 0.08 %.
const CENTRE_PX: f64 = 1.5 / 0.0008;
const K1: f64 = 0.004 / 0.0008;

/// The camera as its file has it.
pub(crate) fn stated(mut camera: Camera, errors: &DrawnErrors) -> Camera {
    if let Some(size) = errors.size(ShopError::Intrinsics) {
        let mut noise = errors.noise(ShopError::Intrinsics, 1);
        // Both focal lengths are found together; they differ by less.
        let both = noise.normal(size);
        camera.focal.x *= 1.0 + both + noise.normal(0.1 * size);
        camera.focal.y *= 1.0 + both + noise.normal(0.1 * size);
        camera.centre += Vector2::from_fn(|_, _| noise.normal(size * CENTRE_PX));
        camera.distortion.k1 += noise.normal(size * K1);
    }
    camera
}
