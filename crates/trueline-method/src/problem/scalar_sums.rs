//! The same least-squares problem, one sample at a time: the reference for the fast sums, and the readable form.

use crate::problem::layout::Layout;
use crate::problem::line_problem::LineProblem;
use crate::problem::parameters::Parameters;
use crate::problem::usable::UNUSABLE_SQUARED;
use nalgebra::DVector;
use trueline_lsq::{LeastSquares, NormalEquations};

/// A problem that is summed one observation at a time.
pub struct OneByOne<'a, 'b>(pub &'b LineProblem<'a>);

impl LeastSquares for OneByOne<'_, '_> {
    type State = Parameters;

    fn dimension(&self) -> usize {
        self.0.dimension()
    }

    fn retract(&self, state: &Parameters, step: &DVector<f64>) -> Parameters {
        state.retract(step)
    }

    fn cost(&self, state: &Parameters) -> f64 {
        let squared = |(o, whitener)| {
            let residual = self.0.residual(o, state);
            residual.map_or(UNUSABLE_SQUARED, |r| {
                crate::input::noise_levels::Whitener::apply(whitener, &r).norm_squared()
            })
        };
        let data: f64 = self.0.selected().map(squared).map(|s| 0.5 * self.0.loss.value(s)).sum();
        let known = state.known(self.0.shape_prior.as_ref()).cost();
        data + known + self.0.prior.as_ref().map_or(0.0, |prior| prior.cost(state))
    }

    fn linearize(&self, state: &Parameters, equations: &mut NormalEquations) {
        for (o, whitener) in self.0.selected() {
            let Some((residual, jacobian)) = self.0.whitened((o, whitener), state) else {
                equations.cost += 0.5 * self.0.loss.value(UNUSABLE_SQUARED);
                continue;
            };
            let squared = residual.norm_squared();
            let weight = self.0.loss.weight(squared);
            let hessian = jacobian.transpose() * jacobian * weight;
            let gradient = jacobian.transpose() * residual * weight;
            let unknowns = &self.0.unknowns;
            unknowns.add(o.line as usize, gradient.as_slice(), equations.gradient.as_mut_slice());
            unknowns.add_square(o.line as usize, &hessian, &mut equations.hessian);
            equations.cost += 0.5 * self.0.loss.value(squared);
        }
        state.known(self.0.shape_prior.as_ref()).add_to(equations);
        if let Some(prior) = &self.0.prior {
            prior.add_to(state, equations);
        }
    }
}
