//! The best optimum that can be found, and what else explains the scan.

use crate::config::Config;
use crate::error::Error;
use crate::hypotheses::ambiguity::{Ambiguity, settle};
use crate::hypotheses::likelihood_ratio::LIKELIHOOD_RATIO_LIMIT;
use crate::hypotheses::mirror::{MirrorComparison, mirror_of};
use crate::hypotheses::rivals;
use crate::input::observations::Observations;
use crate::problem::parameters::Parameters;
use crate::solve::fit::Fit;
use crate::solve::settings::FitSettings;
use crate::solve::solver::Solver;
use crate::solve::start;
use trueline_dataset::Guess;

/// The optimum, and what else explains the scan.
pub struct Found {
    /// The optimum.
    pub fit: Fit,
    /// A mirrored attitude fits equally well, and no guess tells which is right.
    pub equal_twin: bool,
    /// What else explains the scan, and what decided.
    pub ambiguity: Ambiguity,
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
pub fn find(solver: &Solver<'_>, guess: Option<&Guess>) -> Result<Found, Error> {
    match guess {
        Some(guess) => from_guess(solver, guess),
        None => from_nothing(solver),
    }
}

/// A guess is not overruled; something much better than where it leads is a reason against the result.
fn from_guess(solver: &Solver<'_>, guess: &Guess) -> Result<Found, Error> {
    let fit = solver.fit(start::from_guess(solver.observations, guess)?)?;
    let rivals = rivals::find(solver, &fit);
    let from_guess =
        |at: &Parameters| at.tool_from_camera.rotation.angle_to(&guess.tool_from_camera.rotation);
    let (mut better, mut equal_twin) = (None, false);
    match mirror_of(solver, &fit)? {
        MirrorComparison::Worse => {}
        MirrorComparison::Equal(twin) => {
            equal_twin = from_guess(fit.parameters()) > CLEARLY_NEARER * from_guess(&twin)
        }
        MirrorComparison::Better(twin) => better = Some(twin.parameters().clone()),
    }
    // Where something is held, the search from nothing would look elsewhere.
    if better.is_none() && solver.settings.fixed.is_empty() && is_doubtful(solver.observations, &fit) {
        let other = search(solver)?.0;
        better = is_better(solver, &other, &fit).then(|| other.parameters().clone());
    }
    let (fit, ambiguity) = settle(solver, fit, rivals, true);
    Ok(Found { fit, equal_twin, ambiguity, better })
}

fn from_nothing(solver: &Solver<'_>) -> Result<Found, Error> {
    let (mut fit, mut equal_twin) = search(solver)?;
    let mut rivals = rivals::find(solver, &fit);
    if let Some(better) = rivals.iter().position(|rival| rival.is_named() && rival.test.reversed()) {
        fit = rivals.swap_remove(better).fit;
        rivals = rivals::find(solver, &fit);
    }
    if is_doubtful(solver.observations, &fit) {
        let settings = solver.settings;
        let offset_search_s = widest_offset_s(solver.observations).max(settings.config.offset_search_s);
        let config = Config { offset_search_s, ..settings.config.clone() };
        let wider = Solver { settings: FitSettings { config: &config, ..settings }, ..*solver };
        let (wide, wide_twin) = search(&wider)?;
        if is_better(solver, &wide, &fit) {
            (fit, equal_twin) = (wide, wide_twin);
            rivals = rivals::find(solver, &fit);
        }
    }
    let (fit, ambiguity) = settle(solver, fit, rivals, false);
    Ok(Found { fit, equal_twin, ambiguity, better: None })
}

/// From nothing, the better of two mirrored attitudes; and whether both fit equally well.
fn search(solver: &Solver<'_>) -> Result<(Fit, bool), Error> {
    let Solver { observations, settings } = solver;
    let fit = solver.fit(start::from_nothing(observations, settings.config, &settings.noise)?)?;
    Ok(match mirror_of(solver, &fit)? {
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

fn is_better(solver: &Solver<'_>, one: &Fit, other: &Fit) -> bool {
    let [one, other] = [one, other].map(|fit| solver.twice_negative_log_likelihood(fit.parameters()));
    one + LIKELIHOOD_RATIO_LIMIT < other
}
