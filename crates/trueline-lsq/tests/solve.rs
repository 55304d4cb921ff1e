//! The solver step by step: accepted steps, damping, and termination.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use nalgebra::{DMatrix, DVector, Vector2, dvector};
use trueline_lsq::check::{gradient_error, numerical_jacobian};
use trueline_lsq::{LeastSquares, NormalEquations, Solution, SolveError, SolveOptions, Termination, solve};

/// Residuals of two unknowns with their Jacobian.
struct Residuals<F>(F);

impl<F: Fn(&Vector2<f64>) -> (DVector<f64>, DMatrix<f64>)> LeastSquares for Residuals<F> {
    type State = Vector2<f64>;

    fn dimension(&self) -> usize {
        2
    }

    fn retract(&self, state: &Self::State, step: &DVector<f64>) -> Self::State {
        state + step.fixed_rows::<2>(0)
    }

    fn cost(&self, state: &Self::State) -> f64 {
        0.5 * (self.0)(state).0.norm_squared()
    }

    fn linearize(&self, state: &Self::State, equations: &mut NormalEquations) {
        let (r, j) = (self.0)(state);
        equations.hessian += j.transpose() * &j;
        equations.gradient += j.transpose() * &r;
        equations.cost += 0.5 * r.norm_squared();
    }
}

/// (1 − x, 10 (y − x²)): a curved valley from (−1.2, 1) to (1, 1), where plain Gauss–Newton overshoots.
fn rosenbrock(p: &Vector2<f64>) -> (DVector<f64>, DMatrix<f64>) {
    let r = dvector![1.0 - p.x, 10.0 * (p.y - p.x * p.x)];
    (r, DMatrix::from_row_slice(2, 2, &[-1.0, 0.0, -20.0 * p.x, 10.0]))
}

/// Three nonzero residuals in units that differ by 1e6.
fn linear(p: &Vector2<f64>) -> (DVector<f64>, DMatrix<f64>) {
    let j = DMatrix::from_row_slice(3, 2, &[1e3, 0.0, 1e3, 1e-3, 0.0, 2e-3]);
    (&j * p - dvector![1.0, 3.0, 1.0], j)
}

fn decreases(solution: &Solution<Vector2<f64>>, cost_at: impl Fn(&Vector2<f64>) -> f64) {
    let mut growth = 2.0;
    for pair in solution.iterations.windows(2) {
        let (now, next) = (&pair[0], &pair[1]);
        assert_eq!(now.cost, cost_at(&now.state));
        if now.accepted {
            assert!(next.cost <= now.cost && now.gain_ratio > 0.0);
            // Madsen's rule.
            let factor = (1.0_f64 / 3.0).max(1.0 - (2.0 * now.gain_ratio - 1.0).powi(3));
            assert!((next.damping / (now.damping * factor) - 1.0).abs() < 1e-14);
            growth = 2.0;
        } else {
            assert_eq!((next.cost, next.state), (now.cost, now.state));
            assert_eq!(next.damping, (growth * now.damping).max(1e-3));
            growth *= 2.0;
        }
    }
}

#[test]
fn a_linear_problem_takes_one_step_and_a_look() {
    let solution = solve(&Residuals(linear), Vector2::zeros(), &[], &SolveOptions::default()).unwrap();
    // Normal equations by hand: 2x′ + y′ = 4, x′ + 5y′ = 5 with x′ = 1e3 x, y′ = 1e-3 y.
    let expected = Vector2::new(15.0 / 9.0 * 1e-3, 6.0 / 9.0 * 1e3);
    // The first step is too short by the damping of 1e-6, the second by 1e-6 of that.
    assert!((solution.state - expected).component_div(&expected).norm() < 1e-11, "{}", solution.state);
    assert!(matches!(
        solution.termination,
        Termination::StepConverged { .. } | Termination::CostConverged { .. }
    ));
    assert!(solution.iterations.len() <= 3);
    decreases(&solution, |p| Residuals(linear).cost(p));
    let first = &solution.iterations[0];
    assert!((first.gain_ratio - 1.0).abs() < 1e-5 && first.damping == 1e-6);
    // Its length in standard deviations: √(δᵀHδ) = |J δ|.
    let length = (linear(&expected).1 * expected).norm();
    assert!((first.step / length - 1.0).abs() < 1e-5, "{} {length}", first.step);
}

#[test]
fn a_curved_valley_is_followed_and_no_step_climbs() {
    let start = Vector2::new(-1.2, 1.0);
    let solution = solve(&Residuals(rosenbrock), start, &[], &SolveOptions::default()).unwrap();
    assert!((solution.state - Vector2::new(1.0, 1.0)).norm() < 1e-7, "{}", solution.state);
    assert!(solution.termination.is_converged());
    assert!(solution.iterations.iter().any(|step| !step.accepted), "Gauss-Newton's first step climbs");
    assert!(solution.iterations.len() < 40);
    decreases(&solution, |p| Residuals(rosenbrock).cost(p));
    // The equations belong to the returned state.
    let mut there = NormalEquations::zeros(2);
    Residuals(rosenbrock).linearize(&solution.state, &mut there);
    assert_eq!((there.hessian, there.gradient, there.cost), {
        let at = solution.equations;
        (at.hessian, at.gradient, at.cost)
    });
}

