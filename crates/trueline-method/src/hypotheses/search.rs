//! The best optimum that can be found, and what else explains the scan.

use crate::config::Config;
use crate::error::Error;
use crate::hypotheses::second_minimum::{
    LIKELIHOOD_RATIO_LIMIT, MirrorComparison, SecondMinimum, mirror_of, other_offset,
    twice_negative_log_likelihood,
};
use crate::input::observations::Observations;
use crate::problem::parameters::Parameters;
use crate::solve::refine::{Fit, FitSettings, refine};
use crate::solve::start;
use trueline_dataset::Guess;

/// The optimum, and what else explains the scan.
pub struct Found {
    /// The optimum.
    pub fit: Fit,
    /// A mirrored attitude fits equally well, and no guess tells which is right.
    pub equal_twin: bool,
    /// The runner-up of the time offset.
    pub runner_up: Option<SecondMinimum>,
    /// A better one, where the guess led elsewhere.
    pub better: Option<Parameters>,
}

/// Residuals this much larger than expected, or so many features out of reach, make a solution doubtful: it is then
/// looked for further afield.
const DOUBTFUL_FACTOR: f64 = 1.2;
/// See [`DOUBTFUL_FACTOR`].
const DOUBTFUL_UNPLACED: f64 = 0.1;
/// All offsets are then tried for which this part of the images falls into the robot's recording.
const OVERLAP: f64 = 0.5;
/// A guess chooses between two mirrored attitudes if it is this much nearer to one of them.
const CLEARLY_NEARER: f64 = 0.5;

/// Finds the optimum from a guess, or from nothing.
///
/// # Errors
/// [`Error::NoStart`] if there is none.
pub fn find(
    observations: &Observations,
    settings: &FitSettings<'_>,
    guess: Option<&Guess>,
) -> Result<Found, Error> {
    match guess {
        Some(guess) => from_guess(observations, settings, guess),
        None => from_nothing(observations, settings),
    }
}

/// A guess is not overruled; something much better than where it leads is a reason against the result.
fn from_guess(
    observations: &Observations,
    settings: &FitSettings<'_>,
    guess: &Guess,
) -> Result<Found, Error> {
    let fit = refine(observations, settings, start::from_guess(observations, guess)?)?;
    let runner_up = other_offset(observations, settings, &fit).map(|(_, runner_up)| runner_up);
    let from_guess =
        |at: &Parameters| at.tool_from_camera.rotation.angle_to(&guess.tool_from_camera.rotation);
    let (mut better, mut equal_twin) = (None, false);
    match mirror_of(observations, settings, &fit)? {
        MirrorComparison::Worse => {}
        MirrorComparison::Equal(twin) => {
            equal_twin = from_guess(fit.parameters()) > CLEARLY_NEARER * from_guess(&twin)
        }
        MirrorComparison::Better(twin) => better = Some(twin.parameters().clone()),
    }
    // Where something is held, the search from nothing would look elsewhere.
    if better.is_none() && settings.fixed.is_empty() && is_doubtful(observations, &fit) {
        let other = search(observations, settings)?.0;
        better = is_better(observations, settings, &other, &fit).then(|| other.parameters().clone());
    }
    Ok(Found { fit, equal_twin, runner_up, better })
}

fn from_nothing(observations: &Observations, settings: &FitSettings<'_>) -> Result<Found, Error> {
    let (mut fit, mut equal_twin) = search(observations, settings)?;
    let mut other = other_offset(observations, settings, &fit);
    if let Some((start, _)) = other.take_if(|(_, runner_up)| runner_up.log_likelihood_lost < 0.0) {
        fit = refine(observations, settings, start)?;
        other = other_offset(observations, settings, &fit);
    }
    if is_doubtful(observations, &fit) {
        let offset_search_s = widest_offset_s(observations).max(settings.config.offset_search_s);
        let config = Config { offset_search_s, ..settings.config.clone() };
        let (wide, wide_twin) = search(observations, &FitSettings { config: &config, ..*settings })?;
        if is_better(observations, settings, &wide, &fit) {
            (fit, equal_twin) = (wide, wide_twin);
            other = other_offset(observations, settings, &fit);
        }
    }
    Ok(Found { fit, equal_twin, runner_up: other.map(|(_, runner_up)| runner_up), better: None })
}

/// From nothing, the better of two mirrored attitudes; and whether both fit equally well.
fn search(observations: &Observations, settings: &FitSettings<'_>) -> Result<(Fit, bool), Error> {
    let start = start::from_nothing(observations, settings.config, &settings.noise)?;
    let fit = refine(observations, settings, start)?;
    Ok(match mirror_of(observations, settings, &fit)? {
        MirrorComparison::Worse => (fit, false),
        MirrorComparison::Equal(_) => (fit, true),
        MirrorComparison::Better(twin) => (*twin, false),
    })
}

/// The largest offset, of either sign, that leaves half of the images within the robot's recording.
fn widest_offset_s(observations: &Observations) -> f64 {
    let (robot_start, robot_end) = observations.robot.trajectory.span();
    let stamps = || observations.list.iter().map(|o| o.stamp_s);
    let (start, end) = (stamps().fold(f64::INFINITY, f64::min), stamps().fold(f64::NEG_INFINITY, f64::max));
    let kept = OVERLAP * (end - start).min(robot_end - robot_start);
    // Images that late, or that early.
    (end - kept - robot_start).abs().max((robot_end - start - kept).abs())
}

fn is_doubtful(observations: &Observations, fit: &Fit) -> bool {
    let all = observations.list.len() as f64;
    fit.noise.factor > DOUBTFUL_FACTOR || fit.placed.len() as f64 <= (1.0 - DOUBTFUL_UNPLACED) * all
}

fn is_better(observations: &Observations, settings: &FitSettings<'_>, one: &Fit, other: &Fit) -> bool {
    let twice_negative_log_likelihood =
        |fit: &Fit| twice_negative_log_likelihood(observations, settings, fit.parameters());
    twice_negative_log_likelihood(one) + LIKELIHOOD_RATIO_LIMIT < twice_negative_log_likelihood(other)
}
