//! Observability of a scan; if the user accepts it, a fit with the unobservable rest held at a guess.

use crate::assess::excitation::{LEAST_TIME_OFFSET_SHARE, SplitSampleInformation};
use crate::assess::observability::{self, Group, Observability, RANK_THRESHOLD};
use crate::error::Error;
use crate::hypotheses::clock_drift::DriftFree;
use crate::hypotheses::search::Mirrored;
use crate::problem::parameters::{LINES, Parameters, ROTATION, TIME_OFFSET, TRANSLATION};
use crate::problem::prior::Prior;
use crate::solve::fit::Fit;
use crate::solve::placed_lines::lines_for;
use crate::solve::settings::FitSettings;
use crate::solve::solver::Solver;
use nalgebra::DVector;
use trueline_dataset::Guess;
use trueline_geometry::Trajectory;
use trueline_lsq::Information;

/// A fit with its information and observability.
pub(crate) struct Identifiability {
    /// The fit; unobservable directions are held if that was accepted.
    pub fit: Fit,
    /// The information from it.
    pub information: Information,
    /// Share of the time offset's information that comes from motion, if observable; else 1.
    pub time_offset_share: f64,
    /// Observability of the unknowns.
    pub observability: Observability,
}

/// Displacement along unobservable directions: the error of a typical guess.
const MOVED_S: f64 = 0.005;
/// See [`MOVED_S`].
const MOVED_RAD: f64 = 0.1;
/// See [`MOVED_S`].
const MOVED_M: f64 = 0.030;
/// A component that then moves by more standard deviations than this is unobservable.
const MOVED_SIGMAS: f64 = 2.0;
/// A component whose variance falls below this fraction when others are held depends on them.
const HELD_SHARE: f64 = 0.1;

/// Assesses observability. `halves` is the robot's path by every other sample. `guess` is the value at which the rest is held.
///
/// # Errors
/// [`Error::NoGuessToHold`] if the rest is to be held and there is no guess.
pub(crate) fn assess_identifiability(
    drift_free: &DriftFree,
    settings: &FitSettings<'_>,
    guess: Option<&Guess>,
    mirrored: Mirrored,
    halves: Option<&[Trajectory; 2]>,
) -> Result<Identifiability, Error> {
    let _stage = tracing::debug_span!("identifiability").entered();
    let fit = drift_free.fit.clone();
    let all = spectrum(&fit, settings)?;
    let signal = halves.map(|halves| {
        SplitSampleInformation::of(
            &fit.problem(&drift_free.observations, settings.config),
            fit.parameters(),
            halves,
        )
    });
    let information = signal.as_ref().map_or_else(|| all.clone(), |signal| signal.shown_by(&all));
    let time_offset_share = match &signal {
        Some(signal) if !settings.fixed.contains(&TIME_OFFSET) => signal.time_offset_share(&all),
        _ => 1.0,
    };
    let shows_time_offset = time_offset_share >= LEAST_TIME_OFFSET_SHARE;
    let time_offset_share = if shows_time_offset { time_offset_share } else { 1.0 };
    let mut observability = observability::assess(&information, &all, fit.parameters(), shows_time_offset);
    if mirrored == Mirrored::Equal {
        observability.observable_components[ROTATION..TRANSLATION].fill(false);
    }
    if observability.unobservable.is_empty() {
        return Ok(Identifiability { fit, information, time_offset_share, observability });
    }
    follow(drift_free, settings, &information, &mut observability);
    if !settings.config.accept_partial {
        return Ok(Identifiability { fit, information, time_offset_share, observability });
    }
    let prior = holding(&observability, guess.ok_or(Error::NoGuessToHold)?);
    let settings_held = FitSettings { prior: Some(&prior), ..*settings };
    let solver = Solver { observations: &drift_free.observations, settings: settings_held };
    let start = with_lines_of(&solver, &fit, prior.nearest_to(fit.parameters()))?;
    let held = solver.converge_from(&fit, start)?;
    let held_information = spectrum(&held, settings)?;
    let (before, after) = (information.covariance(), held_information.covariance());
    for k in 0..LINES {
        // A component that depends on held ones is unobservable.
        observability.observable_components[k] &= after[(k, k)] > HELD_SHARE * before[(k, k)];
    }
    Ok(Identifiability { fit: held, information: held_information, time_offset_share, observability })
}

fn spectrum(fit: &Fit, settings: &FitSettings<'_>) -> Result<Information, Error> {
    fit.information(settings.fixed, RANK_THRESHOLD).ok_or(Error::NoStart)
}

/// Displaces every unobservable direction and refits the rest. A component that follows is unobservable too, however small its variance at the
/// optimum is.
fn follow(
    drift_free: &DriftFree,
    settings: &FitSettings<'_>,
    information: &Information,
    observability: &mut Observability,
) {
    let at = drift_free.fit.parameters();
    let covariance = information.covariance();
    for sign in [1.0, -1.0] {
        let away = at.retract(&(unobservable_step(observability, at.dimension()) * sign));
        let guess = Guess { time_offset_s: away.time_offset_s, tool_from_camera: away.tool_from_camera };
        let prior = holding(observability, &guess);
        let settings = FitSettings { prior: Some(&prior), ..*settings };
        let solver = Solver { observations: &drift_free.observations, settings };
        let moved = with_lines_of(&solver, &drift_free.fit, away)
            .and_then(|start| solver.converge_from(&drift_free.fit, start))
            .map(|fit| fit.parameters().minus(&at.guess()));
        for k in 0..LINES {
            // A failed fit makes every component unobservable.
            observability.observable_components[k] &=
                moved.as_ref().is_ok_and(|m| m[k].abs() < MOVED_SIGMAS * covariance[(k, k)].sqrt());
        }
    }
}

/// The same clock and sensor with refitted lines. With the old lines a damped first step would spread over all unknowns, and every feature would
/// become an outlier.
fn with_lines_of(solver: &Solver<'_>, fit: &Fit, away: Parameters) -> Result<Parameters, Error> {
    let list = fit.placed.of(solver.observations);
    let lines = lines_for(solver.observations, list, &away.guess()).ok_or(Error::NoStart)?;
    Ok(Parameters { lines, curvatures: Vec::new(), ..away })
}

/// A step along every unobservable direction of time offset and hand-eye.
fn unobservable_step(observability: &Observability, dimension: usize) -> DVector<f64> {
    let mut step = DVector::zeros(dimension);
    for unobservable in &observability.unobservable {
        let (first, size) = match unobservable.group {
            Group::TimeOffset => {
                step[TIME_OFFSET] += MOVED_S;
                continue;
            }
            Group::Rotation => (ROTATION, MOVED_RAD),
            Group::Translation => (TRANSLATION, MOVED_M),
            Group::Line(_) => continue,
        };
        for direction in &unobservable.directions {
            (0..3).for_each(|k| step[first + k] += size * direction[k]);
        }
    }
    step
}

/// A prior that holds every unobservable direction of time offset and hand-eye at a guess. The lines are refitted.
fn holding(observability: &Observability, guess: &Guess) -> Prior {
    let mut prior = Prior::at(guess);
    for unobservable in &observability.unobservable {
        let directions = &unobservable.directions;
        match unobservable.group {
            Group::TimeOffset => prior.hold_time_offset(),
            Group::Rotation => directions.iter().for_each(|direction| prior.hold_rotation(direction)),
            Group::Translation => directions.iter().for_each(|direction| prior.hold_translation(direction)),
            Group::Line(_) => {}
        }
    }
    prior
}
