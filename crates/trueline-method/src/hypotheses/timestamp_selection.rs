//! Selects the stamps if they do not show it themselves: those recorded, or those of the underlying clock. The fit decides.

use crate::assess::residuals::OUTLIER_SQUARED;
use crate::config::Stamps;
use crate::error::Error;
use crate::hypotheses::likelihood_ratio::{LIKELIHOOD_RATIO_LIMIT, noise_advantage};
use crate::input::noise_levels::NoiseLevels;
use crate::input::observations::{Observation, Observations};
use crate::input::timestamps::{Dejittered, Sampling};
use crate::problem::line_problem::LineProblem;
use crate::solve::fit::Fit;
use crate::solve::noise_scale::noise_factor;
use crate::solve::settings::FitSettings;
use crate::solve::solver::Solver;
use trueline_dataset::Recording;
use trueline_lsq::Loss;

/// A fit, its observations, and the treatment of their stamps.
pub(crate) struct Stamped {
    /// Observations with the selected stamps.
    pub observations: Observations,
    /// The fit to them.
    pub fit: Fit,
    /// Streams that use clock stamps.
    pub dejittered: Dejittered,
}

/// Also solves with the clocks' stamps, and keeps the better solution.
///
/// # Errors
/// Those of [`Solver::refit`].
pub(crate) fn with_best_stamps(
    recording: &Recording,
    sampling: &Sampling,
    settings: &FitSettings<'_>,
    first: Stamped,
) -> Result<Stamped, Error> {
    let _stage = tracing::debug_span!("time_stamps").entered();
    let mut best = first;
    for dejittered in sampling.candidates(settings.config) {
        if is_no_better_in_stretches(recording, sampling, settings, &best, dejittered)? {
            continue;
        }
        let noise_before = noise_in_sheet(&best, &settings.noise);
        let Stamped { observations, fit, dejittered: before } = best;
        // Only one robot path at a time is kept in memory. That of a long scan is most of the memory.
        let config = settings.config;
        let observations = observations.restamped(recording, sampling, config, [before, dejittered])?;
        let solver = Solver {
            observations: &observations,
            settings: with_stamp_noise(settings, sampling, dejittered),
        };
        let tried_fit = solver.refit(&fit)?;
        let tried = Stamped { observations, fit: tried_fit, dejittered };
        let noise = noise_in_sheet(&tried, &settings.noise);
        let is_better = config.stamps == Stamps::Regular
            || noise_advantage(tried.fit.placed.len(), noise, noise_before) > LIKELIHOOD_RATIO_LIMIT;
        best = if is_better {
            tried
        } else {
            let treatments = [dejittered, before];
            let observations = tried.observations.restamped(recording, sampling, config, treatments)?;
            Stamped { observations, fit, dejittered: before }
        };
    }
    Ok(best)
}

/// With more observations than this, stretches of the scan are tested first, if the robot's path would have to be rebuilt …
const MOST: usize = 48_000;
/// … in this number of stretches …
const STRETCHES: usize = 20;
/// … of this number of observations each, which is long compared with the correlation of neighbours.
const STRETCH: usize = 1_200;
/// Threshold in standard deviations, from the spread of the stretches, at which they reject a treatment. A treatment that is not worse is rejected
/// once in several hundred scans, and then both are equally good.
const AGAINST: f64 = 3.0;

