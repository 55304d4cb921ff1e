//! Tests whether the seam points' and the plates' answers of one scan agree.

use crate::assess::share::{Share, ShareOf};
use crate::problem::parameters::LINES;
use crate::stripe::outcome::{AGREEMENT_SIGMAS, Answer};
use nalgebra::{DMatrix, DVector, SVector};
use trueline_lsq::Information;

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

/// Files have stamps of a nanosecond and lengths of nanometres. Smaller differences between answers are not resolved, s, rad and m.
const ROUNDING_SI: f64 = 1e-9;

/// Errors of an answer.
pub(crate) struct Errors<'a> {
    /// Covariance from noise.
    pub noise: &'a DMatrix<f64>,
    /// Systematic errors.
    pub shares: &'a [Share],
}

/// Distance of the answers of seam points and stripes, σ, without the part that the plates' forms explain. `by_forms` is the shift of the seam
/// points' answer from these forms, if the points are intersections of straight lines.
pub(crate) fn unexplained(
    seam: (&Answer, &Errors<'_>),
    stripe: (&Answer, &Errors<'_>),
    by_forms: impl Fn() -> Option<SVector<f64, LINES>>,
) -> Option<f64> {
    let disagree = |sigmas: &f64| *sigmas >= AGREEMENT_SIGMAS;
    let plain = apart(seam, stripe, None);
    let explained = plain.filter(disagree).and_then(|_| apart(seam, stripe, by_forms()));
    explained.filter(|sigmas| !disagree(sigmas)).or(plain)
}

/// Distance of both answers over the clock and hand-eye components that both determine. Both share robot, sensor and detector. Of these errors only
/// the difference of their effects counts.
fn apart(
    (seam, of_seam): (&Answer, &Errors<'_>),
    (stripe, of_stripe): (&Answer, &Errors<'_>),
    by_forms: Option<SVector<f64, LINES>>,
) -> Option<f64> {
    let seen = |answer: &Answer, k: usize| answer.observability.observable_components[k];
    let both: Vec<usize> = (0..LINES).filter(|k| seen(seam, *k) && seen(stripe, *k)).collect();
    let difference = stripe.parameters.minus(&seam.parameters.guess());
    let chosen = DVector::from_iterator(both.len(), both.iter().map(|k| difference[*k]));
    let by_errors = by_errors(of_seam.shares, of_stripe.shares);
    let covariance = DMatrix::from_fn(both.len(), both.len(), |i, j| {
        let place = (both[i], both[j]);
        let rounding = if i == j { ROUNDING_SI * ROUNDING_SI } else { 0.0 };
        let by_forms = by_forms.map_or(0.0, |moved| moved[place.0] * moved[place.1]);
        of_seam.noise[place] + of_stripe.noise[place] + by_errors[place] + by_forms + rounding
    });
    sigmas_apart(&chosen, &covariance)
}

/// Covariance of the difference of two answers from their systematic errors. Equal errors of robot, detector and sensor move both.
fn by_errors(seam: &[Share], stripe: &[Share]) -> DMatrix<f64> {
    let mut alone: Vec<&Share> = stripe.iter().collect();
    let mut all = DMatrix::zeros(LINES, LINES);
    let mut add = |columns: DMatrix<f64>| all += &columns * columns.transpose();
    for share in seam {
        let own = share.columns.rows(0, LINES);
        let is_common = |other: &&Share| {
            let is_of_cell = !matches!(share.of, ShareOf::SeamForm | ShareOf::EdgeRadius | ShareOf::Stamps);
            is_of_cell && other.of == share.of && other.columns.ncols() == share.columns.ncols()
        };
        let common = alone.iter().position(is_common).map(|place| alone.remove(place));
        match common {
            Some(other) => add(own - other.columns.rows(0, LINES)),
            None => add(own.into_owned()),
        }
    }
    alone.iter().for_each(|share| add(share.columns.rows(0, LINES).into_owned()));
    all
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
