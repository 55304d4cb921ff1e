//! The recipe: a recording in, a calibration out.

use crate::alternatives::{RunnerUp, against_twin, other_offset};
use crate::calibration::{Calibration, Status};
use crate::clock_check::{ClockCheck, Drift};
use crate::config::{Config, Hold};
use crate::error::Error;
use crate::held_out::{self, Subject};
use crate::noise_levels::NoiseLevels;
use crate::observability::{self, Group, Observability, RANK_THRESHOLD};
use crate::observations::{Observations, observe, origin_ns};
use crate::parameters::{LINES, ROTATION, TIME_OFFSET, TRANSLATION};
use crate::prior::Prior;
use crate::refine::{Fit, Terms, again, polish, refine};
use crate::residuals;
use crate::restamp::{Stamped, with_best_stamps};
use crate::sampling::{Regularised, Sampling};
use crate::uncertainty::{self, Uncertainty};
use crate::verdict::{self, Evidence};
use crate::{at_torch, disruption, initial};
use nalgebra::SVector;
use trueline_dataset::unit::MM_PER_M;
use trueline_dataset::{Guess, Recording};
use trueline_lsq::Information;

/// Estimates time offset, hand-eye transform and lines from a recording.
///
/// `guess` is where to start; without it the start is found from nothing.
///
/// # Errors
/// [`Error`] if there is no estimate at all. A doubtful one is a [`Calibration`] that is not accepted.
pub fn calibrate(
    recording: &Recording,
    guess: Option<&Guess>,
    config: &Config,
) -> Result<Calibration, Error> {
    let sampling = Sampling::of(recording, origin_ns(recording));
    let observations = observe(recording, &sampling, config)?;
    check_overlap(&observations, config)?;
    let fixed = held_components(config, guess)?;
    let noise = NoiseLevels {
        robot_sigma_m: config.robot_sigma_m.unwrap_or(observations.robot.noise_m),
        stamp_sigma_s: sampling.stamp_sigma_s(config, Regularised::default()),
        factor: 1.0,
    };
    let terms = Terms { config, noise, fixed: &fixed, prior: None };
    let found = find(&observations, &terms, guess)?;
    let recorded = Stamped { observations, fit: found.fit, regularised: Regularised::default() };
    let stamped = with_best_stamps(recording, &sampling, &terms, recorded)?;
    let noise =
        NoiseLevels { stamp_sigma_s: sampling.stamp_sigma_s(config, stamped.regularised), ..terms.noise };
    let terms = Terms { noise, ..terms };
    let steady = without_drift(stamped.observations, stamped.fit, &terms)?;
    let (fit, observability) = show(&steady, &terms, guess, found.equal_twin)?;
    conclude(&Concluded {
        recording,
        sampling: &sampling,
        regularised: stamped.regularised,
        terms: &terms,
        equal_twin: found.equal_twin,
        runner_up: found.runner_up,
        steady: &Steady { fit, ..steady },
        observability,
    })
}

/// The optimum, and what else explains the scan.
struct Found {
    fit: Fit,
    equal_twin: bool,
    runner_up: Option<RunnerUp>,
}

fn find(observations: &Observations, terms: &Terms<'_>, guess: Option<&Guess>) -> Result<Found, Error> {
    if let Some(guess) = guess {
        let fit = refine(observations, terms, initial::from_guess(observations, guess)?)?;
        // A guess is not overruled; a much better offset is a reason against the result.
        let runner_up = other_offset(observations, terms, &fit).map(|(_, runner_up)| runner_up);
        return Ok(Found { fit, equal_twin: false, runner_up });
    }
    let start = initial::from_nothing(observations, terms.config, &terms.noise)?;
    let fit = refine(observations, terms, start)?;
    let (fit, equal_twin) = against_twin(observations, terms, fit)?;
    match other_offset(observations, terms, &fit) {
        Some((other, runner_up)) if runner_up.log_likelihood_lost < 0.0 => {
            let better = refine(observations, terms, other)?;
            let runner_up = other_offset(observations, terms, &better).map(|(_, runner_up)| runner_up);
            Ok(Found { fit: better, equal_twin, runner_up })
        }
        other => Ok(Found { fit, equal_twin, runner_up: other.map(|(_, runner_up)| runner_up) }),
    }
}

/// A fit whose time offset does not drift.
struct Steady {
    observations: Observations,
    fit: Fit,
    clock: Option<ClockCheck>,
    drift: Option<Drift>,
}

/// Rounds of taking a drift out; a second one is for what the first left.
const DRIFT_ROUNDS: usize = 4;

