//! The camera before the laser plane is measured with it.

use crate::projection::CAMERA_SIZE;
use nalgebra::SMatrix;
use trueline_model::Camera;

/// Prior knowledge of the camera.
#[derive(Clone, Debug)]
pub struct KnownCamera {
    /// The camera.
    pub camera: Camera,
    /// Covariance of its parameters; those without variance are held, and all of them if it is zero.
    pub covariance: SMatrix<f64, CAMERA_SIZE, CAMERA_SIZE>,
}
