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

/// The weights with which values at these times make that at time 0 of the least-squares polynomial of N coefficients through them:
/// pᵢᵀ (Σ p pᵀ)⁻¹ e₀ with the powers p of the times. `None` where the times do not determine it.
pub(crate) fn weights_at_zero<const N: usize>(times_s: &[f64], unit_s: f64) -> Option<Vec<f64>> {
    let powers = |time_s: &f64| {
        let mut power = 1.0;
        SVector::<f64, N>::from_fn(|_, _| {
            let this = power;
            power *= time_s / unit_s;
            this
        })
    };
    let normal: SMatrix<f64, N, N> =
        times_s.iter().map(powers).map(|powers| powers * powers.transpose()).sum();
    let by_power = normal.cholesky()?.solve(&SVector::<f64, N>::from_fn(|k, _| f64::from(u8::from(k == 0))));
    Some(times_s.iter().map(|time_s| powers(time_s).dot(&by_power)).collect())
}
