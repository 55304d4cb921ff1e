//! From information to covariance over the unknowns that are not held, and back.

use nalgebra::{Cholesky, SMatrix};

/// Inverse over the free unknowns; zero for those held fixed.
#[must_use]
pub(crate) fn inverse_of_free<const N: usize>(
    information: &SMatrix<f64, N, N>,
    fixed: &[usize],
) -> Option<SMatrix<f64, N, N>> {
    let held = |k: usize| fixed.contains(&k);
    let matrix = SMatrix::<f64, N, N>::from_fn(|i, j| match (held(i) || held(j), i == j) {
        (false, _) => information[(i, j)],
        (true, same) => f64::from(u8::from(same)),
    });
    // Pixels, radians and metres are brought to one size.
    let scale = matrix.diagonal().map(|d| 1.0 / d.sqrt());
    let scaled = SMatrix::<f64, N, N>::from_fn(|i, j| matrix[(i, j)] * scale[i] * scale[j]);
    let inverse = Cholesky::new(scaled)?.inverse();
    let covariance = SMatrix::<f64, N, N>::from_fn(|i, j| {
        if held(i) || held(j) { 0.0 } else { inverse[(i, j)] * scale[i] * scale[j] }
    });
    covariance.iter().all(|x| x.is_finite()).then_some(covariance)
}
