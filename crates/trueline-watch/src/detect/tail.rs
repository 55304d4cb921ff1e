//! Probability of a statistic, as a logarithm. Alarms are decided at probabilities far below the rounding of
//! a subtraction from one.
//!
//! q is a sum of d squares in units of their own scatter. For a known scatter q ~ χ²_d. If it was learnt with
//! ν degrees of freedom, q/d ~ F(d, ν), which is χ²_d/d for ν → ∞. P(q′ > q) = I_x(ν/2, d/2) with x = ν/(ν +
//! q) \[Abramowitz1964, 26.6.2\], by its continued fraction \[Abramowitz1964, 26.5.8\].

use libm::lgamma;

/// Degrees of freedom beyond which the scatter is as good as known.
const MANY: f64 = 1e7;

/// log₁₀ P(q′ > q) for d squares with a scatter known with `freedom` degrees of freedom; 0 for d = 0.
#[must_use]
pub fn log10_probability(q: f64, dimensions: usize, freedom: f64) -> f64 {
    if dimensions == 0 || q.is_nan() || q <= 0.0 {
        return 0.0;
    }
    let nu = freedom.clamp(1.0, MANY);
    let (a, b) = (0.5 * nu, 0.5 * dimensions as f64);
    // x = ν/(ν + q), kept as its logarithm and as 1 − x, for either may be next to nothing.
    let ln_x = -(q / nu).ln_1p();
    let one_less_x = q / (nu + q);
    let ln_front = a * ln_x + b * one_less_x.ln() + lgamma(a + b) - lgamma(a) - lgamma(b);
    let x = nu / (nu + q);
    let ln_probability = if x < (a + 1.0) / (a + b + 2.0) {
        ln_front + (fraction(a, b, x) / a).ln()
    } else {
        (-(ln_front + (fraction(b, a, one_less_x) / b).ln()).exp()).ln_1p()
    };
    ln_probability / std::f64::consts::LN_10
}

/// The continued fraction of the incomplete beta function, by Lentz' rule.
fn fraction(a: f64, b: f64, x: f64) -> f64 {
    const TINY: f64 = 1e-300;
    let away = |value: f64| if value.abs() < TINY { TINY } else { value };
    let mut c = 1.0;
    let mut d = away(1.0 - (a + b) * x / (a + 1.0)).recip();
    let mut value = d;
    for m in 1..10_000 {
        let m = f64::from(m);
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        d = away(1.0 + even * d).recip();
        c = away(1.0 + even / c);
        value *= d * c;
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        d = away(1.0 + odd * d).recip();
        c = away(1.0 + odd / c);
        value *= d * c;
        if (d * c - 1.0).abs() < 1e-13 {
            break;
        }
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;

    /// χ²_d for even d is a finite sum: e^(−q/2) Σ_{k < d/2} (q/2)^k/k!.
    fn closed_form(q: f64, d: usize) -> f64 {
        let (mut term, mut sum) = (1.0, 0.0);
        for k in 0..d / 2 {
            sum += term;
            term *= 0.5 * q / (k + 1) as f64;
        }
        (-0.5 * q + f64::ln(sum)) / std::f64::consts::LN_10
    }

    #[test]
    fn even_dimensions_agree_with_the_finite_sum() {
        for d in [2, 4, 6] {
            for q in [0.1, 1.0, 5.0, 30.0, 200.0, 5000.0] {
                let (found, known) = (log10_probability(q, d, f64::INFINITY), closed_form(q, d));
                // The F distribution with 1e7 degrees of freedom differs by q²/(4·1e7) in its logarithm.
                let tolerance = 1e-7 + q * q / 1e7;
                assert!((found - known).abs() < tolerance, "d {d} q {q}: {found} {known}");
            }
        }
    }

    #[test]
    fn two_dimensions_with_learnt_scatter_have_a_closed_form() {
        // F(2, ν): P = (1 + q/ν)^(−ν/2).
        for nu in [3.0, 29.0, 500.0] {
            for q in [0.5, 10.0, 60.0, 400.0] {
                let known = -0.5 * nu * f64::ln_1p(q / nu) / std::f64::consts::LN_10;
                let found = log10_probability(q, 2, nu);
                // Rounding of lgamma at ν/2 = 250 is 1e-13 of 1000.
                assert!((found - known).abs() < 1e-9, "ν {nu} q {q}: {found} {known}");
            }
        }
    }

    #[test]
    fn one_dimension_is_the_normal_tail() {
        // Two-sided tails of the normal distribution: 4.5500e-2 at 2 σ, 5.7330e-7 at 5 σ (to the digits given).
        for (sigma, p) in [(2.0_f64, 4.550_026e-2_f64), (5.0, 5.733_031e-7)] {
            let found = log10_probability(sigma * sigma, 1, f64::INFINITY);
            assert!((found - p.log10()).abs() < 1e-5, "{sigma}: {found}");
        }
        assert_eq!(log10_probability(0.0, 3, f64::INFINITY), 0.0);
        assert_eq!(log10_probability(9.0, 0, f64::INFINITY), 0.0);
    }
}