/// Takes a significant drift of the image clock out of the stamps.
fn without_drift(mut observations: Observations, mut fit: Fit, terms: &Terms<'_>) -> Result<Steady, Error> {
    let mut total_ppm = 0.0;
    let mut clock = clock_check(&observations, &fit, terms);
    let mut drift = clock.as_ref().and_then(ClockCheck::drift);
    for _ in 0..DRIFT_ROUNDS {
        let Some(found) = drift.filter(verdict::is_significant) else { break };
        let step = clock.as_ref().and_then(ClockCheck::step);
        if step.is_some_and(|step| verdict::is_real_step(&step, Some(&found))) {
            break;
        }
        total_ppm += found.ppm;
        for o in &mut observations.list {
            // The stamps run fast about the middle, where they are right.
            o.stamp_s -= found.ppm * 1e-6 * (o.stamp_s - found.about_s);
        }
        fit = again(&observations, terms, &fit)?;
        clock = clock_check(&observations, &fit, terms);
        drift = clock.as_ref().and_then(ClockCheck::drift);
    }
    let drift = drift.map(|left| Drift { ppm: left.ppm + total_ppm, ..left });
    let fit = polish(&observations, terms, &fit)?;
    let clock = clock_check(&observations, &fit, terms);
    Ok(Steady { observations, fit, clock, drift })
}

fn clock_check(observations: &Observations, fit: &Fit, terms: &Terms<'_>) -> Option<ClockCheck> {
    if terms.fixed.contains(&TIME_OFFSET) {
        return None;
    }
    let information = Information::new(&fit.solution.equations.hessian, terms.fixed, RANK_THRESHOLD)?;
    let problem = fit.problem(observations, terms.config);
    let covariance = information.covariance();
    let real = uncertainty::assess(&problem, fit.parameters(), &fit.noise, &information).covariance;
    let variance = (real[(0, 0)] / covariance[(0, 0)]).max(1.0);
    variance.is_finite().then(|| ClockCheck::new(&problem, fit.parameters(), covariance, variance))
}

/// What can be seen; and, where the user accepts it, a fit that holds the rest at the guess.
fn show(
    steady: &Steady,
    terms: &Terms<'_>,
    guess: Option<&Guess>,
    equal_twin: bool,
) -> Result<(Fit, Observability), Error> {
    let fit = steady.fit.clone();
    let information = Information::new(&fit.solution.equations.hessian, terms.fixed, RANK_THRESHOLD)
        .ok_or(Error::NoStart)?;
    let held = terms.fixed.contains(&TIME_OFFSET);
    let problem = fit.problem(&steady.observations, terms.config);
    let signal = if held { 1.0 } else { problem.time_offset_signal(fit.parameters()) };
    let mut observability = observability::assess(&information, fit.parameters(), signal);
    if equal_twin {
        observability.seen_components[ROTATION..TRANSLATION].fill(false);
    }
    if observability.unseen.is_empty() || !terms.config.accept_partial {
        return Ok((fit, observability));
    }
    let prior = unseen_at(&observability, guess.ok_or(Error::NoGuessToHold)?);
    let terms = Terms { prior: Some(&prior), ..*terms };
    Ok((polish(&steady.observations, &terms, &fit)?, observability))
}

/// Holds every unseen direction of offset and hand-eye at the guess; the lines follow.
fn unseen_at(observability: &Observability, guess: &Guess) -> Prior {
    let mut prior = Prior::at(guess);
    for unseen in &observability.unseen {
        match (unseen.group, unseen.direction) {
            (Group::TimeOffset, _) => prior.hold_time_offset(),
            (Group::Rotation, Some(direction)) => prior.hold_rotation(&direction),
            (Group::Translation, Some(direction)) => prior.hold_translation(&direction),
            _ => {}
        }
    }
    prior
}

/// All that a calibration is concluded from.
struct Concluded<'a> {
    recording: &'a Recording,
    sampling: &'a Sampling,
    regularised: Regularised,
    terms: &'a Terms<'a>,
    equal_twin: bool,
    runner_up: Option<RunnerUp>,
    steady: &'a Steady,
    observability: Observability,
}

