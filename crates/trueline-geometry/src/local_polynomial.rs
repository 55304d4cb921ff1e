//! The least-squares polynomial through the samples around a time \[Savitzky1964\].

use nalgebra::{SMatrix, SVector};

/// The N coefficients of each of M values, constant first, as rows. Times are relative to the centre, in units of `unit_s`. `None` if the samples do
/// not determine them.
#[must_use]
pub fn coefficients<const N: usize, const M: usize>(
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

/// Weights that turn values at these times into the value at time 0 of their least-squares polynomial with N
/// coefficients: pᵢᵀ (Σ p pᵀ)⁻¹ e₀ with the powers p of the times. `None` where the times do not determine
/// it.
pub(crate) fn weights_at_zero<const N: usize>(times_s: &[f64], unit_s: f64) -> Option<Vec<f64>> {
    let mut weights = vec![0.0; times_s.len()];
    weights_into::<N>(times_s, unit_s, &value_at::<N>(0.0), &mut weights)?;
    Some(weights)
}

/// The functional that maps a polynomial's N coefficients to its value at a time, in units of the fit.
#[must_use]
pub fn value_at<const N: usize>(time: f64) -> SVector<f64, N> {
    let mut power = 1.0;
    SVector::<f64, N>::from_fn(|_, _| {
        let this = power;
        power *= time;
        this
    })
}

/// The functional that maps a polynomial's N coefficients to its slope at a time, both in units of the fit.
#[must_use]
pub fn slope_at<const N: usize>(time: f64) -> SVector<f64, N> {
    let mut power = 1.0;
    SVector::<f64, N>::from_fn(|k, _| {
        if k == 0 {
            return 0.0;
        }
        let this = power * k as f64;
        power *= time;
        this
    })
}

/// Weights that turn values at some times into a functional (see [`value_at`]) of their least-squares polynomial with N
/// coefficients, written into a caller's buffer. Times count in units of `unit_s`. `None` where the times do not determine
/// it, and for a buffer that is too short.
#[must_use]
pub fn weights_into<const N: usize>(
    times_s: &[f64],
    unit_s: f64,
    functional: &SVector<f64, N>,
    weights: &mut [f64],
) -> Option<()> {
    let powers = |time_s: &f64| value_at::<N>(time_s / unit_s);
    let weights = weights.get_mut(..times_s.len())?;
    let normal: SMatrix<f64, N, N> =
        times_s.iter().map(powers).map(|powers| powers * powers.transpose()).sum();
    let by_power = normal.cholesky()?.solve(functional);
    for (weight, time_s) in weights.iter_mut().zip(times_s) {
        *weight = powers(time_s).dot(&by_power);
    }
    Some(())
}
