//! From a start to the optimum over all features.

use crate::config::ResidualKind;
use crate::error::Error;
use crate::input::noise_levels::NoiseLevels;
use crate::problem::line_problem::{Criterion, LineProblem};
use crate::problem::parameters::Parameters;
use crate::problem::usable::UsableObservations;
use crate::solve::fit::Fit;
use crate::solve::line_anchors::with_lines_amid_points;
use crate::solve::noise_scale::noise_factor;
use crate::solve::seam_chart::{with_bows, with_shape};
use crate::solve::solver::Solver;
use trueline_lsq::{Iteration, Loss, Solution, SolveOptions, solve};

/// Maximum rounds of narrowing: from metres to micrometres at a third each.
const NARROWING_ROUNDS: usize = 12;
/// Possible error of the guessed time offset while the narrowing begins, s.
const NARROWING_MARGIN_S: f64 = 0.050;
/// The last rounds hardly change the time offset, s.
const FINAL_MARGIN_S: f64 = 10e-6;
/// Convergence threshold, σ, of a fit that is only compared or used as a start. Steps shrink by far more than a factor of ten, so the fit is then
/// within a tenth of σ of its optimum.
const ROUGH: f64 = 1.0;
/// Convergence threshold of the reported fit, σ. Steps shrink sixteenfold, because of the loss. A step of this length leaves a tenth of it.
const FINE: f64 = 1e-4;
/// Damping from a nearby start. The usual 1e-6 slows directions with a millionth of their unknowns' own information. This value hardly does.
const NEAR_DAMPING: f64 = 1e-8;
/// Least noise as a fraction of the expected noise: a perfect simulation has none.
const LEAST_NOISE_FACTOR: f64 = 1e-3;

impl Solver<'_> {
    /// The optimum from a start. A redescending loss as wide as the residuals is narrowed while they shrink. The final loss follows, whitened for
    /// the actual noise.
    ///
    /// # Errors
    /// [`Error::NoStart`] if the cost is not finite.
    pub fn fit(&self, start: Parameters) -> Result<Fit, Error> {
        let mut rounds = Rounds::after(*self, Vec::new());
        let noise = &self.settings.noise;
        let mut state = start;
        let mut last_width = f64::INFINITY;
        for _ in 0..NARROWING_ROUNDS {
            // Three times the typical residual keeps the inliers and gives little weight to outliers.
            rounds.placed =
                UsableObservations::within(self.observations, state.time_offset_s, NARROWING_MARGIN_S);
            let list = rounds.placed.of(self.observations);
            let coarse = LineProblem::coarse(self.observations, list, Loss::Squared, noise, state.unknowns());
            let width = 3.0 * noise_factor(&coarse.squared_residuals(&state)).max(1.0);
            if width > 0.5 * last_width || width <= 3.0 {
                break;
            }
            last_width = width;
            let options =
                SolveOptions { max_iterations: 10, cost_threshold: 1e-2, ..SolveOptions::default() };
            let loss = Loss::GemanMcClure { scale: width };
            state = rounds.round(loss, noise, state, &options)?.state;
        }
        rounds.finish(*noise, state, &[ROUGH, ROUGH])
    }

    /// Refines a nearby optimum. Its steps are appended to those of the earlier fit.
    ///
    /// # Errors
    /// Those of [`Solver::fit`].
    pub(crate) fn refit(&self, near: &Fit) -> Result<Fit, Error> {
        let rounds = Rounds::after(*self, near.iterations.clone());
        rounds.finish(self.settings.noise, near.parameters().clone(), &[ROUGH])
    }

    /// The same to full convergence.
    ///
    /// # Errors
    /// Those of [`Solver::fit`].
    pub(crate) fn converge(&self, near: &Fit) -> Result<Fit, Error> {
        self.converge_from(near, near.parameters().clone())
    }

    /// The same from a nearby start.
    ///
    /// # Errors
    /// Those of [`Solver::fit`].
    pub(crate) fn converge_from(&self, near: &Fit, start: Parameters) -> Result<Fit, Error> {
        let rounds = Rounds::after(*self, near.iterations.clone());
        rounds.finish(near.noise, start, &[FINE])
    }
}

