//! The recipe: a recording in, a calibration out.

use crate::calibration::{Calibration, IterationRecord, StampSummary, Status};
use crate::config::{Config, Hold};
use crate::error::Error;
use crate::noise_levels::NoiseLevels;
use crate::observability::{self, Observability, RANK_THRESHOLD};
use crate::observations::{Observation, Observations, observe};
use crate::parameters::{LINES, Parameters, ROTATION, TIME_OFFSET, TRANSLATION};
use crate::problem::{Criterion, LineProblem, safely_placed};
use crate::residuals::{self, ResidualSummary};
use crate::{initial, uncertainty};
use trueline_dataset::{Guess, Recording};
use trueline_lsq::{Information, Iteration, Loss, Solution, SolveOptions, Termination, solve};

/// Estimates time offset, hand-eye transform and lines from a recording.
///
/// `initial` is where to start; without it the start is found from nothing.
///
/// # Errors
/// [`Error`] if there is no estimate at all. A doubtful one is a [`Calibration`] that is not accepted.
pub fn calibrate(
    recording: &Recording,
    initial: Option<&Guess>,
    config: &Config,
) -> Result<Calibration, Error> {
    let observations = observe(recording, config)?;
    check_overlap(&observations, config)?;
    let noise = NoiseLevels {
        robot_sigma_m: config.robot_sigma_m.unwrap_or(observations.trajectory_noise_m),
        stamp_sigma_s: config.stamp_sigma_s,
        factor: 1.0,
    };
    let start = match initial {
        Some(guess) => initial::from_guess(&observations, guess)?,
        None => initial::from_nothing(&observations, config, &noise)?,
    };
    let fixed = held_components(config, initial)?;
    let mut fit = refine(&observations, config, noise, &fixed, start)?;
    if initial.is_none() {
        fit = against_twin(fit, &observations, config, noise)?;
    }
    let problem = fit.problem(&observations, config);
    let information =
        Information::new(&fit.solution.equations.hessian, &fixed, RANK_THRESHOLD).ok_or(Error::NoStart)?;
    let parameters = fit.solution.state.clone();
    let uncertainty = uncertainty::assess(&problem, &parameters, &information);
    let held = fixed.contains(&TIME_OFFSET);
    let signal = if held { 1.0 } else { problem.time_offset_signal(&parameters) };
    let mut observability = observability::assess(&information, &parameters, signal);
    if fit.has_equal_twin {
        observability.seen_components[ROTATION..TRANSLATION].fill(false);
    }
    let (features, skipped) = residuals::evaluate(&problem, &parameters);
    let summary = residuals::summarise(&features, skipped);
    let reasons = reasons_against(&observability, &summary, &fit);
    Ok(Calibration {
        status: if reasons.is_empty() { Status::Accepted } else { Status::NotAccepted },
        warnings: warnings(&summary, &observations),
        reasons,
        covariance: uncertainty.covariance,
        estimated: (0..parameters.dimension()).map(|k| !fixed.contains(&k)).collect(),
        observability,
        residuals: summary,
        features,
        noise_factor: fit.noise.factor,
        covariance_model_share: uncertainty.model_share,
        termination: fit.solution.termination,
        iterations: fit.iterations,
        robot_stamps: StampSummary::of_trajectory(&observations.trajectory),
        image_stamps: StampSummary::of_images(&observations),
        robot_noise_m: observations.robot_noise_m,
        robot_smoothed: observations.robot_smoothed,
        sheet_fit_rms_m: observations.sheet_fit_rms_m,
        origin_ns: observations.origin_ns,
        inputs: recording.inputs.clone(),
        config: config.clone(),
        parameters,
    })
}

/// A solved problem and how it got there.
struct Fit {
    list: Vec<Observation>,
    solution: Solution<Parameters>,
    noise: NoiseLevels,
    whitened_at: Parameters,
    iterations: Vec<IterationRecord>,
    /// Whether the mirrored solution fits as well, so that the rotation found may be the wrong one.
    has_equal_twin: bool,
}

/// Difference in twice the log likelihood below which data do not tell two solutions apart: 5 σ.
const DECISIVE: f64 = 25.0;

