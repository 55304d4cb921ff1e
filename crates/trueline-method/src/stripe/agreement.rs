//! Tests whether the seam points' and the plates' answers of one scan agree.

use nalgebra::{DMatrix, DVector};
use trueline_lsq::Information;

/// Answers that differ by more standard deviations than this disagree.
pub(crate) const AGREEMENT_SIGMAS: f64 = 3.0;

/// Distance of two answers as an equivalent number of standard deviations of a normal variable. d = Δᵀ C⁻¹ Δ is χ² with k degrees of freedom, one
/// for each component. (d/k)^⅓ is nearly normal with mean 1 − 2/9k and variance 2/9k \[WilsonHilferty1931\]. `None` if nothing can be compared.
///
/// The caller supplies the covariance of the difference. The sum of both answers' covariances is too large, because the answers share frames and
/// robot noise. The distance is then too small: it reveals contradictions, but it is not exact to one standard deviation.
#[must_use]
pub fn sigmas_apart(difference: &DVector<f64>, covariance: &DMatrix<f64>) -> Option<f64> {
    let information = Information::new(covariance, &[], 1e-9)?;
    // The root of C⁻¹, without components that C holds exact.
    let whitened = information.covariance_root().transpose() * difference;
    let k = whitened.len() as f64;
    if k == 0.0 {
        return None;
    }
    let spread = 2.0 / (9.0 * k);
    Some((((whitened.norm_squared() / k).cbrt() - (1.0 - spread)) / spread.sqrt()).max(0.0))
}

#[cfg(test)]
mod tests {
    use super::sigmas_apart;
    use nalgebra::{DMatrix, DVector};

    #[test]
    fn events_as_rare_as_three_sigma_are_three_sigma() {
        // χ²₇ exceeds 18.475 and 24.322 with the probability with which a normal variable exceeds 2.326 and 3.090 (one-sided: 1 % and 0.1 %). χ²₁
        // exceeds 6.635 with the probability of 2.326. The approximation of Wilson and Hilferty is good to 0.05 with seven degrees of freedom and to
        // 0.15 with one.
        let at = |squared: f64, size: usize| {
            let mut difference = DVector::zeros(size);
            difference[0] = squared.sqrt() * 2.0;
            sigmas_apart(&difference, &(DMatrix::identity(size, size) * 4.0)).unwrap()
        };
        assert!((at(18.475, 7) - 2.326).abs() < 0.05, "{}", at(18.475, 7));
        assert!((at(24.322, 7) - 3.090).abs() < 0.05, "{}", at(24.322, 7));
        assert!((at(6.635, 1) - 2.326).abs() < 0.15, "{}", at(6.635, 1));
        assert!(at(7.0, 7) < 0.5);
        assert_eq!(sigmas_apart(&DVector::zeros(0), &DMatrix::zeros(0, 0)), None);
    }
}
