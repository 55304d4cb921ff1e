//! A user-defined problem that needs only the public interface: a circle fitted to points.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use nalgebra::{DVector, Vector2, Vector3};
use trueline_lsq::{Information, LeastSquares, Loss, NormalEquations, SolveOptions, check, solve};

struct CircleFit {
    points: Vec<Vector2<f64>>,
    sigma: f64,
    loss: Loss,
}

impl CircleFit {
    fn residual(&self, circle: &Vector3<f64>, point: &Vector2<f64>) -> (f64, Vector3<f64>) {
        let to_point = point - circle.xy();
        let distance = to_point.norm();
        let unit = to_point / distance;
        ((distance - circle.z) / self.sigma, Vector3::new(-unit.x, -unit.y, -1.0) / self.sigma)
    }
}

impl LeastSquares for CircleFit {
    type State = Vector3<f64>;

    fn dimension(&self) -> usize {
        3
    }

    fn retract(&self, state: &Self::State, step: &DVector<f64>) -> Self::State {
        state + step.fixed_rows::<3>(0)
    }

    fn cost(&self, state: &Self::State) -> f64 {
        self.points.iter().map(|p| 0.5 * self.loss.value(self.residual(state, p).0.powi(2))).sum()
    }

    fn linearize(&self, state: &Self::State, equations: &mut NormalEquations) {
        for point in &self.points {
            let (r, j) = self.residual(state, point);
            let weight = self.loss.weight(r * r);
            equations.hessian += j * j.transpose() * weight;
            equations.gradient += j * (r * weight);
            equations.cost += 0.5 * self.loss.value(r * r);
        }
    }
}

fn circle_points(count: usize, arc: f64) -> Vec<Vector2<f64>> {
    (0..count)
        .map(|k| {
            let angle = arc * k as f64 / count as f64;
            Vector2::new(3.0 + 2.0 * angle.cos(), -1.0 + 2.0 * angle.sin())
        })
        .collect()
}

const TRUTH: Vector3<f64> = Vector3::new(3.0, -1.0, 2.0);

#[test]
fn exact_points_give_the_exact_circle() {
    let problem = CircleFit { points: circle_points(50, 6.0), sigma: 0.1, loss: Loss::Squared };
    let solution = solve(&problem, Vector3::new(2.0, 0.5, 1.0), &[], &SolveOptions::default()).unwrap();
    assert!(solution.termination.is_converged(), "{}", solution.termination);
    // Quadratic convergence from a last step below 1e-7 sigma: rounding of numbers of size 3 remains.
    assert!((solution.state - TRUTH).norm() < 1e-12, "{}", solution.state);
}

#[test]
fn gradient_is_the_derivative_of_the_cost_for_every_loss() {
    let steps = DVector::from_element(3, 1e-4);
    for loss in [
        Loss::Squared,
        Loss::Huber { scale: 1.3 },
        Loss::Cauchy { scale: 1.3 },
        Loss::GemanMcClure { scale: 1.3 },
        Loss::Tukey { scale: 13.0 },
    ] {
        let problem = CircleFit { points: circle_points(50, 6.0), sigma: 0.1, loss };
        // Cost ~1e3. Five-point rounding eps·1e3/1e-4 = 2e-9, in units of √H ≈ 50, is below 1e-9. Huber's kink may lie inside a stencil and costs
        // h·(change of ρ″) ≈ 1e-5.
        let error = check::gradient_error(&problem, &Vector3::new(2.9, -0.8, 2.1), &steps);
        assert!(error < 1e-5, "{loss:?}: {error}");
    }
}

#[test]
fn wild_points_do_not_move_a_redescending_fit() {
    let mut points = circle_points(60, 6.0);
    for point in points.iter_mut().step_by(4) {
        *point *= 3.0;
    }
    let problem = CircleFit { points, sigma: 0.1, loss: Loss::GemanMcClure { scale: 1.0 } };
    let start = TRUTH + Vector3::new(0.05, 0.05, -0.05);
    let solution = solve(&problem, start, &[], &SolveOptions::default()).unwrap();
    // A point 40 σ off has the weight (1 + 1600)⁻² and a pull of 40 σ · 4e-7 = 1.6e-5 σ = 1.6e-6. Fifteen of them against forty-five inliers move
    // the fit by less than that each.
    assert!((solution.state - TRUTH).norm() < 5e-4, "{}", solution.state - TRUTH);
}

#[test]
fn fixed_unknowns_stay_and_the_rest_is_solved() {
    let problem = CircleFit { points: circle_points(50, 6.0), sigma: 0.1, loss: Loss::Squared };
    let start = Vector3::new(2.5, -1.0, 2.0);
    let solution = solve(&problem, start, &[0], &SolveOptions::default()).unwrap();
    assert_eq!(solution.state.x, 2.5);
    let free_gradient = solution.equations.gradient.rows(1, 2).norm();
    // Converged to a step of 1e-7 σ, so the gradient is below 1e-7·√H ≈ 7e-6.
    assert!(free_gradient < 1e-5, "{free_gradient}");
    assert!(solve(&problem, start, &[3], &SolveOptions::default()).is_err());
}

#[test]
fn an_unseen_unknown_is_found_and_named() {
    // All points lie in one direction from the centre: only the sum of x and radius is observable.
    let points = vec![Vector2::new(5.0, -1.0); 10];
    let problem = CircleFit { points, sigma: 0.1, loss: Loss::Squared };
    let mut equations = NormalEquations::zeros(3);
    problem.linearize(&TRUTH, &mut equations);
    let information = Information::new(&equations.hessian, &[], 1e-6).unwrap();
    assert_eq!(information.rank(), 1);
    let null = information.null_space();
    assert_eq!(null.ncols(), 2);
    // x and radius are confounded, and y is free.
    let seen = Vector3::new(1.0, 0.0, 1.0).normalize();
    // The scaled eigenvectors of a 3×3 matrix of ones and zeros are exact to a few eps.
    assert!((null.transpose() * seen).norm() < 1e-12);
}

#[test]
fn covariance_root_whitens_the_information() {
    let problem = CircleFit { points: circle_points(50, 2.0), sigma: 0.1, loss: Loss::Squared };
    let mut equations = NormalEquations::zeros(3);
    problem.linearize(&TRUTH, &mut equations);
    let information = Information::new(&equations.hessian, &[], 1e-9).unwrap();
    let root = information.covariance_root();
    let whitened = root.transpose() * &equations.hessian * root;
    // cond(H) ≈ 1e3, so the identity holds to about 1e3 eps.
    assert!((whitened - nalgebra::DMatrix::identity(3, 3)).norm() < 1e-11);
}
