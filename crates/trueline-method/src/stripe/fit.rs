//! From a start to the optimum over all frames: weight, solve, and repeat until the weights converge.

use crate::input::observations::Observations;
use crate::input::shape_prior::ShapePrior;
use crate::stripe::frames::StripeFrame;
use crate::stripe::outlier_counts::Rejected;
use crate::stripe::problem::StripeProblem;
use crate::stripe::state::StripeState;
use crate::stripe::whitening::{SharedNoise, Weighed, weigh};
use trueline_lsq::{Information, Loss, Solution, SolveError, SolveOptions, solve};

/// Maximum rounds of weights. An outlier that dominated the first plane loses its influence in two or three.
const ROUNDS: usize = 8;
/// Weights have converged if they move the optimum by less than this, σ. The next round moves it by a tenth of that.
const SETTLED_SIGMAS: f64 = 0.1;
/// Convergence threshold of a solve whose weights may still change, σ. Steps shrink by far more than a factor of ten, so the optimum is then
/// accurate to a hundredth.
const ROUGH: f64 = 0.1;
/// Convergence threshold of the last solve, σ.
const FINE: f64 = 1e-6;
/// Initial damping of a solve. The information on shape and translation in its worst direction is 1e-6 of the diagonal of H. Stronger damping there
/// costs three more steps a solve.
const FIRST_DAMPING: f64 = 1e-10;

/// A solved problem.
pub struct StripeFit<'a> {
    /// The problem, with the last weights.
    pub problem: StripeProblem<'a>,
    /// Its optimum.
    pub solution: Solution<StripeState>,
    /// Noise factor: noise divided by the expected noise.
    pub noise_factor: f64,
    /// Rejected measurements.
    pub rejected: Rejected,
    /// Whether the weights have settled.
    pub is_settled: bool,
}

/// Inputs of a fit.
#[derive(Clone, Copy)]
pub(crate) struct StripeSolver<'a> {
    /// Trajectory and sheet.
    pub observations: &'a Observations,
    /// Measurements of the frames.
    pub frames: &'a [StripeFrame],
    /// Common errors of their residuals.
    pub shared: SharedNoise,
    /// The loss of a plate's stripe in a frame.
    pub loss: Loss,
    /// Prior of the sensor's shape.
    pub shape_prior: Option<ShapePrior>,
    /// Components held at their start.
    pub fixed: &'a [usize],
}

impl<'a> StripeSolver<'a> {
    /// Solves from a start.
    ///
    /// # Errors
    /// [`SolveError`] if the cost is not finite there.
    pub(crate) fn fit(&self, start: StripeState) -> Result<StripeFit<'a>, SolveError> {
        let (round, state, is_settled) = self.settled(start)?;
        let solution = self.solved(&round, state, FINE)?;
        let Round { problem, noise_factor, rejected } = round;
        Ok(StripeFit { problem, solution, noise_factor, rejected, is_settled })
    }

    /// The problem with converged weights, its optimum, and whether the weights converged.
    fn settled(&self, start: StripeState) -> Result<(Round<'a>, StripeState, bool), SolveError> {
        let mut state = start;
        let mut rounds = 0;
        loop {
            let round = self.weighed(&state);
            let solution = self.solved(&round, state, ROUGH)?;
            let first = solution.iterations.iter().find(|step| step.accepted).map_or(0.0, |step| step.step);
            state = solution.state;
            rounds += 1;
            let is_settled = first < SETTLED_SIGMAS;
            if is_settled || rounds == ROUNDS {
                return Ok((round, state, is_settled));
            }
        }
    }

    /// The problem with the weights at a state.
    fn weighed(&self, state: &StripeState) -> Round<'a> {
        let Weighed { frames, rejected, factor } =
            weigh(self.observations, self.frames, state, &self.shared, &self.loss);
        let problem = StripeProblem {
            observations: self.observations,
            frames,
            unknowns: state.unknowns(),
            shape_prior: self.shape_prior,
        };
        Round { problem, noise_factor: factor, rejected }
    }

    fn solved(
        &self,
        round: &Round<'a>,
        state: StripeState,
        step_threshold: f64,
    ) -> Result<Solution<StripeState>, SolveError> {
        let options =
            SolveOptions { step_threshold, initial_damping: FIRST_DAMPING, ..SolveOptions::default() };
        solve(&round.problem, state, self.fixed, &options)
    }
}

/// A problem with the quantities that its weights depend on.
struct Round<'a> {
    problem: StripeProblem<'a>,
    noise_factor: f64,
    rejected: Rejected,
}

impl StripeFit<'_> {
    /// The optimum.
    #[must_use]
    pub fn state(&self) -> &StripeState {
        &self.solution.state
    }

    /// The information on the unknowns. A direction is observable above `threshold` of the largest singular value.
    #[must_use]
    pub fn information(&self, fixed: &[usize], threshold: f64) -> Option<Information> {
        let known = self.problem.unknowns.known_before();
        Information::beside(&self.solution.equations.hessian, fixed, known, threshold)
    }
}
