//! A residual of your own for the solver that trueline uses: distances of points in space from a sphere.

use nalgebra::{DVector, Vector3, Vector4};
use std::error::Error;
use trueline_lsq::{LeastSquares, NormalEquations, SolveOptions, solve};

/// Unknowns: centre and radius, m.
struct SphereFit {
    points_m: Vec<Vector3<f64>>,
    sigma_m: f64,
}

impl SphereFit {
    /// Whitened residual and its derivative by the unknowns.
    fn residual(&self, sphere: &Vector4<f64>, point_m: &Vector3<f64>) -> (f64, Vector4<f64>) {
        let away = point_m - sphere.xyz();
        let outward = away.normalize();
        let residual = (away.norm() - sphere.w) / self.sigma_m;
        (residual, -Vector4::new(outward.x, outward.y, outward.z, 1.0) / self.sigma_m)
    }
}

impl LeastSquares for SphereFit {
    type State = Vector4<f64>;

    fn dimension(&self) -> usize {
        4
    }

    fn retract(&self, state: &Self::State, step: &DVector<f64>) -> Self::State {
        state + step.fixed_rows::<4>(0)
    }

    fn cost(&self, state: &Self::State) -> f64 {
        self.points_m.iter().map(|p| 0.5 * self.residual(state, p).0.powi(2)).sum()
    }

    fn linearize(&self, state: &Self::State, equations: &mut NormalEquations) {
        for point_m in &self.points_m {
            let (r, j) = self.residual(state, point_m);
            equations.hessian += j * j.transpose();
            equations.gradient += j * r;
            equations.cost += 0.5 * r * r;
        }
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let truth = Vector4::new(0.9, -0.2, 0.4, 0.0125);
    let on_sphere = |k: i32| {
        let (turn, rise) = (2.4 * f64::from(k), f64::from(k) / 50.0 - 1.0);
        let across = (1.0 - rise * rise).sqrt();
        truth.xyz() + Vector3::new(across * turn.cos(), across * turn.sin(), rise) * truth.w
    };
    let problem = SphereFit { points_m: (1..100).map(on_sphere).collect(), sigma_m: 1e-5 };
    let start = truth + Vector4::new(2e-3, -1e-3, 1e-3, 3e-3);
    let solution = solve(&problem, start, &[], &SolveOptions::default())?;

    assert!(solution.termination.is_converged(), "{}", solution.termination);
    // The points are exact; rounding of numbers of size one is left.
    assert!((solution.state - truth).norm() < 1e-12, "{}", solution.state - truth);
    Ok(())
}