/// Follows the mirrored twin of a solution found without a guess; takes it if it fits better.
fn against_twin(
    mut fit: Fit,
    observations: &Observations,
    config: &Config,
    noise: NoiseLevels,
) -> Result<Fit, Error> {
    let Some(start) = initial::twin(observations, &fit.list, &fit.solution.state) else { return Ok(fit) };
    let twin = refine(observations, config, noise, &[], start)?;
    // Two numbers for each feature; −2 log L = 2 n ln f² for noise f times as large as expected.
    let residuals = 2.0 * fit.list.len() as f64;
    let advantage = 2.0 * residuals * (twin.noise.factor / fit.noise.factor).ln();
    if advantage < -DECISIVE {
        return Ok(twin);
    }
    let apart =
        twin.solution.state.tool_from_camera.rotation.angle_to(&fit.solution.state.tool_from_camera.rotation);
    fit.has_equal_twin = advantage < DECISIVE && apart > TWIN_TURN_RAD;
    Ok(fit)
}

/// Twins nearer than this have met again in one solution.
const TWIN_TURN_RAD: f64 = 0.02;

impl Fit {
    /// The problem whose solution this is.
    fn problem<'a>(&self, observations: &'a Observations, config: &Config) -> LineProblem<'a> {
        let criterion = Criterion { residual: config.residual, loss: config.final_loss() };
        LineProblem::new(observations, &self.list, criterion, &self.noise, &self.whitened_at)
    }
}

/// Most rounds of narrowing: from metres to micrometres at a third each.
const NARROWING_ROUNDS: usize = 12;
/// A guess of the time offset may be this far off while the narrowing begins, s.
const NARROWING_MARGIN_S: f64 = 0.050;
/// The last rounds hardly move the offset any more, s.
const FINAL_MARGIN_S: f64 = 10e-6;
/// Noise smaller than this part of what was expected is taken as that: a perfect simulation has none.
const LEAST_NOISE_FACTOR: f64 = 1e-3;

/// From a start to the optimum over all features: first a redescending loss as wide as the residuals
/// are, narrowed while they shrink; then the final loss, whitened for the noise that is really there.
fn refine(
    observations: &Observations,
    config: &Config,
    noise: NoiseLevels,
    fixed: &[usize],
    start: Parameters,
) -> Result<Fit, Error> {
    let mut fit = Rounds { observations, config, fixed, list: Vec::new(), iterations: Vec::new() };
    let mut state = start;
    let mut last_width = f64::INFINITY;
    for _ in 0..NARROWING_ROUNDS {
        // Three times the typical residual keeps the good ones and gives little weight to the wild ones.
        fit.list = safely_placed(observations, state.time_offset_s, NARROWING_MARGIN_S);
        let coarse = LineProblem::coarse(observations, &fit.list, Loss::Squared, &noise);
        let width = 3.0 * residuals::noise_factor(&coarse.squared_residuals(&state)).max(1.0);
        if width > 0.5 * last_width || width <= 3.0 {
            break;
        }
        last_width = width;
        let options = SolveOptions { max_iterations: 10, cost_threshold: 1e-2, ..SolveOptions::default() };
        let loss = Loss::GemanMcClure { scale: width };
        state = fit.round(loss, &noise, state, &options)?.state;
    }
    fit.finish(noise, state)
}

struct Rounds<'a> {
    observations: &'a Observations,
    config: &'a Config,
    fixed: &'a [usize],
    list: Vec<Observation>,
    iterations: Vec<IterationRecord>,
}

impl Rounds<'_> {
    fn round(
        &mut self,
        loss: Loss,
        noise: &NoiseLevels,
        start: Parameters,
        options: &SolveOptions,
    ) -> Result<Solution<Parameters>, Error> {
        let criterion = Criterion { residual: self.config.residual, loss };
        let problem = LineProblem::new(self.observations, &self.list, criterion, noise, &start);
        let solution = solve(&problem, start, self.fixed, options).map_err(|_| Error::NoStart)?;
        self.iterations.extend(solution.iterations.iter().map(|step| record(self.observations, step)));
        Ok(solution)
    }

    /// The final loss; once to learn how large the noise is, once with it.
    fn finish(mut self, expected: NoiseLevels, start: Parameters) -> Result<Fit, Error> {
        let loss = self.config.final_loss();
        let criterion = Criterion { residual: self.config.residual, loss };
        let mut noise = expected;
        let mut state = start;
        // The first round only feeds the noise and the lines' anchors of the second.
        for (last, step_threshold) in [(false, 0.1), (true, 1e-6)] {
            self.list = safely_placed(self.observations, state.time_offset_s, FINAL_MARGIN_S);
            let options = SolveOptions { step_threshold, ..SolveOptions::default() };
            let problem = LineProblem::new(self.observations, &self.list, criterion, &noise, &state);
            let larger = residuals::noise_factor(&problem.squared_residuals(&state));
            noise.factor = (noise.factor * larger).max(LEAST_NOISE_FACTOR);
            state = initial::with_lines_amid_points(self.observations, state);
            let whitened_at = state.clone();
            let solution = self.round(loss, &noise, state, &options)?;
            state = solution.state.clone();
            if last {
                return Ok(Fit {
                    list: self.list,
                    has_equal_twin: false,
                    solution,
                    noise,
                    whitened_at,
                    iterations: self.iterations,
                });
            }
        }
        Err(Error::NoStart)
    }
}