#[test]
fn held_unknowns_stay_and_what_nothing_depends_on_stays() {
    let start = Vector2::new(0.5, 1.0);
    let held = solve(&Residuals(rosenbrock), start, &[0], &SolveOptions::default()).unwrap();
    assert_eq!(held.state.x, 0.5);
    assert!((held.state.y - 0.25).abs() < 1e-9);
    let flat =
        |p: &Vector2<f64>| (dvector![p.x - 3.0, 1.0], DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 0.0, 0.0]));
    let free = solve(&Residuals(flat), start, &[], &SolveOptions::default()).unwrap();
    assert!((free.state - Vector2::new(3.0, 1.0)).norm() < 1e-9 && free.termination.is_converged());
}

#[test]
fn each_end_says_what_was_met() {
    let run = |options: SolveOptions| {
        solve(&Residuals(rosenbrock), Vector2::new(-1.2, 1.0), &[], &options).unwrap()
    };
    let few = run(SolveOptions { max_iterations: 4, ..SolveOptions::default() });
    assert_eq!(few.termination, Termination::IterationLimit { iterations: 4, threshold: 4 });
    assert!(!few.termination.is_converged() && few.iterations.len() == 4);
    let long = run(SolveOptions { step_threshold: 0.1, cost_threshold: 0.0, ..SolveOptions::default() });
    let Termination::StepConverged { step, threshold } = long.termination else {
        panic!("{}", long.termination)
    };
    assert!(step < 0.1 && threshold == 0.1 && step == long.iterations.last().unwrap().step);
    // A minimum with a nonzero cost: the decrease falls below a fraction of it.
    let options = SolveOptions { step_threshold: 0.0, cost_threshold: 1e-3, ..SolveOptions::default() };
    let solution = solve(&Residuals(linear), Vector2::zeros(), &[], &options).unwrap();
    let Termination::CostConverged { decrease, threshold } = solution.termination else {
        panic!("{}", solution.termination)
    };
    assert!(decrease <= 1e-3 && threshold == 1e-3);
    // A gradient with the wrong sign: no step lowers the cost.
    let wrong =
        |p: &Vector2<f64>| (dvector![p.x + 5.0, 1.0], DMatrix::from_row_slice(2, 2, &[-1.0, 0.0, 0.0, 0.0]));
    let options = SolveOptions { step_threshold: 0.0, ..SolveOptions::default() };
    let stuck = solve(&Residuals(wrong), Vector2::zeros(), &[], &options).unwrap();
    // Gauss–Newton would still go 5 standard deviations.
    let Termination::NoFurtherDecrease { damping, threshold, step } = stuck.termination else {
        panic!("{}", stuck.termination)
    };
    assert!(damping > 1e12 && threshold == 1e12 && (step - 5.0).abs() < 1e-12);
    assert!(!stuck.termination.is_converged() && stuck.state == Vector2::zeros());
    for (end, converged) in [(0.0099, true), (0.0101, false)] {
        let end = Termination::NoFurtherDecrease { damping: 2e12, threshold: 1e12, step: end };
        assert_eq!(end.is_converged(), converged);
    }
}

#[test]
fn an_invalid_start_is_an_error() {
    let nan = |_: &Vector2<f64>| (dvector![f64::NAN], DMatrix::zeros(1, 2));
    let refused = solve(&Residuals(nan), Vector2::zeros(), &[], &SolveOptions::default()).unwrap_err();
    assert_eq!(refused, SolveError::NotFiniteAtStart);
    let refused = solve(&Residuals(linear), Vector2::zeros(), &[2], &SolveOptions::default()).unwrap_err();
    assert_eq!(refused, SolveError::NoSuchUnknown { index: 2 });
    assert_eq!(refused.to_string(), "there is no unknown number 2 to hold fixed");
    let infinite = NormalEquations { cost: f64::INFINITY, ..NormalEquations::zeros(2) };
    assert!(!infinite.is_finite() && NormalEquations::zeros(2).is_finite());
}

#[test]
fn differences_are_exact_for_polynomials_of_degree_four() {
    let function =
        |x: &DVector<f64>| dvector![3.0 * x[0] + x[0].powi(4) - x[1].powi(3), 2.0 * x[1] + x[0] * x[1]];
    // At zero; the stencil cancels powers up to four, and the remainder is rounding: eps × 8 values / (12 × 0.5).
    let jacobian = numerical_jacobian(2, 0.5, function);
    let expected = DMatrix::from_row_slice(2, 2, &[3.0, 0.0, 0.0, 2.0]);
    assert!((jacobian - expected).abs().max() < 1e-14);
}

#[test]
fn the_check_measures_the_error_of_a_wrong_gradient() {
    let at = Vector2::new(0.3, -0.2);
    // The stencil's error is h⁴ times the fifth derivative of a polynomial of degree four, which is zero. Rounding remains: 1e-13/h.
    let steps = dvector![1e-3, 1e-3];
    assert!(gradient_error(&Residuals(rosenbrock), &at, &steps) < 1e-9);
    // The second derivative by y is 5 % too large, so the gradient there is off by 0.5 × r₂, in units of √H₂₂ = 10.5.
    let wrong = |p: &Vector2<f64>| {
        let (r, mut j) = rosenbrock(p);
        j[(1, 1)] *= 1.05;
        (r, j)
    };
    let expected = 0.5 * rosenbrock(&at).0[1].abs() / 10.5;
    let found = gradient_error(&Residuals(wrong), &at, &steps);
    assert!((found - expected).abs() < 1e-9, "{found} {expected}");
}
