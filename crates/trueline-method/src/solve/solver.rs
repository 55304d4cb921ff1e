//! The context of every solve of a calibration, bound once.

use crate::input::observations::Observations;
use crate::problem::line_problem::{Criterion, LineProblem};
use crate::problem::parameters::Parameters;
use crate::solve::settings::FitSettings;
use trueline_lsq::{LeastSquares, Loss};

/// Observations and how they are fitted; see [`crate::solve::refine`] for what it does with them.
#[derive(Clone, Copy)]
pub struct Solver<'a> {
    /// What is fitted.
    pub observations: &'a Observations,
    /// How.
    pub settings: FitSettings<'a>,
}

/// A loss for which everything beyond 8 σ is an outlier.
pub(crate) const REJECTING: Loss = Loss::Tukey { scale: 8.0 };

impl<'a> Solver<'a> {
    /// The same settings on other observations.
    #[must_use]
    pub fn on<'b>(&self, observations: &'b Observations) -> Solver<'b>
    where
        'a: 'b,
    {
        Solver { observations, settings: self.settings }
    }

    /// Twice the negative log likelihood of all features, those that are outliers or cannot be placed counting as such, and
    /// of the prior.
    #[must_use]
    pub(crate) fn twice_negative_log_likelihood(&self, at: &Parameters) -> f64 {
        let criterion = Criterion { residual: self.settings.config.residual, loss: REJECTING };
        let list = &self.observations.list;
        let problem = LineProblem::new(self.observations, list, criterion, &self.settings.noise, at);
        2.0 * problem.with_shape_prior(self.settings.shape_prior).cost(at)
    }
}
