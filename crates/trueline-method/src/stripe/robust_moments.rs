//! Effect of a robust loss on the covariance of the plates' estimate.
//!
//! A frame's score is Jᵀ M r with M = Σ⁻¹ and Σ = D/w + S. The own noise D of each plate is inflated by the weight of its residual. The noise S that
//! the plates share is not. As w depends on r, the derivative of the score by the residual is
//!
//! ```text
//! M + Σ_k M D_k (M r)_k (2 w′_k/w_k²) (C_kk⁻¹ r_k)ᵀ
//! ```
//!
//! and not M alone. Its variance is that of M r. With C for Σ at w = 1, the three sums below are the traces of these with C. The covariance is H⁻¹ ·
//! E[score] E[weight] / E[weight and slope]², as for a loss of independent residuals \[Huber2009, ch. 7\]. Without S it equals that: tr C M = 2 w,
//! rᵀ M C M r = w² s and 2 (w + s w′).

use crate::stripe::blocks::{BLOCKS, block, pair_of_block, spread_of_block};
use crate::stripe::frame_residual::ROWS;
use nalgebra::{Matrix2, SMatrix, SVector};

/// Sums over all frames.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RobustMoments {
    weight: f64,
    weight_and_slope: f64,
    score: f64,
}

/// Weight of the loss for a plate, an edge point, or a seam point.
pub(crate) struct Pull {
    /// Own covariance of its rows, before its weight.
    pub own: Matrix2<f64>,
    /// w at its squared residual.
    pub weight: f64,
    /// w′ there.
    pub slope: f64,
}

impl RobustMoments {
    /// Adds a frame: C, the root W of M = Wᵀ W, its residual, and its blocks.
    pub(crate) fn add(
        &mut self,
        covariance: &SMatrix<f64, ROWS, ROWS>,
        whitener: &SMatrix<f64, ROWS, ROWS>,
        residual: &SVector<f64, ROWS>,
        pulls: &[Option<Pull>; BLOCKS],
    ) {
        let precision = whitener.transpose() * whitener;
        let pulled = precision * residual;
        let weight = (covariance * precision).trace();
        self.weight += weight;
        self.weight_and_slope += weight;
        self.score += pulled.dot(&(covariance * pulled));
        for (k, pull) in pulls.iter().enumerate() {
            let Some(Pull { own, weight, slope }) = pull else { continue };
            let inflated = spread_of_block(&(own * pair_of_block(&pulled, k)), k);
            let through = pair_of_block(&(covariance * (precision * inflated)), k);
            let Some(inverse) = block(covariance, k).try_inverse() else { continue };
            let along = (inverse * pair_of_block(residual, k)).dot(&through);
            self.weight_and_slope += 2.0 * slope / weight.powi(2) * along;
        }
    }

    /// Ratio of the scores' variance to that expected from the weights, and the reduced response of the scores to the residuals.
    #[must_use]
    pub(crate) fn variance_and_bend(&self) -> (f64, f64) {
        let weight = self.weight.max(f64::MIN_POSITIVE);
        (self.score / weight, self.weight_and_slope / weight)
    }
}

#[cfg(test)]
mod tests {
    use super::{Pull, RobustMoments};
    use crate::stripe::blocks::{BLOCKS, add_to_block, block, pair_of_block};
    use nalgebra::{Matrix2, Matrix5, Vector5};
    use trueline_lsq::Loss;

    const LOSS: Loss = Loss::Tukey { scale: 8.0 };

    /// The covariance of a frame before its weights.
    fn all(shared: &Matrix5<f64>, own: &[Matrix2<f64>; BLOCKS]) -> Matrix5<f64> {
        let mut all = *shared;
        (0..BLOCKS).for_each(|k| add_to_block(&mut all, k, &own[k]));
        all
    }

