//! Estimates the actual noise level.

use crate::order_statistics::median;

/// Squared whitened residual (two components) that inliers exceed once in a thousand, χ²₂ at 99.9 %. Residuals up to this estimate the noise.
const ORDINARY_SQUARED: f64 = 13.816;

/// Ratio of the inliers' residuals to the expected ones: the factor on all standard deviations.
///
/// The variance of the residuals below the limit. The limit moves with the variance until both agree. The mean of s/2 below the 99.9 % limit of χ²₂
/// is 0.99310 (1 − 0.001·(1 + 13.816/2)/0.999).
#[must_use]
pub fn noise_factor(squared: &[f64]) -> f64 {
    // The median of χ²₂ is 2 ln 2.
    let Some(median) = median(squared.iter().copied()) else { return 1.0 };
    let mut variance = median / (2.0 * std::f64::consts::LN_2);
    for _ in 0..20 {
        let limit = ORDINARY_SQUARED * variance;
        let (count, sum) =
            squared.iter().filter(|s| **s <= limit).fold((0_usize, 0.0), |(n, sum), s| (n + 1, sum + s));
        if count == 0 {
            break;
        }
        let next = 0.5 * sum / count as f64 / 0.99310;
        let settled = (next - variance).abs() <= 1e-9 * variance;
        variance = next;
        if settled {
            break;
        }
    }
    variance.sqrt()
}
