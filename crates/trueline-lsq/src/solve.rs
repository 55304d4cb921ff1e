//! Levenberg–Marquardt: one joint step over all unknowns, damping scaled by the diagonal of H, controlled by
//! the gain ratio. A step that raises the cost is never taken.
//!
//! This differs from Eq. (17) of the paper, which damps by μI. That damps metres and radians alike and needs 16 to 31 iterations where the scaled
//! form needs 5. Source: \[Madsen2004, Alg. 3.16\], scaling \[Marquardt1963\].
//!
//! H leaves out the curvature of a robust loss. Near a minimum every step then falls short by the same part, and the
//! next ones shrink by no more than that. The gain of a step determines the part, and the next step is longer by it.

use crate::{LeastSquares, NormalEquations, Termination};
use nalgebra::{DMatrix, DVector};

/// Options of a solve.
#[derive(Clone, Copy, Debug)]
pub struct SolveOptions {
    /// Maximum number of steps tried, taken or not.
    pub max_iterations: usize,
    /// Initial damping, relative to the diagonal of H.
    pub initial_damping: f64,
    /// The solve ends when a step is shorter than this, in standard deviations of the unknowns.
    pub step_threshold: f64,
    /// The solve ends when the cost falls by less than this fraction.
    pub cost_threshold: f64,
}

impl Default for SolveOptions {
    fn default() -> Self {
        Self { max_iterations: 100, initial_damping: 1e-6, step_threshold: 1e-7, cost_threshold: 1e-14 }
    }
}

/// Largest damping tried. Steps are then 10¹² times shorter than Gauss–Newton's.
const DAMPING_LIMIT: f64 = 1e12;

/// Relative rounding error of a sum of up to some millions of squares.
const COST_ROUNDING: f64 = 1e-13;

/// A cost that rises by more than this part of itself is higher. A residual of a metre with 10 µm of noise is exact to 1e-11
/// of its standard deviation. Over ten thousand of them this is 1e-13 of the cost.
const HIGHER: f64 = 1e-12;

/// The true curvature along a step over that of H, where the loss bends. Beyond this range the linear model is poor, or
/// there is nothing to gain. It is measured by steps of less than one standard deviation: longer ones include the residuals'
/// own curvature …
const BENT: std::ops::RangeInclusive<f64> = 0.8..=0.99;
/// … and with a promised decrease above this fraction of the cost, to stay above the sum's rounding.
const MEASURABLE: f64 = 1e-10;

/// Least damping of a retry. It is smaller for a solve that begins with smaller damping: directions that the first step
/// left undamped must not be held by the next one.
const LEAST_RETRY_DAMPING: f64 = 1e-3;
/// See [`LEAST_RETRY_DAMPING`].
const LEAST_RETRY_TIMES: f64 = 1e4;

/// One trial of a step, with the state before it.
#[derive(Clone, Debug)]
pub struct Iteration<S> {
    /// The state at the start of the iteration.
    pub state: S,
    /// Cost at that state.
    pub cost: f64,
    /// Damping used.
    pub damping: f64,
    /// Length of the step in standard deviations of the unknowns.
    pub step: f64,
    /// Ratio of the decrease of the cost to that promised by the linear model.
    pub gain_ratio: f64,
    /// Whether the step was taken.
    pub accepted: bool,
}

/// Result of the solver.
#[derive(Clone, Debug)]
pub struct Solution<S> {
    /// The best state found.
    pub state: S,
    /// The equations at that state.
    pub equations: NormalEquations,
    /// Reason for the end.
    pub termination: Termination,
    /// Every step tried.
    pub iterations: Vec<Iteration<S>>,
}

/// The reason why there is no solution at all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SolveError {
    /// Cost, gradient or Hessian is not finite at the start.
    NotFiniteAtStart,
    /// The list of fixed unknowns contains one that does not exist.
    NoSuchUnknown {
        /// Its index.
        index: usize,
    },
}

