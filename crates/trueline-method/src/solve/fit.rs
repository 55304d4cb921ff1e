//! A solved problem and how it got there.

use crate::config::Config;
use crate::input::noise_levels::NoiseLevels;
use crate::input::observations::Observations;
use crate::problem::line_problem::{Criterion, LineProblem};
use crate::problem::parameters::Parameters;
use crate::problem::prior::Prior;
use crate::problem::usable::UsableObservations;
use crate::solve::iteration_record::IterationRecord;
use trueline_lsq::Solution;

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
