//! Record of one step of the solver.

use crate::config::ResidualKind;
use crate::input::observations::{Observation, Observations};
use crate::problem::parameters::Parameters;
use crate::problem::simd::{Scan, SquaredLengths, sweep};
use trueline_lsq::Iteration;

/// One step of the solver, as drawn in the paper's Figs. 6 to 8.
#[derive(Clone, Debug)]
pub struct IterationRecord {
    /// Cost ½ Σ ρ with this stage's loss and observations. A long scan uses a subset first.
    pub cost: f64,
    /// RMS distance from the line of all usable features that are inliers at the end, m.
    pub rms_m: f64,
    /// Unknowns before the step.
    pub parameters: Parameters,
    /// Whether the step was taken.
    pub accepted: bool,
}

impl IterationRecord {
    /// From a step, with the distances of `list`.
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

/// RMS distance from the lines, m.
fn rms_m(observations: &Observations, list: &[Observation], at: &Parameters) -> f64 {
    let mut distances = SquaredLengths::default();
    sweep(&Scan { observations, list, at, residual: ResidualKind::PointToLine }, &mut distances);
    distances.root_mean()
}
