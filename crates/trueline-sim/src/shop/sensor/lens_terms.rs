//! Lens terms that the true camera has and its file has not.

use super::super::drawn_errors::DrawnErrors;
use super::super::error_table::ShopError;
use trueline_model::Camera;

/// k3 over the tangential terms.
const K3: f64 = 50.0;

/// The true camera.
pub(crate) fn with_terms(mut camera: Camera, errors: &DrawnErrors) -> Camera {
    if let Some(size) = errors.size(ShopError::LensTerms) {
        let mut noise = errors.noise(ShopError::LensTerms, 1);
        camera.distortion.p1 += noise.normal(size);
        camera.distortion.p2 += noise.normal(size);
        camera.distortion.k3 += noise.normal(size * K3);
    }
    camera
}