/// Successive solves with their history.
struct Rounds<'a> {
    solver: Solver<'a>,
    placed: UsableObservations,
    iterations: Vec<Iteration<Parameters>>,
}

impl<'a> Rounds<'a> {
    fn after(solver: Solver<'a>, iterations: Vec<Iteration<Parameters>>) -> Self {
        Self { solver, placed: UsableObservations::Part(0..0), iterations }
    }

    fn round(
        &mut self,
        loss: Loss,
        noise: &NoiseLevels,
        start: Parameters,
        options: &SolveOptions,
    ) -> Result<Solution<Parameters>, Error> {
        let criterion = Criterion { residual: self.solver.settings.config.residual, loss };
        let problem = LineProblem::new(
            self.solver.observations,
            self.placed.of(self.solver.observations),
            criterion,
            noise,
            &start,
        )
        .with_prior(self.solver.settings.prior.cloned())
        .with_shape_prior(self.solver.settings.shape_prior)
        .with_threads(self.solver.settings.config.threads);
        let solution =
            solve(&problem, start, self.solver.settings.fixed, options).map_err(|_| Error::NoStart)?;
        self.iterations.extend_from_slice(&solution.iterations);
        Ok(solution)
    }

    /// Solves with the final loss to each threshold in turn. Every round begins with the noise and the lines' anchors from the previous one.
    fn finish(
        mut self,
        expected: NoiseLevels,
        start: Parameters,
        step_thresholds: &[f64],
    ) -> Result<Fit, Error> {
        let loss = self.solver.settings.config.final_loss();
        let (mut noise, mut whitened_at) = self.prepare(expected, start);
        let mut solution = Err(Error::NoStart);
        for &step_threshold in step_thresholds {
            if let Ok(Solution { state, .. }) = solution {
                (noise, whitened_at) = self.prepare(noise, state);
            }
            let options =
                SolveOptions { step_threshold, initial_damping: NEAR_DAMPING, ..SolveOptions::default() };
            solution = Ok(self.round(loss, &noise, whitened_at.clone(), &options)?);
        }
        Ok(Fit {
            placed: self.placed,
            solution: solution?,
            noise,
            whitened_at,
            prior: self.solver.settings.prior.cloned(),
            shape_prior: self.solver.settings.shape_prior,
            iterations: self.iterations,
        })
    }

    /// Selects the observations that can be placed, measures the noise, and anchors the charts of line, bow and shape at the middle of the points.
    fn prepare(&mut self, mut noise: NoiseLevels, state: Parameters) -> (NoiseLevels, Parameters) {
        let Solver { observations, settings } = self.solver;
        self.placed = UsableObservations::within(observations, state.time_offset_s, FINAL_MARGIN_S);
        let list = self.placed.of(observations);
        let criterion = Criterion { residual: settings.config.residual, loss: settings.config.final_loss() };
        let problem = LineProblem::new(observations, list, criterion, &noise, &state);
        let larger = noise_factor(&problem.squared_residuals(&state));
        noise.factor = (noise.factor * larger).max(LEAST_NOISE_FACTOR);
        (noise, self.modelled(state))
    }

    /// The paper's residual supports only straight lines and an exact sensor. A bow is added to its line once.
    fn modelled(&self, mut state: Parameters) -> Parameters {
        let Solver { observations, settings } = self.solver;
        if state.curvatures.is_empty() {
            state = with_lines_amid_points(observations, state);
        }
        if settings.config.residual == ResidualKind::PointToLine {
            return state;
        }
        let list = self.placed.of(observations);
        let state = with_bows(observations, list, state);
        if settings.shape_prior.is_some() { with_shape(observations, state) } else { state }
    }
}
