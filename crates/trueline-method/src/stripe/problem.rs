//! Frames → least-squares problem: the sums of their whitened residuals and the prior.

use crate::input::observations::Observations;
use crate::input::shape_prior::ShapePrior;
use crate::problem::usable::UNUSABLE_SQUARED;
use crate::stripe::frame_residual::{FrameGradients, FrameResidual, linearize_frame, residual_of_frame};
use crate::stripe::frame_sums::FrameSums;
use crate::stripe::state::StripeState;
use crate::stripe::unknowns::StripeUnknowns;
use crate::stripe::weighed_frame::WeighedFrame;
use nalgebra::DVector;
use trueline_lsq::{LeastSquares, NormalEquations};

/// The least-squares problem of the plates. Weights are fixed: the robust loss is in the whiteners.
pub struct StripeProblem<'a> {
    /// Trajectory and sheet.
    pub observations: &'a Observations,
    /// The frames used.
    pub frames: Vec<WeighedFrame>,
    /// Its unknowns.
    pub unknowns: StripeUnknowns,
    /// Prior of the sensor's shape.
    pub shape_prior: Option<ShapePrior>,
}

impl StripeProblem<'_> {
    /// Residuals of a frame and their gradients, not whitened. `None` if it cannot be placed.
    #[must_use]
    pub(crate) fn linearized(
        &self,
        weighed: &WeighedFrame,
        at: &StripeState,
    ) -> Option<(FrameResidual, FrameGradients)> {
        let placement = weighed.placement(self.observations, at)?;
        linearize_frame(self.observations, &weighed.frame, at, &placement)
    }
}

impl LeastSquares for StripeProblem<'_> {
    type State = StripeState;

    fn dimension(&self) -> usize {
        self.unknowns.dimension()
    }

    fn retract(&self, state: &StripeState, step: &DVector<f64>) -> StripeState {
        state.retract(step)
    }

    fn cost(&self, state: &StripeState) -> f64 {
        let squares = self.frames.iter().map(|weighed| {
            let placement = weighed.placement(self.observations, state);
            let residual =
                placement.and_then(|p| residual_of_frame(self.observations, &weighed.frame, state, &p));
            residual.map_or(UNUSABLE_SQUARED, |residual| {
                (weighed.whitener * (residual + weighed.pose_error.in_residual)).norm_squared()
            })
        });
        0.5 * squares.sum::<f64>() + state.known(self.shape_prior.as_ref()).cost()
    }

    fn linearize(&self, state: &StripeState, equations: &mut NormalEquations) {
        let mut sums = FrameSums::new(self.unknowns);
        for weighed in &self.frames {
            match self.linearized(weighed, state) {
                Some((parts, gradients)) => sums.add(weighed, &weighed.residual(&parts), &gradients),
                None => equations.cost += 0.5 * UNUSABLE_SQUARED,
            }
        }
        sums.add_to(equations);
        state.known(self.shape_prior.as_ref()).add_to(equations);
    }
}