/// Whether stretches of a long scan clearly show no advantage of clock stamps for the robot. Otherwise the whole scan is tested.
fn is_no_better_in_stretches(
    recording: &Recording,
    sampling: &Sampling,
    settings: &FitSettings<'_>,
    best: &Stamped,
    dejittered: Dejittered,
) -> Result<bool, Error> {
    let all = best.fit.placed.of(&best.observations);
    if settings.config.stamps == Stamps::Regular
        || dejittered.robot == best.dejittered.robot
        || all.len() <= MOST
    {
        return Ok(false);
    }
    let first = |k: usize| (all.len() - STRETCH) * k / (STRETCHES - 1);
    let list: Vec<Observation> =
        (0..STRETCHES).flat_map(|k| &all[first(k)..first(k) + STRETCH]).copied().collect();
    let about_s: Vec<f64> = list.iter().map(|o| o.stamp_s - best.fit.parameters().time_offset_s).collect();
    let robot = &best.observations.robot;
    let Some(trajectory) = robot.about(recording, sampling.robot_times_s(dejittered), &about_s) else {
        return Ok(false);
    };
    let some = Observations { list, ..best.observations.without_list() };
    let mut tried = some.clone();
    tried.robot.trajectory = trajectory;
    tried.take_image_times(sampling, dejittered);
    let squared = |observations: &Observations, dejittered: Dejittered| -> Result<Vec<f64>, Error> {
        let fit = Solver { observations, settings: with_stamp_noise(settings, sampling, dejittered) }
            .refit(&best.fit)?;
        let (noise, at) = (&settings.noise, fit.parameters());
        let problem =
            LineProblem::coarse(observations, &observations.list, Loss::Squared, noise, at.unknowns());
        Ok(problem.squared_residual_of_each(at))
    };
    let (of_best, of_tried) = (squared(&some, best.dejittered)?, squared(&tried, dejittered)?);
    Ok(speaks_against(&of_best, &of_tried, all.len()))
}

/// Whether the squared residuals of stretches reject the second explanation, for a number of observations.
fn speaks_against(of_best: &[f64], of_tried: &[f64], observations: usize) -> bool {
    let known: Vec<f64> = of_best.iter().copied().filter(|squared| !squared.is_nan()).collect();
    let variance = noise_factor(&known).powi(2);
    let gain = |(best, tried): (&f64, &f64)| {
        let ordinary = *best <= OUTLIER_SQUARED * variance && *tried <= OUTLIER_SQUARED * variance;
        if ordinary { (best - tried) / variance } else { 0.0 }
    };
    let gains: Vec<f64> = of_best
        .chunks(STRETCH)
        .zip(of_tried.chunks(STRETCH))
        .map(|(best, tried)| best.iter().zip(tried).map(gain).sum())
        .collect();
    let count = gains.len() as f64;
    let mean = gains.iter().sum::<f64>() / count;
    let spread = gains.iter().map(|gain| (gain - mean).powi(2)).sum::<f64>() / (count - 1.0);
    let of_all = observations as f64 / (STRETCH as f64 * count);
    (mean * count + AGAINST * (spread * count).sqrt()) * of_all < LIKELIHOOD_RATIO_LIMIT
}

fn with_stamp_noise<'a>(
    settings: &FitSettings<'a>,
    sampling: &Sampling,
    dejittered: Dejittered,
) -> FitSettings<'a> {
    let stamp_sigma_s = sampling.stamp_sigma_s(settings.config, dejittered);
    FitSettings { noise: NoiseLevels { stamp_sigma_s, ..settings.noise }, ..*settings }
}

/// Ratio of the actual noise to the assumed noise, from the residuals in the sheet alone.
fn noise_in_sheet(stamped: &Stamped, noise: &NoiseLevels) -> f64 {
    let Stamped { observations, fit, .. } = stamped;
    let at = fit.parameters();
    let problem =
        LineProblem::coarse(observations, fit.placed.of(observations), Loss::Squared, noise, at.unknowns());
    noise_factor(&problem.squared_residuals(at))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Squared residuals of two components, with a ratio between the explanations.
    fn squares(times: f64, phase: f64) -> Vec<f64> {
        let square = |k: usize| -2.0 * (1.0 - (k as f64 * 0.618_033_988_75 + phase).fract() * 0.999).ln();
        (0..STRETCHES * STRETCH).map(|k| square(k) * times).collect()
    }

    #[test]
    fn stretches_speak_against_what_leaves_more_and_not_against_what_may_be_better() {
        let all = 15 * STRETCHES * STRETCH;
        let best = squares(1.0, 0.0);
        assert!(speaks_against(&best, &squares(1.01, 0.0), all));
        assert!(!speaks_against(&best, &squares(0.99, 0.0), all));
        // If the explanations differ only by chance, this number of observations could favour either.
        let other: Vec<f64> =
            best.iter().enumerate().map(|(k, s)| s * (1.0 + 0.2 * (k as f64 * 1.7).sin())).collect();
        assert!(!speaks_against(&best, &other, all));
    }
}
