//! From a start to the optimum over all features.

use crate::assess::residuals::{self, FeatureResidual};
use crate::calibration::IterationRecord;
use crate::config::Config;
use crate::error::Error;
use crate::input::noise_levels::NoiseLevels;
use crate::input::observations::{Observation, Observations};
use crate::problem::line_problem::{Criterion, LineProblem};
use crate::problem::parameters::Parameters;
use crate::problem::prior::Prior;
use crate::problem::simd::{Scan, SquaredLengths, sweep};
use crate::problem::usable::UsableObservations;
use crate::solve::start;
use std::collections::HashSet;
use trueline_lsq::{Iteration, Loss, Solution, SolveOptions, solve};

/// What every solve of a calibration shares.
#[derive(Clone, Copy)]
pub struct FitSettings<'a> {
    /// The user's choices.
    pub config: &'a Config,
    /// Expected noise.
    pub noise: NoiseLevels,
    /// Components that are held where they start.
    pub fixed: &'a [usize],
    /// Directions that are held at a guess.
    pub prior: Option<&'a Prior>,
}

/// A solved problem and how it got there.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The observations that took part.
    pub placed: UsableObservations,
    /// The optimum.
    pub solution: Solution<Parameters>,
    /// The noise that is really there.
    pub noise: NoiseLevels,
    /// Where the residuals were whitened.
    pub whitened_at: Parameters,
    /// Directions that were held.
    pub prior: Option<Prior>,
    /// Every step on all features.
    pub iterations: Vec<IterationRecord>,
}

impl Fit {
    /// The problem whose solution this is.
    #[must_use]
    pub fn problem<'a>(&'a self, observations: &'a Observations, config: &Config) -> LineProblem<'a> {
        let criterion = Criterion { residual: config.residual, loss: config.final_loss() };
        LineProblem::new(
            observations,
            self.placed.of(observations),
            criterion,
            &self.noise,
            &self.whitened_at,
        )
        .with_prior(self.prior.clone())
        .with_threads(config.threads)
    }

    /// The parameters at the optimum.
    #[must_use]
    pub fn parameters(&self) -> &Parameters {
        &self.solution.state
    }
}

/// Most rounds of narrowing: from metres to micrometres at a third each.
const NARROWING_ROUNDS: usize = 12;
/// A guess of the time offset may be this far off while the narrowing begins, s.
const NARROWING_MARGIN_S: f64 = 0.050;
/// The last rounds hardly move the offset any more, s.
const FINAL_MARGIN_S: f64 = 10e-6;
/// A fit that is only compared, or started from, ends with a step below one σ: as steps shrink by far more
/// than ten, it is then within a tenth of its optimum.
const ROUGH: f64 = 1.0;
/// The reported one, σ.
const FINE: f64 = 1e-6;
/// Noise smaller than this part of what was expected is taken as that: a perfect simulation has none.
const LEAST_NOISE_FACTOR: f64 = 1e-3;

/// First a redescending loss as wide as the residuals are, narrowed while they shrink; then the final
/// loss, whitened for the noise that is really there.
///
/// # Errors
/// [`Error::NoStart`] if the cost is not finite.
pub fn refine(
    observations: &Observations,
    settings: &FitSettings<'_>,
    start: Parameters,
) -> Result<Fit, Error> {
    let mut rounds =
        Rounds { observations, settings, placed: UsableObservations::Part(0..0), iterations: Vec::new() };
    let mut state = start;
    let mut last_width = f64::INFINITY;
    for _ in 0..NARROWING_ROUNDS {
        // Three times the typical residual keeps the good ones and gives little weight to the wild ones.
        rounds.placed = UsableObservations::within(observations, state.time_offset_s, NARROWING_MARGIN_S);
        let list = rounds.placed.of(observations);
        let coarse = LineProblem::coarse(observations, list, Loss::Squared, &settings.noise);
        let width = 3.0 * residuals::noise_factor(&coarse.squared_residuals(&state)).max(1.0);
        if width > 0.5 * last_width || width <= 3.0 {
            break;
        }
        last_width = width;
        let options = SolveOptions { max_iterations: 10, cost_threshold: 1e-2, ..SolveOptions::default() };
        let loss = Loss::GemanMcClure { scale: width };
        state = rounds.round(loss, &settings.noise, state, &options)?.state;
    }
    rounds.finish(settings.noise, state, &[ROUGH, ROUGH])
}

