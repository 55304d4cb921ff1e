//! The prior of the sensor's shape.

use nalgebra::SMatrix;

/// The prior of the sensor's shape: a Gaussian about a sensor without error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapePrior {
    /// Inverse of the covariance of h₁ … h₅.
    pub information: SMatrix<f64, 5, 5>,
}
