//! Covariance matrix adaptation evolution strategy, the usual tool for some twenty unknowns without a gradient:
//! \[Hansen2016\], with the parameters of its Table 1.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// The best point that was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// The point.
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

/// A search that can be resumed.
pub struct Minimiser {
    constants: Constants,
    random: ChaCha8Rng,
    population: usize,
    generation: usize,
    mean: DVector<f64>,
    sigma: f64,
    covariance: DMatrix<f64>,
    eigen: SymmetricEigen<f64, nalgebra::Dyn>,
    path_sigma: DVector<f64>,
    path_c: DVector<f64>,
    best: Option<Found>,
}

impl Minimiser {
    /// A search about a point, with a spread of the first samples and a number of them in a generation: more samples search
    /// further away. The same seed takes the same way.
    #[must_use]
    pub fn about(start: &DVector<f64>, spread: f64, population: usize, seed: u64) -> Self {
        let n = start.len();
        let covariance = DMatrix::<f64>::identity(n, n);
        Self {
            constants: Constants::new(n, population),
            random: ChaCha8Rng::seed_from_u64(seed),
            population,
            generation: 0,
            mean: start.clone(),
            sigma: spread,
            eigen: SymmetricEigen { eigenvectors: covariance.clone(), eigenvalues: DVector::repeat(n, 1.0) },
            covariance,
            path_sigma: DVector::zeros(n),
            path_c: DVector::zeros(n),
            best: None,
        }
    }

    /// The best point so far; `None` before anything was tried.
    #[must_use]
    pub fn best(&self) -> Option<&Found> {
        self.best.as_ref()
    }

    /// Makes `value` smaller with this many evaluations.
    pub fn run(&mut self, evaluations: usize, mut value: impl FnMut(&DVector<f64>) -> f64) {
        if self.best.is_none() {
            self.best = Some(Found { point: self.mean.clone(), value: value(&self.mean) });
        }
        for _ in 0..evaluations / self.population {
            // The axes change little from one generation to the next.
            if self.generation.is_multiple_of(DECOMPOSED_EVERY) {
                match SymmetricEigen::try_new(self.covariance.clone(), f64::EPSILON, 1000) {
                    Some(decomposed) => self.eigen = decomposed,
                    None => return,
                }
            }
            let scales = self.eigen.eigenvalues.map(|x| x.max(1e-20).sqrt());
            let samples = self.samples(&scales, &mut value);
            self.adapt(&scales, &samples);
            self.generation += 1;
        }
    }

    /// A generation: values and steps from the mean, best first.
    fn samples(
        &mut self,
        scales: &DVector<f64>,
        value: &mut impl FnMut(&DVector<f64>) -> f64,
    ) -> Vec<(f64, DVector<f64>)> {
        let mut samples = Vec::with_capacity(self.population);
        for _ in 0..self.population {
            let normal = DVector::from_fn(scales.len(), |k, _| {
                let z: f64 = StandardNormal.sample(&mut self.random);
                z * scales[k]
            });
            let step = &self.eigen.eigenvectors * normal;
            let point = &self.mean + &step * self.sigma;
            let found = value(&point);
            if self.best.as_ref().is_none_or(|best| found < best.value) {
                self.best = Some(Found { point, value: found });
            }
            samples.push((found, step));
        }
        samples.sort_by(|a, b| a.0.total_cmp(&b.0));
        samples
    }

    fn adapt(&mut self, scales: &DVector<f64>, samples: &[(f64, DVector<f64>)]) {
        let Constants { weights, mass, c_sigma, d_sigma, c_c, c_1, c_mu, chi } = &self.constants;
        let n = scales.len() as f64;
        let step: DVector<f64> = weights.iter().zip(samples).map(|(w, (_, y))| y * *w).sum();
        self.mean += &step * self.sigma;
        let axes = &self.eigen.eigenvectors;
        let whitened = axes * (axes.transpose() * &step).component_div(scales);
        self.path_sigma *= 1.0 - c_sigma;
        self.path_sigma += whitened * (c_sigma * (2.0 - c_sigma) * mass).sqrt();
        let expected = (1.0 - (1.0 - c_sigma).powi(2 * (self.generation as i32 + 1))).sqrt();
        let settled = self.path_sigma.norm() / expected < (1.4 + 2.0 / (n + 1.0)) * chi;
        let follow = if settled { (c_c * (2.0 - c_c) * mass).sqrt() } else { 0.0 };
        self.path_c *= 1.0 - c_c;
        self.path_c += step * follow;
        let missing = if settled { 0.0 } else { c_1 * c_c * (2.0 - c_c) };
        self.covariance *= 1.0 - c_1 - c_mu + missing;
        self.covariance.ger(*c_1, &self.path_c, &self.path_c, 1.0);
        for (weight, (_, y)) in weights.iter().zip(samples) {
            self.covariance.ger(c_mu * weight, y, y, 1.0);
        }
        self.sigma *= ((c_sigma / d_sigma) * (self.path_sigma.norm() / chi - 1.0)).exp();
    }
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
        let mut search = Minimiser::about(&DVector::zeros(8), 0.5, 10, 1);
        search.run(10_000, rosenbrock);
        let half_way = search.best().map_or(f64::INFINITY, |found| found.value);
        search.run(10_000, rosenbrock);
        let Some(found) = search.best() else { unreachable!("values were requested") };
        assert!(found.value <= half_way);
        assert!(found.value < 1e-9, "{}", found.value);
        assert!(found.point.iter().all(|x| (x - 1.0).abs() < 1e-4), "{}", found.point);
    }
}
