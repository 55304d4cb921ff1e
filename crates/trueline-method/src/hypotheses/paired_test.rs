//! Paired test over frames: whether one solution explains a scan better than another.
//!
//! The residuals of a rival contain the robot's noise at other times than those of the best solution. The difference of their likelihoods therefore
//! varies by tens to a hundred. Paired frame by frame, its spread can be estimated from the frames. The loss is capped, because the residuals of a
//! wrong rival are large and smooth in time and would otherwise dominate the spread. The variance includes the correlation of neighbouring frames
//! \[Newey1987\].
//!
//! In a short scan the capped differences take two values, zero and the cap. Their spread then hides that all caps favour one side. Frames that only
//! one of the two explains are therefore counted as well: gross errors do not agree with another solution.
//!
//! The prior of the sensor's shape and of the seam's bow counts as one more observation. A rival that bends the sensor to fit pays for it.

use crate::assess::residuals::OUTLIER_SQUARED;
use crate::config::Config;
use crate::input::noise_levels::NoiseLevels;
use crate::input::observations::Observations;
use crate::problem::line_problem::{Criterion, LineProblem};
use crate::solve::fit::Fit;
use crate::solve::solver::REJECTING;

/// |z| above which the sign of the difference is significant: 5 σ. Scans of 20 s and more reach z above 100. A few scans of 5 s come near the limit
/// (study `weaves`).
pub(crate) const DECISIVE_Z: f64 = 5.0;

/// The same for two solutions at one time offset, such as mirrored attitudes. They share the noise of each frame. If the other were right, z would
/// be as far below zero as it is above. The other is therefore rejected at 2 z, here 4 σ.
pub(crate) const DECISIVE_Z_AT_ONE_OFFSET: f64 = 2.0;

/// Time offsets nearer than this share most of the robot's noise, s.
pub(crate) const ONE_OFFSET_S: f64 = 1e-3;

/// z above which a solution that has not converged is rejected. Gross errors slow the last steps: with 40 % of them a solution may still be up to
/// 0.03 rad, and z = 3, away from its optimum.
const FAR_WORSE_Z: f64 = 10.0;

/// If one solution explains features that another does not, the other may explain one in this number of them.
const FEW: usize = 10;

/// Fewer common frames than this …
const LEAST_FRAMES: usize = 30;
/// … or a smaller fraction of all frames have no information.
const LEAST_COMMON: f64 = 0.25;

/// Comparison of a rival with the best solution, over the frames that both can place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairedTest {
    /// Sum of the differences of capped losses, rival minus best, over its standard deviation.
    pub z: f64,
    /// Threshold for z.
    pub decisive_z: f64,
    /// Frames that both can place.
    pub frames: usize,
    /// Fraction of their features that the rival explains within 5 σ.
    pub explains: f64,
    /// The same for the best.
    pub best_explains: f64,
    /// Number of features that only the best explains, and that only the rival explains.
    pub only: [usize; 2],
}

impl PairedTest {
    /// Whether the rival is so much worse that the last steps to its optimum do not matter.
    pub(crate) fn is_far_worse(&self) -> bool {
        self.z > FAR_WORSE_Z
    }

    /// Whether the best is significantly better.
    #[must_use]
    pub fn decided(&self) -> bool {
        self.z > self.decisive_z || outnumbers(self.only[0], self.only[1])
    }

    /// Whether the rival is significantly better.
    #[must_use]
    pub fn reversed(&self) -> bool {
        self.z < -self.decisive_z || outnumbers(self.only[1], self.only[0])
    }
}

/// Whether the number of features that only one solution explains exceeds chance. The 18 unknowns of the other can fit nine gross errors.
fn outnumbers(many: usize, few: usize) -> bool {
    many >= LEAST_FRAMES && few * FEW <= many
}