fn record(observations: &Observations, step: &Iteration<Parameters>) -> IterationRecord {
    let criterion = Criterion { residual: crate::ResidualKind::PointToLine, loss: Loss::Squared };
    let unit = NoiseLevels { robot_sigma_m: 0.0, stamp_sigma_s: 0.0, factor: 1.0 };
    let problem = LineProblem::new(observations, &observations.list, criterion, &unit, &step.state);
    let squared = problem.squared_residuals(&step.state);
    let mean = squared.iter().sum::<f64>() / squared.len().max(1) as f64;
    IterationRecord {
        cost: step.cost,
        rms_m: mean.sqrt() * crate::problem::POINT_TO_LINE_SIGMA_M,
        parameters: step.state.clone(),
        accepted: step.accepted,
    }
}

fn check_overlap(observations: &Observations, config: &Config) -> Result<(), Error> {
    let (robot_start_s, robot_end_s) = observations.trajectory.span();
    let stamps = || observations.list.iter().map(|o| o.stamp_s);
    let image_start_s = stamps().fold(f64::INFINITY, f64::min);
    let image_end_s = stamps().fold(f64::NEG_INFINITY, f64::max);
    let margin = config.offset_search_s;
    if image_start_s - margin > robot_end_s || image_end_s + margin < robot_start_s {
        return Err(Error::NoOverlap { robot_start_s, robot_end_s, image_start_s, image_end_s });
    }
    Ok(())
}

fn held_components(config: &Config, initial: Option<&Guess>) -> Result<Vec<usize>, Error> {
    let mut fixed = Vec::new();
    for hold in &config.hold {
        if initial.is_none() {
            return Err(Error::NothingToHold { held: hold.name() });
        }
        match hold {
            Hold::TimeOffset => fixed.push(TIME_OFFSET),
            Hold::HandEye => fixed.extend(ROTATION..LINES),
        }
    }
    Ok(fixed)
}

/// Residuals this much larger than expected are not noise: something is wrong with the data or the frames.
const NOISE_FACTOR_LIMIT: f64 = 10.0;
/// With more outliers than this the majority no longer decides.
const OUTLIER_LIMIT: f64 = 0.5;

fn reasons_against(observability: &Observability, summary: &ResidualSummary, fit: &Fit) -> Vec<String> {
    let mut reasons: Vec<String> = observability.unseen.iter().map(|unseen| unseen.advice.clone()).collect();
    if fit.has_equal_twin {
        reasons.push(
            "two mirrored attitudes of the sensor fit equally well: tilt the torch by 10° or more, or give an \
             initial guess of the hand-eye transform"
                .to_owned(),
        );
    }
    let termination: Termination = fit.solution.termination;
    if !termination.is_converged() {
        reasons.push(format!("the solver did not converge ({termination})"));
    }
    if fit.noise.factor > NOISE_FACTOR_LIMIT {
        reasons.push(format!(
            "residuals are {:.0} times larger than noise explains: check units, frames and the laser plane",
            fit.noise.factor
        ));
    }
    let share = summary.outliers as f64 / summary.used.max(1) as f64;
    if share > OUTLIER_LIMIT {
        reasons.push(format!("{:.0} % of the features are outliers", 100.0 * share));
    }
    reasons
}

fn warnings(summary: &ResidualSummary, observations: &Observations) -> Vec<String> {
    let mut warnings = Vec::new();
    let skipped: usize = summary.skipped.values().sum();
    if skipped * 10 > observations.list.len() {
        warnings.push(format!("{skipped} features could not be used; see skipped"));
    }
    warnings
}
