//! Solves on a thin sample with a redescending loss whose scale is narrowed step by step: graduated non-convexity
//! \[Yang2020\].

use crate::input::noise_levels::NoiseLevels;
use crate::input::observations::{Observation, Observations};
use crate::order_statistics::median;
use crate::problem::line_problem::LineProblem;
use crate::problem::parameters::Parameters;
use trueline_lsq::{Loss, SolveOptions, solve};

/// Observations used by a search, of all lines together. Every line determines time offset and hand-eye …
const LOOKED_AT: usize = 160;
/// … but at least this number of each.
const LEAST_OF_LINE: usize = 60;
/// Least noise of features in a search, m. For features with a stated micrometre, a thousand σ would be a small part of the field of view.
const SEARCHED_SIGMA_M: f64 = 10e-6;
/// Scales of the loss, σ. The first covers a good part of the field of view.
pub(crate) const SCALES: [f64; 6] = [1000.0, 300.0, 100.0, 30.0, 10.0, 5.0];
/// Candidates nearer than this in time offset, s, may be in one local minimum.
pub(crate) const SAME_OFFSET_S: f64 = 0.02;

/// The result of a narrowing.
#[derive(Clone, Debug)]
pub(crate) struct Candidate {
    /// Cost at its last scale.
    pub cost: f64,
    /// The parameters.
    pub parameters: Parameters,
}

/// One scale of a narrowing.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stage {
    /// Scale of the loss, σ.
    pub scale: f64,
    /// Maximum iterations.
    pub iterations: usize,
}

/// The data of a search.
#[derive(Clone, Copy)]
pub(crate) struct Narrowing<'a> {
    /// Trajectory and sheet.
    pub observations: &'a Observations,
    /// The observations used.
    pub sample: &'a [Observation],
    /// Expected noise, with the search's lower bound.
    noise: NoiseLevels,
}

impl<'a> Narrowing<'a> {
    /// A search on a sample.
    pub(crate) fn new(
        observations: &'a Observations,
        sample: &'a [Observation],
        noise: &NoiseLevels,
    ) -> Self {
        let variance =
            |o: &Observation| 0.5 * (o.covariance[0] + o.covariance[2]) + noise.robot_sigma_m.powi(2);
        let typical_m = noise.factor * median(sample.iter().map(variance)).map_or(f64::INFINITY, f64::sqrt);
        let factor = noise.factor * (SEARCHED_SIGMA_M / typical_m).max(1.0);
        Self { observations, sample, noise: NoiseLevels { factor, ..*noise } }
    }

    /// The same search on another sample.
    pub(crate) fn among(self, sample: &'a [Observation]) -> Self {
        Self { sample, ..self }
    }

    /// Solves from a start at one scale. `None` if the cost is not finite there.
    #[must_use]
    pub(crate) fn narrow(&self, stage: Stage, start: Parameters) -> Option<Candidate> {
        let loss = Loss::GemanMcClure { scale: stage.scale };
        let problem =
            LineProblem::coarse(self.observations, self.sample, loss, &self.noise, start.unknowns());
        let options = SolveOptions {
            max_iterations: stage.iterations,
            initial_damping: 1e-3,
            step_threshold: 1e-2,
            cost_threshold: 1e-4,
        };
        let solution = solve(&problem, start, &[], &options).ok()?;
        Some(Candidate { cost: solution.equations.cost, parameters: solution.state })
    }

    /// Solves from a start through several scales.
    #[must_use]
    pub(crate) fn follow(&self, scales: &[f64], iterations: usize, start: Parameters) -> Option<Candidate> {
        let start = Candidate { cost: f64::INFINITY, parameters: start };
        scales.iter().try_fold(start, |candidate, &scale| {
            self.narrow(Stage { scale, iterations }, candidate.parameters)
        })
    }
}

/// The observations used by a search.
#[must_use]
pub(crate) fn sample(observations: &Observations) -> Vec<Observation> {
    thin(observations, (LOOKED_AT / observations.line_count.max(1)).max(LEAST_OF_LINE))
}

/// Every n-th observation of each line, about `wanted` of each.
#[must_use]
pub(crate) fn thin(observations: &Observations, wanted: usize) -> Vec<Observation> {
    let mut totals = vec![0_usize; observations.line_count];
    for o in &observations.list {
        totals[o.line as usize] += 1;
    }
    let mut seen = vec![0_usize; observations.line_count];
    let keep = |o: &&Observation| {
        let line = o.line as usize;
        seen[line] += 1;
        (seen[line] - 1).is_multiple_of(totals[line].div_ceil(wanted))
    };
    observations.list.iter().filter(keep).copied().collect()
}
