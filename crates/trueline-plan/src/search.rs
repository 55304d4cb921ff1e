//! Covariance matrix adaptation evolution strategy, the usual tool for some twenty unknowns without a gradient:
//! \[Hansen2016\], with the parameters of its Table 1.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// How long to search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Values that may be asked for.
    pub evaluations: usize,
    /// First spread of the samples.
    pub spread: f64,
    /// Samples of a generation: more look further about.
    pub population: usize,
}

/// The best point that was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// Where.
    pub point: DVector<f64>,
    /// Its value.
    pub value: f64,
}

/// The strategy's constants for a number of unknowns.
struct Constants {
    weights: Vec<f64>,
    mass: f64,
    c_sigma: f64,
    d_sigma: f64,
    c_c: f64,
    c_1: f64,
    c_mu: f64,
    /// Mean length of a vector of standard normal numbers.
    chi: f64,
}

impl Constants {
    fn new(unknowns: usize, population: usize) -> Self {
        let n = unknowns as f64;
        let parents = population / 2;
        let middle = 0.5 * (population as f64 + 1.0);
        let raw: Vec<f64> = (0..parents).map(|k| middle.ln() - ((k + 1) as f64).ln()).collect();
        let total: f64 = raw.iter().sum();
        let weights: Vec<f64> = raw.iter().map(|w| w / total).collect();
        let mass = 1.0 / weights.iter().map(|w| w * w).sum::<f64>();
        let c_sigma = (mass + 2.0) / (n + mass + 5.0);
        let c_1 = 2.0 / ((n + 1.3).powi(2) + mass);
        Self {
            mass,
            c_sigma,
            d_sigma: 1.0 + 2.0 * (((mass - 1.0) / (n + 1.0)).sqrt() - 1.0).max(0.0) + c_sigma,
            c_c: (4.0 + mass / n) / (n + 4.0 + 2.0 * mass / n),
            c_1,
            c_mu: (1.0 - c_1).min(2.0 * (mass - 2.0 + 1.0 / mass) / ((n + 2.0).powi(2) + mass)),
            chi: n.sqrt() * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n)),
            weights,
        }
    }
}

/// Generations for which the covariance's axes are used.
const DECOMPOSED_EVERY: usize = 3;

/// Minimises `value` from `start`. The same seed takes the same way.
pub fn minimise(
    start: &DVector<f64>,
    effort: Effort,
    seed: u64,
    mut value: impl FnMut(&DVector<f64>) -> f64,
) -> Found {
    let n = start.len();
    let constants = Constants::new(n, effort.population);
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut best = Found { point: start.clone(), value: value(start) };
    let mut mean = start.clone();
    let mut sigma = effort.spread;
    let mut covariance = DMatrix::<f64>::identity(n, n);
    let (mut path_sigma, mut path_c) = (DVector::zeros(n), DVector::zeros(n));
    let generations = effort.evaluations / effort.population;
    let mut eigen = SymmetricEigen { eigenvectors: covariance.clone(), eigenvalues: DVector::repeat(n, 1.0) };
    for generation in 0..generations {
        // It changes little from one generation to the next.
        if generation % DECOMPOSED_EVERY == 0 {
            match SymmetricEigen::try_new(covariance.clone(), f64::EPSILON, 1000) {
                Some(decomposed) => eigen = decomposed,
                None => break,
            }
        }
        let scales = eigen.eigenvalues.map(|x| x.max(1e-20).sqrt());
        let mut samples: Vec<(f64, DVector<f64>)> = (0..effort.population)
            .map(|_| {
                let normal = DVector::from_fn(n, |k, _| {
                    let z: f64 = StandardNormal.sample(&mut random);
                    z * scales[k]
                });
                let step = &eigen.eigenvectors * normal;
                let point = &mean + &step * sigma;
                let found = value(&point);
                if found < best.value {
                    best = Found { point, value: found };
                }
                (found, step)
            })
            .collect();
        samples.sort_by(|a, b| a.0.total_cmp(&b.0));
        let Constants { weights, mass, c_sigma, d_sigma, c_c, c_1, c_mu, chi, .. } = &constants;
        let step: DVector<f64> = weights.iter().zip(&samples).map(|(w, (_, y))| y * *w).sum();
        mean += &step * sigma;
        let whitened = &eigen.eigenvectors * (eigen.eigenvectors.transpose() * &step).component_div(&scales);
        path_sigma = path_sigma * (1.0 - c_sigma) + whitened * (c_sigma * (2.0 - c_sigma) * mass).sqrt();
        let expected = (1.0 - (1.0 - c_sigma).powi(2 * (generation as i32 + 1))).sqrt();
        let settled = path_sigma.norm() / expected < (1.4 + 2.0 / (n as f64 + 1.0)) * chi;
        let follow = if settled { (c_c * (2.0 - c_c) * mass).sqrt() } else { 0.0 };
        path_c = path_c * (1.0 - c_c) + step * follow;
        let missing = if settled { 0.0 } else { c_1 * c_c * (2.0 - c_c) };
        covariance *= 1.0 - c_1 - c_mu + missing;
        covariance.ger(*c_1, &path_c, &path_c, 1.0);
        for (weight, (_, y)) in weights.iter().zip(&samples) {
            covariance.ger(c_mu * weight, y, y, 1.0);
        }
        sigma *= ((c_sigma / d_sigma) * (path_sigma.norm() / chi - 1.0)).exp();
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bent_valley_is_followed_to_its_end() {
        // Rosenbrock's function in eight unknowns: minimum 0 at (1, …, 1).
        let rosenbrock = |x: &DVector<f64>| {
            x.as_slice().windows(2).map(|w| 100.0 * (w[1] - w[0] * w[0]).powi(2) + (1.0 - w[0]).powi(2)).sum()
        };
        let effort = Effort { evaluations: 20_000, spread: 0.5, population: 10 };
        let found = minimise(&DVector::zeros(8), effort, 1, rosenbrock);
        assert!(found.value < 1e-9, "{}", found.value);
        assert!(found.point.iter().all(|x| (x - 1.0).abs() < 1e-4), "{}", found.point);
    }
}
