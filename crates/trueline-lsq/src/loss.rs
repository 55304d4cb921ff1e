//! Robust losses ρ(s) of the squared whitened residual s = |r|².
//!
//! All have ρ(s) ≈ s near zero, so that the cost ½ Σ ρ is the ordinary one for small residuals. All scales are in standard deviations. Sources:
//! \[Yang2025, Eq. 16\] (Huber), \[Black1996\] (the others).

/// A robust loss. `scale` is the residual, in standard deviations, at which it departs from the square.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Loss {
    /// ρ = s: ordinary least squares.
    Squared,
    /// Quadratic up to `scale` and linear beyond. The influence is bounded, but never zero.
    Huber {
        /// Start of the linear part, σ.
        scale: f64,
    },
    /// ρ = c² ln(1 + s/c²).
    Cauchy {
        /// c, σ.
        scale: f64,
    },
    /// ρ = s/(1 + s/c²): redescends and saturates at c².
    GemanMcClure {
        /// c, σ.
        scale: f64,
    },
    /// Tukey's biweight: no influence beyond c, and nearly quadratic well inside it.
    Tukey {
        /// c, σ.
        scale: f64,
    },
}

impl Loss {
    /// ρ(s).
    #[must_use]
    #[inline]
    pub fn value(&self, squared: f64) -> f64 {
        match *self {
            Self::Squared => squared,
            Self::Huber { scale } => {
                if squared <= scale * scale {
                    squared
                } else {
                    2.0 * scale * squared.sqrt() - scale * scale
                }
            }
            Self::Cauchy { scale } => {
                let c2 = scale * scale;
                c2 * (squared / c2).ln_1p()
            }
            Self::GemanMcClure { scale } => squared / (1.0 + squared / (scale * scale)),
            Self::Tukey { scale } => {
                let c2 = scale * scale;
                if squared >= c2 { c2 / 3.0 } else { c2 / 3.0 * (1.0 - (1.0 - squared / c2).powi(3)) }
            }
        }
    }

    /// ρ′(s): the weight of the residual in the re-weighted least squares.
    #[must_use]
    #[inline]
    pub fn weight(&self, squared: f64) -> f64 {
        match *self {
            Self::Squared => 1.0,
            Self::Huber { scale } => {
                if squared <= scale * scale {
                    1.0
                } else {
                    scale / squared.sqrt()
                }
            }
            Self::Cauchy { scale } => 1.0 / (1.0 + squared / (scale * scale)),
            Self::GemanMcClure { scale } => (1.0 + squared / (scale * scale)).powi(-2),
            Self::Tukey { scale } => {
                let c2 = scale * scale;
                if squared >= c2 { 0.0 } else { (1.0 - squared / c2).powi(2) }
            }
        }
    }

    /// ρ″(s): the slope of the weight. It enters the covariance of a robust estimate, not the step.
    #[must_use]
    #[inline]
    pub fn weight_slope(&self, squared: f64) -> f64 {
        match *self {
            Self::Squared => 0.0,
            Self::Huber { scale } => {
                if squared <= scale * scale {
                    0.0
                } else {
                    -0.5 * scale * squared.powf(-1.5)
                }
            }
            Self::Cauchy { scale } => -(scale * scale) / (scale * scale + squared).powi(2),
            Self::GemanMcClure { scale } => {
                let c2 = scale * scale;
                -2.0 / c2 * (1.0 + squared / c2).powi(-3)
            }
            Self::Tukey { scale } => {
                let c2 = scale * scale;
                if squared >= c2 { 0.0 } else { -2.0 / c2 * (1.0 - squared / c2) }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Loss; 5] = [
        Loss::Squared,
        Loss::Huber { scale: 1.5 },
        Loss::Cauchy { scale: 1.5 },
        Loss::GemanMcClure { scale: 1.5 },
        Loss::Tukey { scale: 1.5 },
    ];

    #[test]
    fn weight_and_slope_are_derivatives() {
        // Central difference with step h: truncation ~ h² ρ‴ ≤ 1e-8, rounding ~ eps/h = 2e-12.
        let h = 1e-4;
        for loss in ALL {
            for s in [0.01, 0.7, 1.9, 2.6, 9.0] {
                let slope = (loss.value(s + h) - loss.value(s - h)) / (2.0 * h);
                assert!((slope - loss.weight(s)).abs() < 1e-7, "{loss:?} at {s}");
                let bend = (loss.weight(s + h) - loss.weight(s - h)) / (2.0 * h);
                assert!((bend - loss.weight_slope(s)).abs() < 1e-7, "{loss:?} at {s}");
            }
        }
    }

    #[test]
    fn losses_are_continuous_where_they_bend_and_saturate_where_they_should() {
        let c2 = 1.5 * 1.5;
        for loss in ALL {
            // Slopes are at most 1, so no loss rises by more across 2e-9.
            let step = loss.value(c2 + 1e-9) - loss.value(c2 - 1e-9);
            assert!((0.0..=2.1e-9).contains(&step), "{loss:?} {step}");
        }
        // From \[Black1996\]: Tukey's ends at c²/3. Geman–McClure approaches c² as c⁴/s.
        assert!((ALL[4].value(1e12) - c2 / 3.0).abs() < 1e-15);
        assert!((ALL[3].value(1e12) - c2).abs() < 1e-11);
        // Huber: 2c√s − c².
        assert!((ALL[1].value(16.0) - (2.0 * 1.5 * 4.0 - c2)).abs() < 1e-14);
        assert!((ALL[2].value(c2) - c2 * 2.0_f64.ln()).abs() < 1e-15);
        // At the transition itself a residual is ordinary.
        assert_eq!((ALL[1].weight(c2), ALL[1].weight_slope(c2)), (1.0, 0.0));
    }

    #[test]
    fn every_loss_is_quadratic_near_zero() {
        for loss in ALL {
            // ρ(s) = s + O(s²) with a second derivative of at most 2/c² ≈ 1.
            assert!((loss.value(1e-6) - 1e-6).abs() < 1e-11, "{loss:?}");
            assert!((loss.weight(0.0) - 1.0).abs() < 1e-15, "{loss:?}");
        }
    }
}
