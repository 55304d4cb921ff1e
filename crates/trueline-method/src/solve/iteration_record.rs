//! What one step of the solver did.

use crate::config::ResidualKind;
use crate::input::observations::{Observation, Observations};
use crate::problem::parameters::Parameters;
use crate::problem::simd::{Scan, SquaredLengths, sweep};
use trueline_lsq::Iteration;

/// One step of the solver, as the paper's Figs. 6 to 8 draw it.
#[derive(Clone, Debug)]
pub struct IterationRecord {
    /// Cost ½ Σ ρ at this stage's loss, over this stage's observations: a long scan is followed by some of them first.
    pub cost: f64,
    /// Root mean square distance from the line of all usable features that turned out to be no outliers, m.
    pub rms_m: f64,
    /// Unknowns before the step.
    pub parameters: Parameters,
    /// Whether the step was taken.
    pub accepted: bool,
}

impl IterationRecord {
    /// Of a step, with the distances of `list`.
    #[must_use]
    pub(crate) fn of(
        observations: &Observations,
        list: &[Observation],
        step: &Iteration<Parameters>,
    ) -> Self {
        Self {
            cost: step.cost,
            rms_m: rms_m(observations, list, &step.state),
            parameters: step.state.clone(),
            accepted: step.accepted,
        }
    }
}

/// Root mean square distance from the lines, m.
fn rms_m(observations: &Observations, list: &[Observation], at: &Parameters) -> f64 {
    let mut distances = SquaredLengths::default();
    sweep(&Scan { observations, list, at, residual: ResidualKind::PointToLine }, &mut distances);
    distances.root_mean()
}
