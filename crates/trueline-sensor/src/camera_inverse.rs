//! From information to covariance of a camera's parameters, and back.

use crate::projection::CAMERA_SIZE;
use nalgebra::SMatrix;

/// Inverse over the unknowns that are not held; zero for those that are.
#[must_use]
pub(crate) fn inverse_of_free(
    information: &SMatrix<f64, CAMERA_SIZE, CAMERA_SIZE>,
    fixed: &[usize],
) -> Option<SMatrix<f64, CAMERA_SIZE, CAMERA_SIZE>> {
    let mut matrix = *information;
    for &k in fixed {
        matrix.row_mut(k).fill(0.0);
        matrix.column_mut(k).fill(0.0);
        matrix[(k, k)] = 1.0;
    }
    let scale = matrix.diagonal().map(|d| 1.0 / d.sqrt());
    type Square = SMatrix<f64, CAMERA_SIZE, CAMERA_SIZE>;
    let scaled = Square::from_fn(|i, j| matrix[(i, j)] * scale[i] * scale[j]);
    let inverse = nalgebra::Cholesky::new(scaled)?.inverse();
    let mut covariance = Square::from_fn(|i, j| inverse[(i, j)] * scale[i] * scale[j]);
    for &k in fixed {
        covariance[(k, k)] = 0.0;
    }
    covariance.iter().all(|x| x.is_finite()).then_some(covariance)
}
