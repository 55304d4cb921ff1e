//! A solved problem with its history.

use crate::config::Config;
use crate::input::noise_levels::NoiseLevels;
use crate::input::observations::Observations;
use crate::input::shape_prior::ShapePrior;
use crate::problem::line_problem::{Criterion, LineProblem};
use crate::problem::parameters::Parameters;
use crate::problem::prior::Prior;
use crate::problem::usable::UsableObservations;
use trueline_lsq::{Information, Iteration, Solution};

/// A solved problem with its history.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The observations used.
    pub placed: UsableObservations,
    /// The optimum.
    pub solution: Solution<Parameters>,
    /// The actual noise.
    pub noise: NoiseLevels,
    /// Parameters at which the residuals were whitened.
    pub whitened_at: Parameters,
    /// Directions that were held.
    pub prior: Option<Prior>,
    /// Prior of the sensor's shape.
    pub shape_prior: Option<ShapePrior>,
    /// Every step.
    pub iterations: Vec<Iteration<Parameters>>,
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
        .with_shape_prior(self.shape_prior)
        .with_threads(config.threads)
    }

    /// The information on the unknowns, some of which may be held.
    #[must_use]
    pub fn information(&self, fixed: &[usize], threshold: f64) -> Option<Information> {
        let known = self.parameters().unknowns().known_before();
        Information::beside(&self.solution.equations.hessian, fixed, known, threshold)
    }

    /// The parameters at the optimum.
    #[must_use]
    pub fn parameters(&self) -> &Parameters {
        &self.solution.state
    }
}