/// Compares two solutions with the same unknowns. `None` if they share too few frames.
#[must_use]
pub fn compare(observations: &Observations, config: &Config, best: &Fit, rival: &Fit) -> Option<PairedTest> {
    let factor = best.noise.factor.min(rival.noise.factor);
    let [of_best, of_rival] = [best, rival].map(|fit| squared_residuals(observations, config, fit, factor));
    let [cost_of_best, cost_of_rival] =
        [best, rival].map(|fit| 2.0 * fit.parameters().known(fit.shape_prior.as_ref()).cost());
    let apart_s = best.parameters().time_offset_s - rival.parameters().time_offset_s;
    let frames = observations.list.iter().zip(of_best).zip(of_rival);
    let frames = frames.map(|((o, best), rival)| (o.frame, best, rival));
    tested(frames, cost_of_rival - cost_of_best, apart_s)
}

/// The test from the squared residuals of both, by frame. NaN where a frame cannot be placed. `known_before` is the additional prior cost of the
/// rival, and `apart_s` is the difference of their time offsets.
pub(crate) fn tested(
    all: impl Iterator<Item = (u32, f64, f64)>,
    known_before: f64,
    apart_s: f64,
) -> Option<PairedTest> {
    let (mut differences, mut last_frame) = (Vec::new(), None);
    let (mut features, mut explained, mut only) = (0_usize, [0_usize; 2], [0_usize; 2]);
    let mut frames = 0;
    for (frame, best, rival) in all {
        if last_frame != Some(frame) {
            (last_frame, frames) = (Some(frame), frames + 1);
            differences.push(None);
        }
        if best.is_nan() || rival.is_nan() {
            continue;
        }
        features += 1;
        let by = [best <= OUTLIER_SQUARED, rival <= OUTLIER_SQUARED];
        for k in 0..2 {
            explained[k] += usize::from(by[k]);
            only[k] += usize::from(by[k] && !by[1 - k]);
        }
        if let Some(difference) = differences.last_mut() {
            *difference = Some(difference.unwrap_or(0.0) + REJECTING.value(rival) - REJECTING.value(best));
        }
    }
    let differences: Vec<f64> = differences.into_iter().flatten().collect();
    let common = differences.len();
    if common < LEAST_FRAMES || (common as f64) < LEAST_COMMON * f64::from(frames) {
        return None;
    }
    let [best_explains, explains] = explained.map(|count| count as f64 / features as f64);
    let z = z_of(&differences, known_before);
    let decisive_z = if apart_s.abs() < ONE_OFFSET_S { DECISIVE_Z_AT_ONE_OFFSET } else { DECISIVE_Z };
    Some(PairedTest { z, decisive_z, frames: common, explains, best_explains, only })
}

/// Squared residuals of all observations for a noise factor, whitened at the solution. NaN where an observation cannot be placed.
fn squared_residuals(observations: &Observations, config: &Config, fit: &Fit, factor: f64) -> Vec<f64> {
    let criterion = Criterion { residual: config.residual, loss: REJECTING };
    let noise = NoiseLevels { factor, ..fit.noise };
    LineProblem::new(observations, &observations.list, criterion, &noise, &fit.whitened_at)
        .squared_residual_of_each(fit.parameters())
}

/// Sum over its standard deviation, with Bartlett weights up to ⌈4 (n/100)^(2/9)⌉ lags \[Newey1987\]. Constant differences decide at once. If they
/// are zero, the solutions are identical.
///
/// `known_before` is the difference of the prior costs. If one solution misses an observation of unit noise by δ more than the other, the squares
/// differ by δ² ± 2δ. The square of 2δ is the variance of this difference.
fn z_of(differences: &[f64], known_before: f64) -> f64 {
    let n = differences.len() as f64;
    let of_frames: f64 = differences.iter().sum();
    let sum = of_frames + known_before;
    let mean = of_frames / n;
    let lags = (4.0 * (n / 100.0).powf(2.0 / 9.0)).ceil() as usize;
    let covariance = |lag: usize| {
        let pairs = differences.iter().zip(&differences[lag..]);
        pairs.map(|(a, b)| (a - mean) * (b - mean)).sum::<f64>() / n
    };
    let weighted = (1..=lags).map(|lag| 2.0 * (1.0 - lag as f64 / (lags as f64 + 1.0)) * covariance(lag));
    let variance = n * (covariance(0) + weighted.sum::<f64>()) + 4.0 * known_before.abs();
    if variance > 0.0 {
        sum / variance.sqrt()
    } else if sum == 0.0 {
        0.0
    } else {
        sum.signum() * f64::INFINITY
    }
}
