//! The least-squares polynomial through the samples around a moment \[Savitzky1964\].

use nalgebra::{SMatrix, SVector};

/// The N coefficients of each of M values, constant first, as rows; times count from the moment, in units of `unit_s`. `None`
/// where the samples do not determine them.
pub(crate) fn coefficients<const N: usize, const M: usize>(
    samples: impl Iterator<Item = (f64, SVector<f64, M>)>,
    unit_s: f64,
) -> Option<SMatrix<f64, N, M>> {
    let mut normal = SMatrix::<f64, N, N>::zeros();
    let mut right = SMatrix::<f64, N, M>::zeros();
    for (time_s, value) in samples {
        let mut power = 1.0;
        let powers = SVector::<f64, N>::from_fn(|_, _| {
            let this = power;
            power *= time_s / unit_s;
            this
        });
        normal += powers * powers.transpose();
        right += powers * value.transpose();
    }
    Some(normal.cholesky()?.solve(&right))
}
