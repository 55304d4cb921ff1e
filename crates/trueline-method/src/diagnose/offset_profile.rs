//! Fit quality at other time offsets, with everything else re-estimated at each of them.

use crate::calibration::Calibration;
use crate::error::Error;
use crate::input::noise_levels::NoiseLevels;
use crate::input::observations::{self, Observations, observe};
use crate::input::timestamps::Sampling;
use crate::order_statistics::median;
use crate::problem::line_problem::LineProblem;
use crate::problem::parameters::{Parameters, TIME_OFFSET};
use crate::problem::usable::UsableObservations;
use crate::thinning::stride;
use trueline_dataset::Recording;
use trueline_lsq::{Loss, SolveOptions, solve};

/// One offset of the profile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AtOffset {
    /// The time offset, s.
    pub time_offset_s: f64,
    /// Typical residual there in standard deviations (median), with all else at its optimum.
    pub typical_sigmas: f64,
}

/// Maximum number of observations used.
const MOST_OBSERVATIONS: usize = 300;
/// Number of offsets on each side near the optimum, and their step, s.
const NEAR: (usize, f64) = (12, 1e-3);
/// The same further away.
const FAR: (usize, f64) = (30, 0.04);
/// Fewer placed observations than this have no information on an offset.
const LEAST_PLACED: usize = 30;

/// The profile about a calibration, by rising offset. Each offset starts from its neighbour on the side of the optimum. The loss is linear beyond 3
/// σ, so that local minima do not trap it. There is no profile over a curve.
///
/// # Errors
/// Those of [`observe`].
pub fn around(recording: &Recording, calibration: &Calibration) -> Result<Vec<AtOffset>, Error> {
    if calibration.best_fit().lines.is_empty() {
        return Ok(Vec::new());
    }
    let sampling = Sampling::of(recording, observations::origin_ns(recording));
    let mut observations = observe(recording, &sampling, &calibration.findings.config)?;
    let stride = stride(observations.list.len(), MOST_OBSERVATIONS);
    observations.list = observations.list.into_iter().step_by(stride).collect();
    let noise = NoiseLevels { robot_sigma_m: observations.robot.noise_m, stamp_sigma_s: 0.0, factor: 1.0 };
    let best = calibration.best_fit().time_offset_s;
    let mut profile = Vec::new();
    for side in [-1.0, 1.0] {
        let mut at = calibration.best_fit().clone();
        for away_s in distances() {
            at.time_offset_s = best + side * away_s;
            if let Some((next, typical_sigmas)) = solved(&observations, &noise, &at) {
                profile.push(AtOffset { time_offset_s: at.time_offset_s, typical_sigmas });
                at = next;
            }
        }
    }
    profile.sort_by(|a, b| a.time_offset_s.total_cmp(&b.time_offset_s));
    profile.dedup_by(|a, b| a.time_offset_s == b.time_offset_s);
    Ok(profile)
}

/// Distances of the offsets from the optimum, s: dense near it, and up to both ends of the search.
fn distances() -> impl Iterator<Item = f64> {
    let near = (0..=NEAR.0).map(|k| k as f64 * NEAR.1);
    near.chain((1..=FAR.0).map(|k| k as f64 * FAR.1))
}

/// All else at its optimum with the offset held, and the typical residual there.
fn solved(observations: &Observations, noise: &NoiseLevels, at: &Parameters) -> Option<(Parameters, f64)> {
    let placed = UsableObservations::within(observations, at.time_offset_s, 0.0);
    if placed.len() < LEAST_PLACED {
        return None;
    }
    let list = placed.of(observations);
    let problem = LineProblem::coarse(observations, list, Loss::Huber { scale: 3.0 }, noise, at.unknowns());
    // One sensor shape for all offsets.
    let held: Vec<usize> = std::iter::once(TIME_OFFSET).chain(at.unknowns().shape()).collect();
    let options = SolveOptions { max_iterations: 12, cost_threshold: 1e-4, ..SolveOptions::default() };
    let solution = solve(&problem, at.clone(), &held, &options).ok()?;
    let squared = problem.squared_residuals(&solution.state);
    // Two components a feature: √(2 ln 2) is the median length for pure noise.
    let typical = median(squared.into_iter())? / (2.0 * std::f64::consts::LN_2);
    Some((solution.state, typical.sqrt()))
}