/// The optimum again, from one that is near; its steps follow those that led there.
///
/// # Errors
/// As [`refine`].
pub fn refit(observations: &Observations, settings: &FitSettings<'_>, near: &Fit) -> Result<Fit, Error> {
    let iterations = near.iterations.clone();
    let rounds = Rounds { observations, settings, placed: UsableObservations::Part(0..0), iterations };
    rounds.finish(settings.noise, near.parameters().clone(), &[ROUGH])
}

/// The same to the last digit.
///
/// # Errors
/// As [`refine`].
pub fn converge(observations: &Observations, settings: &FitSettings<'_>, near: &Fit) -> Result<Fit, Error> {
    let iterations = near.iterations.clone();
    let rounds = Rounds { observations, settings, placed: UsableObservations::Part(0..0), iterations };
    rounds.finish(near.noise, near.parameters().clone(), &[FINE])
}

struct Rounds<'a> {
    observations: &'a Observations,
    settings: &'a FitSettings<'a>,
    placed: UsableObservations,
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
        let criterion = Criterion { residual: self.settings.config.residual, loss };
        let problem =
            LineProblem::new(self.observations, self.placed.of(self.observations), criterion, noise, &start)
                .with_prior(self.settings.prior.cloned())
                .with_threads(self.settings.config.threads);
        let solution = solve(&problem, start, self.settings.fixed, options).map_err(|_| Error::NoStart)?;
        self.iterations.extend(solution.iterations.iter().map(|step| record(self.observations, step)));
        Ok(solution)
    }

    /// The final loss to each threshold in turn; every round begins with the noise and the lines' anchors
    /// that the one before left.
    fn finish(
        mut self,
        expected: NoiseLevels,
        start: Parameters,
        step_thresholds: &[f64],
    ) -> Result<Fit, Error> {
        let loss = self.settings.config.final_loss();
        let (mut noise, mut whitened_at) = self.prepare(expected, start);
        let mut solution = Err(Error::NoStart);
        for &step_threshold in step_thresholds {
            if let Ok(Solution { state, .. }) = solution {
                (noise, whitened_at) = self.prepare(noise, state);
            }
            let options = SolveOptions { step_threshold, ..SolveOptions::default() };
            solution = Ok(self.round(loss, &noise, whitened_at.clone(), &options)?);
        }
        Ok(Fit {
            placed: self.placed,
            solution: solution?,
            noise,
            whitened_at,
            prior: self.settings.prior.cloned(),
            iterations: self.iterations,
        })
    }

    /// Selects what can be placed, measures the noise there, and moves the lines' anchors amid the points.
    fn prepare(&mut self, mut noise: NoiseLevels, state: Parameters) -> (NoiseLevels, Parameters) {
        self.placed = UsableObservations::within(self.observations, state.time_offset_s, FINAL_MARGIN_S);
        let list = self.placed.of(self.observations);
        let criterion =
            Criterion { residual: self.settings.config.residual, loss: self.settings.config.final_loss() };
        let problem = LineProblem::new(self.observations, list, criterion, &noise, &state);
        let larger = residuals::noise_factor(&problem.squared_residuals(&state));
        noise.factor = (noise.factor * larger).max(LEAST_NOISE_FACTOR);
        (noise, start::with_lines_amid_points(self.observations, state))
    }
}

/// The same steps with distances of those observations only that turned out to be no outliers: what is wild would hide how
/// the rest converges.
#[must_use]
pub fn without_outliers(
    mut steps: Vec<IterationRecord>,
    observations: &Observations,
    features: &[FeatureResidual],
) -> Vec<IterationRecord> {
    let wild: HashSet<u32> = features.iter().filter(|f| f.is_outlier()).map(|f| f.row).collect();
    if wild.is_empty() {
        return steps;
    }
    let list: Vec<Observation> =
        observations.list.iter().filter(|o| !wild.contains(&o.row)).copied().collect();
    for step in &mut steps {
        step.rms_m = rms_m(observations, &list, &step.parameters);
    }
    steps
}

/// Root mean square distance from the lines, m.
fn rms_m(observations: &Observations, list: &[Observation], at: &Parameters) -> f64 {
    let mut distances = SquaredLengths::default();
    sweep(&Scan { observations, list, at, residual: crate::ResidualKind::PointToLine }, &mut distances);
    distances.root_mean()
}

fn record(observations: &Observations, step: &Iteration<Parameters>) -> IterationRecord {
    IterationRecord {
        cost: step.cost,
        rms_m: rms_m(observations, &observations.list, &step.state),
        parameters: step.state.clone(),
        accepted: step.accepted,
    }
}
