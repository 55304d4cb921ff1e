//! How far each cut is from what all others predict.
//!
//! Of a linear fit that follows without fitting again: with the whitened residual r, its derivative A and the covariance C of the estimate,
//! the residual of a cut that is left out is (1 − A C Aᵀ)⁻¹ r.

use super::model::{RoundState, SIZE};
use super::problem::RoundProblem;
use super::target::Square;
use nalgebra::SMatrix;

/// Errors of cuts that are left out.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HeldOut {
    /// Root mean square distance of an arc from the prediction by the other cuts, m.
    pub rms_m: f64,
    /// The same as the uncertainties have it, m.
    pub expected_rms_m: f64,
    /// The same of the cuts in the fit, m.
    pub fitted_rms_m: f64,
}

impl HeldOut {
    /// Of all cuts that count; `covariance` is that of the estimate in units of the whitening, and `factor` scales it to the residuals.
    pub(super) fn of(
        problem: &RoundProblem<'_>,
        at: &RoundState,
        covariance: &SMatrix<f64, SIZE, SIZE>,
        factor: f64,
    ) -> Option<Self> {
        let (mut out, mut expected, mut fitted, mut count) = (0.0, 0.0, 0.0, 0.0);
        for k in problem.counting() {
            let (residual, jacobian) = problem.linearized(k, at)?;
            let left = (Square::identity() - jacobian * covariance * jacobian.transpose()).try_inverse()?;
            let unwhitened = problem.whitening[k].try_inverse()?;
            out += (unwhitened * left * residual).norm_squared();
            let squares = (unwhitened * left * unwhitened.transpose()).diagonal();
            expected += squares.iter().take(problem.scan.row.rows).sum::<f64>() * factor;
            fitted += (unwhitened * residual).norm_squared();
            count += 1.0;
        }
        let rms = |sum: f64| (sum / f64::max(count, 1.0)).sqrt();
        Some(Self { rms_m: rms(out), expected_rms_m: rms(expected), fitted_rms_m: rms(fitted) })
    }
}
