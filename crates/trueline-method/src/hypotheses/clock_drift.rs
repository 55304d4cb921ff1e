//! Tests whether one time offset holds for the whole scan. A drift is removed from the stamps, and a clock step is detected.
//!
//! Both leave residuals that are not noise and thereby inflate their own uncertainty. A hypothesis is therefore tested by its remainder: it is
//! removed, the scan is refitted, and its size is compared with the standard deviation from the clean residuals.

use crate::assess::observability::RANK_THRESHOLD;
use crate::error::Error;
use crate::hypotheses::drift_and_step::{ClockCheck, Drift, Step};
use crate::input::observations::Observations;
use crate::problem::parameters::TIME_OFFSET;
use crate::solve::covariance;
use crate::solve::fit::Fit;
use crate::solve::settings::FitSettings;
use crate::solve::solver::Solver;

/// A fit whose time offset does not drift.
pub struct DriftFree {
    /// The observations, with a drift removed from their stamps.
    pub observations: Observations,
    /// The fit.
    pub fit: Fit,
    /// Estimated clock drift, even if not significant.
    pub drift: Option<Drift>,
    /// The drift that was removed.
    pub drifted: Option<Drift>,
    /// The most likely clock step.
    pub step: Option<Step>,
    /// A significant clock step. It is not removed.
    pub stepped: Option<Step>,
    /// Noise factor without that step.
    pub noise_factor_without_step: Option<f64>,
}

/// Threshold for a drift, which is a single hypothesis.
const DRIFT_SIGMAS: f64 = 5.0;
/// Threshold for a step. Among several thousand possible steps the largest reaches 4 σ by chance, and the variance is known to some 20 %.
const STEP_SIGMAS: f64 = 7.0;
/// Rounds of removal. Each removes the remainder of the previous linear estimate.
const ROUNDS: usize = 5;

/// Whether a drift is significant.
#[must_use]
pub(crate) fn is_significant(drift: &Drift) -> bool {
    drift.ppm.abs() > DRIFT_SIGMAS * drift.sigma_ppm
}

/// Removes a significant drift of the image clock from the stamps, unless a step explains the scan better.
///
/// `rate_sigma_ppm` is the standard deviation of the stamp clocks' rates. A drift within it is not significant.
///
/// # Errors
/// Those of [`Solver::converge`].
pub(crate) fn remove_drift(
    observations: Observations,
    fit: Fit,
    settings: &FitSettings<'_>,
    rate_sigma_ppm: f64,
) -> Result<DriftFree, Error> {
    let _stage = tracing::debug_span!("clock_drift").entered();
    let solver = Solver { observations: &observations, settings: *settings };
    let clock = clock_check(&solver, &fit);
    let drift = clock.as_ref().and_then(ClockCheck::drift);
    let step = clock.as_ref().and_then(ClockCheck::step);
    let likely_drift = drift.is_some_and(|d| d.ppm.abs() > DRIFT_SIGMAS * d.sigma_ppm / inflation(&clock));
    let likely_step = step.is_some_and(|s| s.step_s.abs() > STEP_SIGMAS * s.sigma_s / inflation(&clock));
    let without_drift = if likely_drift { drift_out(&solver, &fit, rate_sigma_ppm)? } else { None };
    let without_step = if likely_step { step_out(&solver, &fit, rate_sigma_ppm)? } else { None };
    let stepped = without_step.filter(|step| {
        without_drift
            .as_ref()
            .is_none_or(|drift| step.twice_negative_log_likelihood < drift.twice_negative_log_likelihood)
    });
    let drift = drift.map(|d| Drift { sigma_ppm: d.sigma_ppm.hypot(rate_sigma_ppm), ..d });
    let (observations, fit, drifted) = match without_drift.filter(|_| stepped.is_none()) {
        Some(without) => (without.observations, without.fit, Some(without.drift)),
        None => (observations, fit, None),
    };
    let fit = Solver { observations: &observations, settings: *settings }.converge(&fit)?;
    Ok(DriftFree {
        observations,
        fit,
        drift: drifted.or(drift),
        drifted,
        step,
        noise_factor_without_step: stepped.as_ref().map(|s| s.noise_factor),
        stepped: stepped.map(|s| s.step),
    })
}

/// Ratio of a check's standard deviations to those from noise alone.
fn inflation(clock: &Option<ClockCheck>) -> f64 {
    clock.as_ref().map_or(1.0, ClockCheck::inflation)
}