    /// C, D, r → W, the weights and w′ of each block.
    fn weighed(
        shared: &Matrix5<f64>,
        own: &[Matrix2<f64>; BLOCKS],
        r: &Vector5<f64>,
    ) -> (Matrix5<f64>, [Pull; BLOCKS]) {
        let all = all(shared, own);
        let mut inflated = all;
        let pulls = [0, 1, 2].map(|k| {
            let r = pair_of_block(r, k);
            let s = r.dot(&(block(&all, k).try_inverse().unwrap() * r));
            let pull = Pull { own: own[k], weight: LOSS.weight(s), slope: LOSS.weight_slope(s) };
            add_to_block(&mut inflated, k, &(own[k] * (1.0 / pull.weight - 1.0)));
            pull
        });
        (inflated.cholesky().unwrap().l().try_inverse().unwrap(), pulls)
    }

    fn shared() -> Matrix5<f64> {
        let (a, b) = (Vector5::new(0.5, 0.4, -0.3, -0.6, 0.4), Vector5::new(0.2, -0.5, 0.1, 0.7, 0.3));
        a * a.transpose() + b * b.transpose()
    }

    fn own() -> [Matrix2<f64>; BLOCKS] {
        [Matrix2::new(0.5, 0.0, 0.0, 0.6), Matrix2::new(0.9, 0.0, 0.0, 0.2), Matrix2::new(0.7, 0.0, 0.0, 0.0)]
    }

    #[test]
    fn slope_is_the_derivative_of_the_score() {
        // tr C ∂(M r)/∂r by central differences of 1e-5: good to 1e-9.
        let (shared, own) = (shared(), own());
        let c = all(&shared, &own);
        for r in [Vector5::new(0.3, -0.2, 1.0, 0.4, -0.9), Vector5::new(2.5, 1.0, -3.0, 0.8, 2.0)] {
            let (whitener, pulls) = weighed(&shared, &own, &r);
            let mut moments = RobustMoments::default();
            moments.add(&c, &whitener, &r, &pulls.map(Some));
            let score = |r: &Vector5<f64>| {
                let (whitener, _) = weighed(&shared, &own, r);
                whitener.transpose() * (whitener * r)
            };
            let h = 1e-5;
            let slope = Matrix5::from_columns(&[0, 1, 2, 3, 4].map(|k| {
                let step = Vector5::ith(k, h);
                (score(&(r + step)) - score(&(r - step))) / (2.0 * h)
            }));
            assert!(((c * slope).trace() - moments.weight_and_slope).abs() < 1e-8);
        }
    }

    #[test]
    fn covariance_of_normal_residuals_is_that_of_the_biweight() {
        // Without shared noise: E[w²s/2] E[w]/E[w + s w′]² over E[w], for s of χ²₂ and w = (1 − s/64)². With E[sⁿ] = 2ⁿ n! this is 0.7825/0.8809² =
        // 1.0084. The sums are over a grid of quantiles of s, in both plates, without the edge's row.
        let own = [Matrix2::identity(), Matrix2::identity(), Matrix2::zeros()];
        let mut without_edge = Matrix5::zeros();
        without_edge.fixed_view_mut::<4, 4>(0, 0).fill_with_identity();
        let mut moments = RobustMoments::default();
        let mut weights = 0.0;
        let count = 20_000;
        for k in 0..count {
            let s: f64 = -2.0 * ((f64::from(k) + 0.5) / f64::from(count)).ln();
            let r = Vector5::new(s.sqrt(), 0.0, 0.0, s.sqrt(), 0.0);
            let placeholder = Matrix5::from_diagonal(&Vector5::ith(4, 1.0));
            let (whitener, [one, other, _]) = weighed(&placeholder, &own, &r);
            weights += one.weight / f64::from(count);
            moments.add(&without_edge, &(whitener * without_edge), &r, &[Some(one), Some(other), None]);
        }
        let (variance, bend) = moments.variance_and_bend();
        let covariance = variance / (bend * bend) / weights;
        assert!((covariance - 1.0084).abs() < 2e-3, "{covariance}");
    }
}
