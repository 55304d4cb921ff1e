//! Definition of a least-squares problem.

use crate::NormalEquations;
use nalgebra::DVector;

/// Minimise ½ Σ ρ(|rᵢ(x)|²) over x on a manifold.
///
/// `rᵢ` are whitened residual vectors, ρ a robust loss ([`crate::Loss`]); the gradient and the
/// Gauss–Newton Hessian are those of that sum.
pub trait LeastSquares {
    /// A point x of the manifold.
    type State: Clone;

    /// Number of unknowns: the dimension of the tangent space.
    fn dimension(&self) -> usize;

    /// Moves a state by a tangent step.
    fn retract(&self, state: &Self::State, step: &DVector<f64>) -> Self::State;

    /// The cost ½ Σ ρ at a state.
    fn cost(&self, state: &Self::State) -> f64;

    /// Adds every residual's part into `equations`, which arrive zeroed: JᵀWJ, JᵀWr and the cost.
    fn linearize(&self, state: &Self::State, equations: &mut NormalEquations);
}
