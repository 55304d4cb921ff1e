//! Checks for the author of a problem: is the gradient the derivative of the cost?

use crate::{LeastSquares, NormalEquations};
use nalgebra::{DMatrix, DVector};

/// Derivative of a vector function by central differences over a five-point stencil.
///
/// The truncation error is h⁴ f⁽⁵⁾/30, and the rounding error is about eps·|f|/h. With h near 1e-3 of the argument's natural size both are below
/// 1e-11 of f.
#[must_use]
pub fn numerical_jacobian<F>(dimension: usize, step: f64, function: F) -> DMatrix<f64>
where
    F: Fn(&DVector<f64>) -> DVector<f64>,
{
    let rows = function(&DVector::zeros(dimension)).len();
    let mut jacobian = DMatrix::zeros(rows, dimension);
    for k in 0..dimension {
        let at = |multiple: f64| {
            let mut argument = DVector::zeros(dimension);
            argument[k] = multiple * step;
            function(&argument)
        };
        let column = (at(-2.0) - at(2.0) + (at(1.0) - at(-1.0)) * 8.0) / (12.0 * step);
        jacobian.set_column(k, &column);
    }
    jacobian
}

/// Largest difference between the analytic and the numerical gradient of the cost at `state`, each component in units
/// of √H_kk: one is one standard deviation of residual.
#[must_use]
pub fn gradient_error<P: LeastSquares>(problem: &P, state: &P::State, steps: &DVector<f64>) -> f64 {
    let mut equations = NormalEquations::zeros(problem.dimension());
    problem.linearize(state, &mut equations);
    let mut worst: f64 = 0.0;
    for k in 0..problem.dimension() {
        let at = |multiple: f64| {
            let mut step = DVector::zeros(problem.dimension());
            step[k] = multiple * steps[k];
            problem.cost(&problem.retract(state, &step))
        };
        let numerical = (at(-2.0) - at(2.0) + (at(1.0) - at(-1.0)) * 8.0) / (12.0 * steps[k]);
        let scale = equations.hessian[(k, k)].sqrt().max(f64::MIN_POSITIVE);
        worst = worst.max((numerical - equations.gradient[k]).abs() / scale);
    }
    worst
}