impl std::fmt::Display for SolveError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NotFiniteAtStart => write!(f, "the cost is not finite at the start"),
            Self::NoSuchUnknown { index } => write!(f, "there is no unknown number {index} to hold fixed"),
        }
    }
}

impl std::error::Error for SolveError {}

/// Minimises the problem from `start`, with the unknowns listed in `fixed` held constant.
///
/// # Errors
/// [`SolveError`] if the start is invalid. Missing convergence is not an error: see [`Solution::termination`].
pub fn solve<P: LeastSquares>(
    problem: &P,
    start: P::State,
    fixed: &[usize],
    options: &SolveOptions,
) -> Result<Solution<P::State>, SolveError> {
    let mut equations = NormalEquations::zeros(problem.dimension());
    if let Some(&index) = fixed.iter().find(|index| **index >= problem.dimension()) {
        return Err(SolveError::NoSuchUnknown { index });
    }
    problem.linearize(&start, &mut equations);
    if !equations.is_finite() {
        return Err(SolveError::NotFiniteAtStart);
    }
    let tried = NormalEquations::zeros(problem.dimension());
    let least_retry = match options.initial_damping {
        damping if damping > 0.0 => LEAST_RETRY_DAMPING.min(LEAST_RETRY_TIMES * damping),
        _ => LEAST_RETRY_DAMPING,
    };
    let mut search =
        Search { problem, fixed, equations, tried, state: start, iterations: Vec::new(), least_retry };
    let termination = search.run(options);
    Ok(Solution {
        state: search.state,
        equations: search.equations,
        termination,
        iterations: search.iterations,
    })
}

struct Search<'a, P: LeastSquares> {
    problem: &'a P,
    fixed: &'a [usize],
    equations: NormalEquations,
    /// The equations at the trial step.
    tried: NormalEquations,
    state: P::State,
    iterations: Vec<Iteration<P::State>>,
    /// Least damping of a retry.
    least_retry: f64,
}

impl<P: LeastSquares> Search<'_, P> {
    fn run(&mut self, options: &SolveOptions) -> Termination {
        let mut damping = options.initial_damping;
        let mut growth = 2.0;
        let mut curvature = 1.0;
        while self.iterations.len() < options.max_iterations {
            let Some(mut step) = damped_step(&self.equations, self.fixed, damping) else {
                (damping, growth) = self.raised(damping, growth);
                if damping > DAMPING_LIMIT {
                    return self.stuck(damping);
                }
                continue;
            };
            step /= curvature;
            let length = whitened_length(&self.equations, &step);
            let cost = self.equations.cost;
            let promised = promised_decrease(&self.equations, &step);
            let (accepted, gain_ratio, decrease) = self.attempt(&step, damping, length, promised);
            if length < options.step_threshold {
                return Termination::StepConverged { step: length, threshold: options.step_threshold };
            }
            if accepted && decrease <= options.cost_threshold * cost && gain_ratio > 0.1 {
                return Termination::CostConverged {
                    decrease: decrease / cost,
                    threshold: options.cost_threshold,
                };
            }
            if promised <= COST_ROUNDING * cost {
                // The possible gain is below the rounding of the sum.
                return Termination::CostConverged { decrease: promised / cost, threshold: COST_ROUNDING };
            }
            if accepted {
                // Madsen's rule: damping falls to a third at gain 1, and is unchanged at gain ½.
                damping *= (1.0_f64 / 3.0).max(1.0 - (2.0 * gain_ratio - 1.0).powi(3));
                growth = 2.0;
                if length < 1.0 && promised > MEASURABLE * cost {
                    curvature = bent(1.0 - 2.0 * (decrease - promised) / (length * length));
                }
            } else {
                (damping, growth) = self.raised(damping, growth);
                curvature = 1.0;
                if damping > DAMPING_LIMIT {
                    return self.stuck(damping);
                }
            }
        }
        Termination::IterationLimit { iterations: self.iterations.len(), threshold: options.max_iterations }
    }

    /// Tries a step, and takes it unless it raises the cost. The equations are summed immediately, because nearly every step is taken. A separate
    /// pass for the cost takes half as long as one for everything.
    fn attempt(&mut self, step: &DVector<f64>, damping: f64, length: f64, promised: f64) -> (bool, f64, f64) {
        let cost = self.equations.cost;
        let next = self.problem.retract(&self.state, step);
        self.tried.clear();
        self.problem.linearize(&next, &mut self.tried);
        let decrease = cost - self.tried.cost;
        let gain_ratio = if promised > 0.0 { decrease / promised } else { 0.0 };
        // The cost cannot judge a step with a promised gain below its rounding. The gradient has far more
        // digits.
        let is_lost = promised > 0.0 && promised <= COST_ROUNDING * cost;
        let is_lower = gain_ratio > 0.0 || (is_lost && -decrease <= HIGHER * cost);
        let accepted = self.tried.is_finite() && is_lower;
        self.iterations.push(Iteration {
            state: self.state.clone(),
            cost,
            damping,
            step: length,
            gain_ratio,
            accepted,
        });
        if accepted {
            self.state = next;
            std::mem::swap(&mut self.equations, &mut self.tried);
        }
        (accepted, gain_ratio, decrease)
    }

    /// Damping and its growth after a rejected or missing step, also from a damping of zero.
    fn raised(&self, damping: f64, growth: f64) -> (f64, f64) {
        // Below the least damping, a change of it does not change the step.
        ((damping * growth).max(self.least_retry), growth * 2.0)
    }

    fn stuck(&self, damping: f64) -> Termination {
        let step = damped_step(&self.equations, self.fixed, 0.0)
            .map_or(f64::INFINITY, |step| whitened_length(&self.equations, &step));
        Termination::NoFurtherDecrease { damping, threshold: DAMPING_LIMIT, step }
    }
}

