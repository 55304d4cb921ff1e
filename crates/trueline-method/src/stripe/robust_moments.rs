//! What a robust loss makes of the covariance of the plates' estimate.
//!
//! A frame's score is Jᵀ M r with M = Σ⁻¹ and Σ = D/w + S: the own noise D of each plate is inflated by the weight that its
//! residual earns, the noise S that the plates share is not. As w depends on r, the score moves with the residual by
//!
//! ```text
//! M + Σ_k M D_k (M r)_k (2 w′_k/w_k²) (C_kk⁻¹ r_k)ᵀ
//! ```
//!
//! and not by M alone, and its variance is that of M r. With C for Σ at w = 1, the three sums below are the traces of these by C, so
//! that the covariance is H⁻¹ · E[score] E[weight] / E[weight and slope]², as for a loss of independent residuals
//! \[Huber2009, ch. 7\], which it is without S: tr C M = 2 w, rᵀ M C M r = w² s and 2 (w + s w′).

use crate::stripe::problem::ROWS;
use nalgebra::{Matrix2, SMatrix, SVector, Vector2};

/// Sums over all frames.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RobustMoments {
    weight: f64,
    weight_and_slope: f64,
    score: f64,
}

/// How the loss pulls at a plate (or at a seam point).
pub(crate) struct Pull {
    /// Own covariance of its two rows, before its weight.
    pub own: Matrix2<f64>,
    /// w of its squared residual.
    pub weight: f64,
    /// w′ there.
    pub slope: f64,
}

impl RobustMoments {
    /// Adds a frame: C, the root W of M = Wᵀ W, its residual, and the plates that take part.
    pub(crate) fn add(
        &mut self,
        covariance: &SMatrix<f64, ROWS, ROWS>,
        whitener: &SMatrix<f64, ROWS, ROWS>,
        residual: &SVector<f64, ROWS>,
        pulls: &[Option<Pull>; 2],
    ) {
        let precision = whitener.transpose() * whitener;
        let pulled = precision * residual;
        let weight = (covariance * precision).trace();
        self.weight += weight;
        self.weight_and_slope += weight;
        self.score += pulled.dot(&(covariance * pulled));
        for (k, pull) in pulls.iter().enumerate() {
            let Some(Pull { own, weight, slope }) = pull else { continue };
            let mut inflated = SVector::<f64, ROWS>::zeros();
            inflated.fixed_rows_mut::<2>(2 * k).copy_from(&(own * pulled.fixed_rows::<2>(2 * k)));
            let through = covariance * (precision * inflated);
            let alone: Matrix2<f64> = covariance.fixed_view::<2, 2>(2 * k, 2 * k).into();
            let r: Vector2<f64> = residual.fixed_rows::<2>(2 * k).into();
            let Some(inverse) = alone.try_inverse() else { continue };
            let along = (inverse * r).dot(&through.fixed_rows::<2>(2 * k));
            self.weight_and_slope += 2.0 * slope / weight.powi(2) * along;
        }
    }

    /// Variance of the scores by what their weights expect, and how much less the scores move with the residuals than these say.
    #[must_use]
    pub fn variance_and_bend(&self) -> (f64, f64) {
        let weight = self.weight.max(f64::MIN_POSITIVE);
        (self.score / weight, self.weight_and_slope / weight)
    }
}

#[cfg(test)]
mod tests {
    use super::{Pull, RobustMoments};
    use nalgebra::{Matrix2, Matrix4, Vector4};
    use trueline_lsq::Loss;

    const LOSS: Loss = Loss::Tukey { scale: 8.0 };

    /// C, D, r → W, the weights and w′ of both plates.
    fn weighed(
        shared: &Matrix4<f64>,
        own: &[Matrix2<f64>; 2],
        r: &Vector4<f64>,
    ) -> (Matrix4<f64>, [Pull; 2]) {
        let mut all = *shared;
        (0..2).for_each(|k| {
            all.fixed_view_mut::<2, 2>(2 * k, 2 * k)
                .copy_from(&(shared.fixed_view::<2, 2>(2 * k, 2 * k) + own[k]))
        });
        let mut inflated = all;
        let pulls = [0, 1].map(|k| {
            let c: Matrix2<f64> = all.fixed_view::<2, 2>(2 * k, 2 * k).into();
            let r = r.fixed_rows::<2>(2 * k);
            let s = r.dot(&(c.try_inverse().unwrap() * r));
            let pull = Pull { own: own[k], weight: LOSS.weight(s), slope: LOSS.weight_slope(s) };
            let mut view = inflated.fixed_view_mut::<2, 2>(2 * k, 2 * k);
            view += own[k] * (1.0 / pull.weight - 1.0);
            pull
        });
        (inflated.cholesky().unwrap().l().try_inverse().unwrap(), pulls)
    }

    fn shared() -> Matrix4<f64> {
        let (a, b) = (Vector4::new(0.5, 0.4, -0.3, -0.6), Vector4::new(0.2, -0.5, 0.1, 0.7));
        a * a.transpose() + b * b.transpose()
    }

    fn own() -> [Matrix2<f64>; 2] {
        [Matrix2::new(0.5, 0.0, 0.0, 0.6), Matrix2::new(0.9, 0.0, 0.0, 0.2)]
    }

    #[test]
    fn slope_is_the_derivative_of_the_score() {
        // tr C ∂(M r)/∂r by central differences of 1e-5: good to 1e-9.
        let (shared, own) = (shared(), own());
        let mut c = shared;
        (0..2).for_each(|k| {
            let mut view = c.fixed_view_mut::<2, 2>(2 * k, 2 * k);
            view += own[k];
        });
        for r in [Vector4::new(0.3, -0.2, 1.0, 0.4), Vector4::new(2.5, 1.0, -3.0, 0.8)] {
            let (whitener, pulls) = weighed(&shared, &own, &r);
            let mut moments = RobustMoments::default();
            moments.add(&c, &whitener, &r, &pulls.map(Some));
            let score = |r: &Vector4<f64>| {
                let (whitener, _) = weighed(&shared, &own, r);
                whitener.transpose() * (whitener * r)
            };
            let h = 1e-5;
            let slope = Matrix4::from_columns(&[0, 1, 2, 3].map(|k| {
                let step = Vector4::ith(k, h);
                (score(&(r + step)) - score(&(r - step))) / (2.0 * h)
            }));
            assert!(((c * slope).trace() - moments.weight_and_slope).abs() < 1e-8);
        }
    }

    #[test]
    fn covariance_of_normal_residuals_is_that_of_the_biweight() {
        // Without shared noise: E[w²s/2] E[w]/E[w + s w′]² over E[w], for s of χ²₂ and w = (1 − s/64)²: with E[sⁿ] = 2ⁿ n!
        // 0.7825/0.8809² = 1.0084. The sums are over a grid of quantiles of s, in both plates.
        let own = [Matrix2::identity(); 2];
        let mut moments = RobustMoments::default();
        let mut weights = 0.0;
        let count = 20_000;
        for k in 0..count {
            let s: f64 = -2.0 * ((f64::from(k) + 0.5) / f64::from(count)).ln();
            let r = Vector4::new(s.sqrt(), 0.0, 0.0, s.sqrt());
            let (whitener, pulls) = weighed(&Matrix4::zeros(), &own, &r);
            weights += pulls[0].weight / f64::from(count);
            moments.add(&Matrix4::identity(), &whitener, &r, &pulls.map(Some));
        }
        let (variance, bend) = moments.variance_and_bend();
        let covariance = variance / (bend * bend) / weights;
        assert!((covariance - 1.0084).abs() < 2e-3, "{covariance}");
    }
}
