//! The best optimum that can be found, and what else explains the scan.

use crate::config::Config;
use crate::error::Error;
use crate::hypotheses::second_minimum::{DECISIVE, RunnerUp, Twin, misfit, other_offset, twin_of};
use crate::input::observations::Observations;
use crate::problem::parameters::Parameters;
use crate::solve::refine::{Fit, Terms, refine};
use crate::solve::start;
use trueline_dataset::Guess;

/// The optimum, and what else explains the scan.
pub struct Found {
    /// The optimum.
    pub fit: Fit,
    /// A mirrored attitude fits equally well, and no guess tells which is right.
    pub equal_twin: bool,
    /// The runner-up of the time offset.
    pub runner_up: Option<RunnerUp>,
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
pub fn find(observations: &Observations, terms: &Terms<'_>, guess: Option<&Guess>) -> Result<Found, Error> {
    match guess {
        Some(guess) => from_guess(observations, terms, guess),
        None => from_nothing(observations, terms),
    }
}

/// A guess is not overruled; something much better than where it leads is a reason against the result.
fn from_guess(observations: &Observations, terms: &Terms<'_>, guess: &Guess) -> Result<Found, Error> {
    let fit = refine(observations, terms, start::from_guess(observations, guess)?)?;
    let runner_up = other_offset(observations, terms, &fit).map(|(_, runner_up)| runner_up);
    let from_guess =
        |at: &Parameters| at.tool_from_camera.rotation.angle_to(&guess.tool_from_camera.rotation);
    let (mut better, mut equal_twin) = (None, false);
    match twin_of(observations, terms, &fit)? {
        Twin::Worse => {}
        Twin::Equal(twin) => equal_twin = from_guess(fit.parameters()) > CLEARLY_NEARER * from_guess(&twin),
        Twin::Better(twin) => better = Some(twin.parameters().clone()),
    }
    // Where something is held, the search from nothing would look elsewhere.
    if better.is_none() && terms.fixed.is_empty() && is_doubtful(observations, &fit) {
        let other = search(observations, terms)?.0;
        better = is_better(observations, terms, &other, &fit).then(|| other.parameters().clone());
    }
    Ok(Found { fit, equal_twin, runner_up, better })
}

fn from_nothing(observations: &Observations, terms: &Terms<'_>) -> Result<Found, Error> {
    let (mut fit, mut equal_twin) = search(observations, terms)?;
    let mut other = other_offset(observations, terms, &fit);
    if let Some((start, _)) = other.take_if(|(_, runner_up)| runner_up.log_likelihood_lost < 0.0) {
        fit = refine(observations, terms, start)?;
        other = other_offset(observations, terms, &fit);
    }
    if is_doubtful(observations, &fit) {
        let offset_search_s = widest_offset_s(observations).max(terms.config.offset_search_s);
        let config = Config { offset_search_s, ..terms.config.clone() };
        let (wide, wide_twin) = search(observations, &Terms { config: &config, ..*terms })?;
        if is_better(observations, terms, &wide, &fit) {
            (fit, equal_twin) = (wide, wide_twin);
            other = other_offset(observations, terms, &fit);
        }
    }
    Ok(Found { fit, equal_twin, runner_up: other.map(|(_, runner_up)| runner_up), better: None })
}

/// From nothing, the better of two mirrored attitudes; and whether both fit equally well.
fn search(observations: &Observations, terms: &Terms<'_>) -> Result<(Fit, bool), Error> {
    let start = start::from_nothing(observations, terms.config, &terms.noise)?;
    let fit = refine(observations, terms, start)?;
    Ok(match twin_of(observations, terms, &fit)? {
        Twin::Worse => (fit, false),
        Twin::Equal(_) => (fit, true),
        Twin::Better(twin) => (*twin, false),
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

fn is_better(observations: &Observations, terms: &Terms<'_>, one: &Fit, other: &Fit) -> bool {
    let misfit = |fit: &Fit| misfit(observations, terms, fit.parameters());
    misfit(one) + DECISIVE < misfit(other)
}
