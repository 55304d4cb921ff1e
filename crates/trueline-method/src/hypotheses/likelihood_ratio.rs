//! Threshold at which data separate two explanations.

/// Difference in twice the log likelihood below which data cannot separate two solutions: 5 σ.
pub(crate) const LIKELIHOOD_RATIO_LIMIT: f64 = 25.0;

/// Twice the log likelihood ratio of residuals at `factor` times the expected noise to ones at `other_factor`, for n features of two numbers each:
/// −2 log L = 2 n ln f².
#[must_use]
pub(crate) fn noise_advantage(features: usize, factor: f64, other_factor: f64) -> f64 {
    4.0 * features as f64 * (other_factor / factor).ln()
}