fn clock_check(solver: &Solver<'_>, fit: &Fit) -> Option<ClockCheck> {
    let Solver { observations, settings } = solver;
    if settings.fixed.contains(&TIME_OFFSET) {
        return None;
    }
    let information = fit.information(settings.fixed, RANK_THRESHOLD)?;
    let problem = fit.problem(observations, settings.config);
    let covariance = information.covariance();
    let real = covariance::assess(&problem, fit.parameters(), &fit.noise, &information).covariance;
    let variance = (real[(0, 0)] / covariance[(0, 0)]).max(1.0);
    let root = information.covariance_root();
    variance.is_finite().then(|| ClockCheck::new(&problem, fit.parameters(), root, variance))
}

struct WithoutDrift {
    observations: Observations,
    fit: Fit,
    drift: Drift,
    twice_negative_log_likelihood: f64,
}

/// The scan without its drift, if the remaining residuals confirm the drift.
fn drift_out(solver: &Solver<'_>, fit: &Fit, rate_sigma_ppm: f64) -> Result<Option<WithoutDrift>, Error> {
    let (mut observations, mut fit) = (solver.observations.clone(), fit.clone());
    // Rates multiply. For a rate error of a fifth, the sum of the rounds would be off by two per cent.
    let mut kept = 1.0;
    let mut left = clock_check(&solver.on(&observations), &fit).and_then(|clock| clock.drift());
    for _ in 0..ROUNDS {
        let Some(found) = left.filter(|d| d.ppm.abs() > 0.1 * d.sigma_ppm) else { break };
        kept *= 1.0 - found.ppm * 1e-6;
        for o in &mut observations.list {
            // The stamps run fast relative to the middle, where they are correct.
            o.stamp_s -= found.ppm * 1e-6 * (o.stamp_s - found.about_s);
        }
        fit = solver.on(&observations).refit(&fit)?;
        left = clock_check(&solver.on(&observations), &fit).and_then(|clock| clock.drift());
    }
    let drift = left.map(|left| Drift {
        ppm: (1.0 / (kept * (1.0 - left.ppm * 1e-6)) - 1.0) * 1e6,
        sigma_ppm: left.sigma_ppm.hypot(rate_sigma_ppm),
        ..left
    });
    Ok(drift.filter(is_significant).map(|drift| {
        let twice_negative_log_likelihood =
            solver.on(&observations).twice_negative_log_likelihood(fit.parameters());
        WithoutDrift { observations, fit, drift, twice_negative_log_likelihood }
    }))
}

struct WithoutStep {
    step: Step,
    noise_factor: f64,
    twice_negative_log_likelihood: f64,
}

/// The step whose removal is confirmed by the residuals.
fn step_out(solver: &Solver<'_>, fit: &Fit, rate_sigma_ppm: f64) -> Result<Option<WithoutStep>, Error> {
    let (mut observations, mut fit) = (solver.observations.clone(), fit.clone());
    let lasts_s = observations.list.last().map_or(0.0, |o| o.stamp_s)
        - observations.list.first().map_or(0.0, |o| o.stamp_s);
    let mut total: Option<Step> = None;
    // The first frame after the step. Frames keep their number when their stamps change.
    let mut first_frame = 0;
    for _ in 0..ROUNDS {
        let Some(clock) = clock_check(&solver.on(&observations), &fit) else { return Ok(None) };
        let frame_at = |frame: u32| observations.list.iter().find(|o| o.frame >= frame).map(|o| o.stamp_s);
        let found = match total {
            None => clock.step(),
            Some(_) => frame_at(first_frame).and_then(|at_s| clock.step_at(at_s)),
        };
        let Some(found) = found else { return Ok(None) };
        if total.is_none() {
            first_frame = observations.list.iter().find(|o| o.stamp_s >= found.at_s).map_or(0, |o| o.frame);
        }
        total = Some(Step {
            at_s: total.map_or(found.at_s, |t| t.at_s),
            step_s: found.step_s + total.map_or(0.0, |t| t.step_s),
            // A rate error looks like a step of half its effect over the scan.
            sigma_s: found.sigma_s.hypot(0.5 * lasts_s * rate_sigma_ppm * 1e-6),
        });
        if found.step_s.abs() < 0.1 * found.sigma_s {
            break;
        }
        for o in observations.list.iter_mut().filter(|o| o.frame >= first_frame) {
            o.stamp_s -= found.step_s;
        }
        fit = solver.on(&observations).refit(&fit)?;
    }
    Ok(total.filter(|step| step.step_s.abs() > STEP_SIGMAS * step.sigma_s).map(|step| WithoutStep {
        step,
        noise_factor: fit.noise.factor,
        twice_negative_log_likelihood: solver
            .on(&observations)
            .twice_negative_log_likelihood(fit.parameters()),
    }))
}
