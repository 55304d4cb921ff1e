//! The prior of the sensor's shape.

use nalgebra::SMatrix;

/// The shape of the sensor before the scan: a Gaussian about a sensor that reports what is there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapePrior {
    /// Inverse of the covariance of h₁ … h₅.
    pub information: SMatrix<f64, 5, 5>,
}
