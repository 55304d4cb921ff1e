//! Whether one solution explains a scan better than another: a paired test over frames.
//!
//! The residuals of a rival contain the robot's noise at other times than those of the best solution, so a difference of
//! likelihoods is chance with a spread of tens to a hundred. Paired frame by frame it has a spread of its own, which the
//! frames show. The loss is capped, because the residuals of a wrong rival are large and smooth in time: uncapped, they
//! would be the yardstick; and the variance allows for neighbouring frames that are alike \[Newey1987\].

use crate::assess::residuals::OUTLIER_SQUARED;
use crate::config::Config;
use crate::input::noise_levels::NoiseLevels;
use crate::input::observations::Observations;
use crate::problem::line_problem::{Criterion, LineProblem};
use crate::solve::fit::Fit;
use crate::solve::solver::REJECTING;

/// Beyond this z the sign of the difference is no chance: 5 σ. Scans of 20 s and more decide at z above 100; a few scans of
/// 5 s come near it (BENCHMARKS.md, "weaves").
pub const DECISIVE_Z: f64 = 5.0;

/// Fewer frames than this in common …
const LEAST_FRAMES: usize = 30;
/// … or a smaller part of all frames say nothing.
const LEAST_SHARE: f64 = 0.25;

/// How a rival compares with the best solution, over the frames that both can place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairedTest {
    /// Sum of the differences of capped losses, rival minus best, over its standard deviation.
    pub z: f64,
    /// Frames that both can place.
    pub frames: usize,
    /// Part of their features that the rival explains to within 5 σ.
    pub explains: f64,
    /// The same of the best.
    pub best_explains: f64,
}

impl PairedTest {
    /// Whether the best is better and that is no chance.
    #[must_use]
    pub fn decided(&self) -> bool {
        self.z > DECISIVE_Z
    }

    /// Whether the rival is better and that is no chance.
    #[must_use]
    pub fn reversed(&self) -> bool {
        self.z < -DECISIVE_Z
    }
}

/// Compares two solutions with the same unknowns; `None` where they share too few frames.
#[must_use]
pub fn compare(observations: &Observations, config: &Config, best: &Fit, rival: &Fit) -> Option<PairedTest> {
    let factor = best.noise.factor.min(rival.noise.factor);
    let [of_best, of_rival] = [best, rival].map(|fit| squared_residuals(observations, config, fit, factor));
    let (mut differences, mut last_frame) = (Vec::new(), None);
    let (mut features, mut explained) = (0_usize, [0_usize; 2]);
    let mut frames = 0;
    for ((o, best), rival) in observations.list.iter().zip(&of_best).zip(&of_rival) {
        if last_frame != Some(o.frame) {
            (last_frame, frames) = (Some(o.frame), frames + 1);
            differences.push(None);
        }
        if best.is_nan() || rival.is_nan() {
            continue;
        }
        features += 1;
        explained[0] += usize::from(*best <= OUTLIER_SQUARED);
        explained[1] += usize::from(*rival <= OUTLIER_SQUARED);
        if let Some(difference) = differences.last_mut() {
            *difference = Some(difference.unwrap_or(0.0) + REJECTING.value(*rival) - REJECTING.value(*best));
        }
    }
    let differences: Vec<f64> = differences.into_iter().flatten().collect();
    let common = differences.len();
    if common < LEAST_FRAMES || (common as f64) < LEAST_SHARE * f64::from(frames) {
        return None;
    }
    let [best_explains, explains] = explained.map(|count| count as f64 / features as f64);
    Some(PairedTest { z: z_of(&differences), frames: common, explains, best_explains })
}

/// Squared residuals of all observations, whitened where the solution is, for a noise factor; NaN where one cannot be
/// placed.
fn squared_residuals(observations: &Observations, config: &Config, fit: &Fit, factor: f64) -> Vec<f64> {
    let criterion = Criterion { residual: config.residual, loss: REJECTING };
    let noise = NoiseLevels { factor, ..fit.noise };
    LineProblem::new(observations, &observations.list, criterion, &noise, &fit.whitened_at)
        .squared_residual_of_each(fit.parameters())
}

/// Sum over its standard deviation, with Bartlett weights up to ⌈4 (n/100)^(2/9)⌉ lags \[Newey1987\]. Differences that do not
/// vary decide at once; if they are zero, the two are one solution.
fn z_of(differences: &[f64]) -> f64 {
    let n = differences.len() as f64;
    let sum: f64 = differences.iter().sum();
    let mean = sum / n;
    let lags = (4.0 * (n / 100.0).powf(2.0 / 9.0)).ceil() as usize;
    let covariance = |lag: usize| {
        let pairs = differences.iter().zip(&differences[lag..]);
        pairs.map(|(a, b)| (a - mean) * (b - mean)).sum::<f64>() / n
    };
    let weighted = (1..=lags).map(|lag| 2.0 * (1.0 - lag as f64 / (lags as f64 + 1.0)) * covariance(lag));
    let variance = covariance(0) + weighted.sum::<f64>();
    if variance > 0.0 {
        sum / (n * variance).sqrt()
    } else if sum == 0.0 {
        0.0
    } else {
        sum.signum() * f64::INFINITY
    }
}