fn conclude(from: &Concluded<'_>) -> Result<Calibration, Error> {
    let (config, fit, observations) = (from.terms.config, &from.steady.fit, &from.steady.observations);
    let parameters = fit.parameters().clone();
    let problem = fit.problem(observations, config);
    let information = Information::new(&fit.solution.equations.hessian, from.terms.fixed, RANK_THRESHOLD)
        .ok_or(Error::NoStart)?;
    let mut uncertainty = uncertainty::assess(&problem, &parameters, &fit.noise, &information);
    let held_out = held_out::check(&subject(from, &information, &uncertainty), config);
    uncertainty.covariance[(TIME_OFFSET, TIME_OFFSET)] +=
        from.sampling.phase_sigma_s(from.regularised).powi(2);
    let (features, skipped) = residuals::evaluate(&problem, &parameters);
    let summary = residuals::summarise(&features, skipped);
    let disruptions =
        disruption::find(observations, &features, &parameters, &fit.noise, config.offset_search_s);
    let held_at_guess = fit.prior.is_some();
    let all_seen = held_at_guess || from.observability.seen_components[..LINES].iter().all(|seen| *seen);
    let stamp_of = |f: &residuals::FeatureResidual| from.recording.features[f.row as usize].stamp_ns;
    let mut calibration = Calibration {
        status: Status::NotAccepted,
        reasons: Vec::new(),
        warnings: Vec::new(),
        estimated: (0..parameters.dimension()).map(|k| !from.terms.fixed.contains(&k)).collect(),
        observability: from.observability.clone(),
        residuals: summary,
        feature_stamps_ns: features.iter().map(stamp_of).collect(),
        features,
        noise_factor: fit.noise.factor,
        covariance_model_share: uncertainty.model_share,
        termination: fit.solution.termination,
        iterations: fit.iterations.clone(),
        held_at_guess,
        runner_up: from.runner_up,
        held_out,
        at_torch: all_seen
            .then(|| {
                at_torch::predict(
                    observations,
                    &fit.list,
                    &parameters,
                    &uncertainty.covariance,
                    &config.used_at,
                )
            })
            .flatten(),
        drift: from.steady.drift,
        step: from.steady.clock.as_ref().and_then(ClockCheck::step),
        disruptions,
        robot_stamps: from.sampling.robot.report(from.regularised.robot),
        image_stamps: from.sampling.images.report(from.regularised.images),
        robot_noise_m: observations.robot.recorded_noise_m,
        robot_smoothed: observations.robot.smoothed,
        sheet_fit_rms_m: observations.sheet_fit_rms_m,
        inputs: from.recording.inputs.clone(),
        config: config.clone(),
        covariance: uncertainty.covariance,
        parameters,
    };
    judge(&mut calibration, from.equal_twin, from.recording.features.len());
    Ok(calibration)
}

fn subject<'a>(from: &'a Concluded<'_>, information: &Information, real: &Uncertainty) -> Subject<'a> {
    let model = information.covariance();
    let inflation = |k: usize| {
        let ratio = real.covariance[(k, k)] / model[(k, k)];
        if ratio.is_finite() { ratio } else { 1.0 }
    };
    Subject {
        observations: &from.steady.observations,
        fit: &from.steady.fit,
        fixed: from.terms.fixed,
        rank_threshold: RANK_THRESHOLD,
        inflation: SVector::from_fn(|k, _| inflation(k)),
    }
}

fn judge(calibration: &mut Calibration, equal_twin: bool, features: usize) {
    let evidence = Evidence {
        observability: &calibration.observability,
        held: calibration.held_at_guess,
        equal_twin,
        runner_up: calibration.runner_up.as_ref(),
        time_offset_s: calibration.parameters.time_offset_s,
        termination: calibration.termination,
        noise_factor: calibration.noise_factor,
        residuals: &calibration.residuals,
        disruptions: &calibration.disruptions,
        step: calibration.step.as_ref(),
        drift: calibration.drift.as_ref(),
        require: &calibration.config.require,
        sigma: std::array::from_fn(|k| calibration.sigma(k)),
        held_out: calibration.held_out.as_ref(),
        stamps: [&calibration.robot_stamps, &calibration.image_stamps],
        features,
    };
    let reasons = verdict::reasons(&evidence);
    let mut warnings = verdict::warnings(&evidence);
    let seen =
        calibration.held_at_guess || calibration.observability.seen_components[..LINES].iter().all(|s| *s);
    if let (true, None, Some(wanted)) = (seen, &calibration.at_torch, calibration.config.used_at.stand_off_m)
    {
        warnings.push(format!(
            "no error at the torch is predicted: no point of the laser sheet below the scan is {:.0} mm from the sensor",
            wanted * MM_PER_M
        ));
    }
    calibration.status = if reasons.is_empty() { Status::Accepted } else { Status::NotAccepted };
    calibration.reasons = reasons;
    calibration.warnings = warnings;
}

fn check_overlap(observations: &Observations, config: &Config) -> Result<(), Error> {
    let (robot_start_s, robot_end_s) = observations.robot.trajectory.span();
    let stamps = || observations.list.iter().map(|o| o.stamp_s);
    let image_start_s = stamps().fold(f64::INFINITY, f64::min);
    let image_end_s = stamps().fold(f64::NEG_INFINITY, f64::max);
    let margin = config.offset_search_s;
    if image_start_s - margin > robot_end_s || image_end_s + margin < robot_start_s {
        return Err(Error::NoOverlap { robot_start_s, robot_end_s, image_start_s, image_end_s });
    }
    Ok(())
}

fn held_components(config: &Config, guess: Option<&Guess>) -> Result<Vec<usize>, Error> {
    let mut fixed = Vec::new();
    for hold in &config.hold {
        if guess.is_none() {
            return Err(Error::NothingToHold { held: hold.name() });
        }
        match hold {
            Hold::TimeOffset => fixed.push(TIME_OFFSET),
            Hold::HandEye => fixed.extend(ROTATION..LINES),
        }
    }
    Ok(fixed)
}
