//! Covariances from information.

use nalgebra::DMatrix;

/// The covariance of the external axes, SI, from one of all unknowns that has them behind in units of their priors.
pub(crate) fn in_si(covariance: &DMatrix<f64>, axis_sigmas: &[f64]) -> DMatrix<f64> {
    let (count, first) = (axis_sigmas.len(), covariance.nrows() - axis_sigmas.len());
    DMatrix::from_fn(count, count, |i, j| {
        covariance[(first + i, first + j)] * axis_sigmas[i] * axis_sigmas[j]
    })
}

/// By Cholesky, scaled; `None` if it is singular.
pub(crate) fn inverse(told: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let scale = told.diagonal().map(|d| 1.0 / d.max(f64::MIN_POSITIVE).sqrt());
    let scaled = DMatrix::from_fn(told.nrows(), told.ncols(), |i, j| told[(i, j)] * scale[i] * scale[j]);
    let inverse = scaled.cholesky()?.inverse();
    Some(DMatrix::from_fn(told.nrows(), told.ncols(), |i, j| inverse[(i, j)] * scale[i] * scale[j]))
}
