//! Other explanations of the same scan: the mirrored attitude, and time offsets at which a repeating path
//! falls onto itself.

use crate::assess::residuals::OUTLIER_SQUARED;
use crate::error::Error;
use crate::input::observations::Observations;
use crate::problem::line_problem::{Criterion, LineProblem};
use crate::problem::parameters::{Parameters, TIME_OFFSET};
use crate::solve::refine::{Fit, FitSettings, refine};
use crate::solve::start;
use trueline_lsq::{LeastSquares, Loss};

/// Difference in twice the log likelihood below which data do not tell two solutions apart: 5 σ.
pub const LIKELIHOOD_RATIO_LIMIT: f64 = 25.0;

/// Twins nearer than this have met again in one solution.
const TWIN_TURN_RAD: f64 = 0.02;

/// Another valley of the time offset, and how it lost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SecondMinimum {
    /// Its bottom, s.
    pub time_offset_s: f64,
    /// Part of the features that it explains, to within 5 σ.
    pub explains: f64,
    /// The same of the best.
    pub best_explains: f64,
    /// Twice the log likelihood that it falls short of the best; negative if it is better.
    pub log_likelihood_lost: f64,
}

impl SecondMinimum {
    /// Whether it lost by more than chance can do.
    #[must_use]
    pub fn decided(&self) -> bool {
        self.log_likelihood_lost > LIKELIHOOD_RATIO_LIMIT
    }
}

/// Twice the log likelihood of residuals that are `factor` times the expected noise over ones of `other_factor`, for n
/// features of two numbers each: −2 log L = 2 n ln f².
#[must_use]
pub fn noise_advantage(features: usize, factor: f64, other_factor: f64) -> f64 {
    4.0 * features as f64 * (other_factor / factor).ln()
}

/// How the mirrored attitude compares with the one found.
pub enum MirrorComparison {
    /// It does not exist, is the same, or fits worse.
    Worse,
    /// It fits as well: the scan does not tell which is right.
    Equal(Parameters),
    /// It fits better.
    Better(Box<Fit>),
}

/// Follows the mirrored twin of a solution.
///
/// # Errors
/// As [`refine`].
pub fn mirror_of(
    observations: &Observations,
    settings: &FitSettings<'_>,
    fit: &Fit,
) -> Result<MirrorComparison, Error> {
    let Some(start) = start::twin(observations, fit.placed.of(observations), fit.parameters()) else {
        return Ok(MirrorComparison::Worse);
    };
    let twin = refine(observations, settings, start)?;
    let advantage = noise_advantage(fit.placed.len(), fit.noise.factor, twin.noise.factor);
    let rotation = |fit: &Fit| fit.parameters().tool_from_camera.rotation;
    let apart = rotation(&twin).angle_to(&rotation(fit));
    Ok(if apart <= TWIN_TURN_RAD {
        // It has fallen back into the same valley.
        MirrorComparison::Worse
    } else if advantage < -LIKELIHOOD_RATIO_LIMIT {
        MirrorComparison::Better(Box::new(twin))
    } else if advantage < LIKELIHOOD_RATIO_LIMIT {
        MirrorComparison::Equal(twin.parameters().clone())
    } else {
        MirrorComparison::Worse
    })
}

/// Twice the negative log likelihood of all features, those that are outliers or cannot be placed counting as such.
#[must_use]
pub fn twice_negative_log_likelihood(
    observations: &Observations,
    settings: &FitSettings<'_>,
    at: &Parameters,
) -> f64 {
    let criterion = Criterion { residual: settings.config.residual, loss: OUTLIERS };
    2.0 * LineProblem::new(observations, &observations.list, criterion, &settings.noise, at).cost(at)
}

/// A loss for which everything beyond 8 σ is an outlier.
const OUTLIERS: Loss = Loss::Tukey { scale: 8.0 };

/// The best fit at another time offset, and how it compares; `None` if there is no other valley.
///
/// Features that it cannot place (outside the recording, in a gap) count as unexplained.
#[must_use]
pub fn other_offset(
    observations: &Observations,
    settings: &FitSettings<'_>,
    fit: &Fit,
) -> Option<(Parameters, SecondMinimum)> {
    if settings.fixed.contains(&TIME_OFFSET) {
        return None;
    }
    let other = start::other_offset(observations, settings, fit.parameters())?;
    let criterion = Criterion { residual: settings.config.residual, loss: OUTLIERS };
    let problem = LineProblem::new(observations, &observations.list, criterion, &fit.noise, &fit.whitened_at);
    let explains = |at: &Parameters| {
        let squared = problem.squared_residuals(at);
        let good = squared.iter().filter(|s| **s <= OUTLIER_SQUARED).count();
        good as f64 / observations.list.len() as f64
    };
    let runner_up = SecondMinimum {
        time_offset_s: other.time_offset_s,
        explains: explains(&other),
        best_explains: explains(fit.parameters()),
        log_likelihood_lost: 2.0 * (problem.cost(&other) - problem.cost(fit.parameters())),
    };
    Some((other, runner_up))
}
