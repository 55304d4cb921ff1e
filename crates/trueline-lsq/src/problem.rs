//! Definition of a least-squares problem.

use crate::NormalEquations;
use nalgebra::DVector;

/// Minimises ½ Σ ρ(|rᵢ(x)|²) over x on a manifold.
///
/// `rᵢ` are whitened residual vectors, and ρ is a robust loss ([`crate::Loss`]). The gradient and the Gauss–Newton Hessian belong to that sum.
pub trait LeastSquares {
    /// A point x of the manifold.
    type State: Clone;

    /// Number of unknowns: the dimension of the tangent space.
    fn dimension(&self) -> usize;

    /// Moves a state by a tangent step.
    fn retract(&self, state: &Self::State, step: &DVector<f64>) -> Self::State;

    /// The cost ½ Σ ρ at a state.
    fn cost(&self, state: &Self::State) -> f64;

    /// Adds the contribution of every residual to `equations`, which are zero at the start: JᵀWJ, JᵀWr and the cost.
    fn linearize(&self, state: &Self::State, equations: &mut NormalEquations);
}