/// The measured curvature κ of a step with the gain −gᵀδ − ½ κ δᵀHδ, if a bending loss has it; else 1, that of H.
fn bent(curvature: f64) -> f64 {
    if BENT.contains(&curvature) { curvature } else { 1.0 }
}

/// Solves (H + λ diag H) δ = −g over the free unknowns. Fixed ones get zero.
fn damped_step(equations: &NormalEquations, fixed: &[usize], damping: f64) -> Option<DVector<f64>> {
    let mut matrix: DMatrix<f64> = equations.hessian.clone();
    let mut right = -equations.gradient.clone();
    // An unknown without effect on any residual has an empty column; it stays constant.
    let floor = matrix.diagonal().max() * 1e-30;
    for k in 0..right.len() {
        let held = fixed.contains(&k) || matrix[(k, k)] <= floor;
        if held {
            matrix.row_mut(k).fill(0.0);
            matrix.column_mut(k).fill(0.0);
            matrix[(k, k)] = 1.0;
            right[k] = 0.0;
        } else {
            matrix[(k, k)] *= 1.0 + damping;
        }
    }
    let scale = matrix.diagonal().map(|d| 1.0 / d.sqrt());
    let scaled = DMatrix::from_fn(right.len(), right.len(), |i, j| matrix[(i, j)] * scale[i] * scale[j]);
    let step = scaled.cholesky()?.solve(&right.component_mul(&scale)).component_mul(&scale);
    step.iter().all(|x| x.is_finite()).then_some(step)
}

/// √(δᵀHδ): the motion of the whitened residuals, which is the length of the step in standard deviations.
fn whitened_length(equations: &NormalEquations, step: &DVector<f64>) -> f64 {
    step.dot(&(&equations.hessian * step)).max(0.0).sqrt()
}

/// Decrease of the cost that the linear model promises: −gᵀδ − ½ δᵀHδ.
fn promised_decrease(equations: &NormalEquations, step: &DVector<f64>) -> f64 {
    -equations.gradient.dot(step) - 0.5 * step.dot(&(&equations.hessian * step))
}
