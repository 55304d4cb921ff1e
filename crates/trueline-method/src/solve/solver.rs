//! The context shared by all solves of a calibration.

use crate::input::observations::Observations;
use crate::problem::line_problem::{Criterion, LineProblem};
use crate::problem::parameters::Parameters;
use crate::solve::settings::FitSettings;
use trueline_lsq::{LeastSquares, Loss};

/// Observations with the settings of their fit. See [`crate::solve::refine`] for the solves.
#[derive(Clone, Copy)]
pub struct Solver<'a> {
    /// The observations.
    pub observations: &'a Observations,
    /// The settings.
    pub settings: FitSettings<'a>,
}

/// A loss that rejects everything beyond 8 σ as an outlier.
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

    /// Twice the negative log likelihood of all features and of the prior. Outliers and features that cannot be placed are included.
    #[must_use]
    pub(crate) fn twice_negative_log_likelihood(&self, at: &Parameters) -> f64 {
        let criterion = Criterion { residual: self.settings.config.residual, loss: REJECTING };
        let list = &self.observations.list;
        let problem = LineProblem::new(self.observations, list, criterion, &self.settings.noise, at);
        2.0 * problem.with_shape_prior(self.settings.shape_prior).cost(at)
    }
}
