//! Why a solve ends: each threshold from both sides, after accepted and rejected steps, and without a possible step.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use nalgebra::{DMatrix, DVector, dmatrix, dvector};
use trueline_lsq::{LeastSquares, NormalEquations, Solution, SolveOptions, Termination, solve};

/// Arbitrary sums at any state, as a user-defined problem may return them, correct or wrong.
struct Sums<F> {
    unknowns: usize,
    at: F,
}

impl<F: Fn(&DVector<f64>) -> (DMatrix<f64>, DVector<f64>, f64)> LeastSquares for Sums<F> {
    type State = DVector<f64>;

    fn dimension(&self) -> usize {
        self.unknowns
    }

    fn retract(&self, state: &Self::State, step: &DVector<f64>) -> Self::State {
        state + step
    }

    fn cost(&self, state: &Self::State) -> f64 {
        (self.at)(state).2
    }

    fn linearize(&self, state: &Self::State, equations: &mut NormalEquations) {
        let (hessian, gradient, cost) = (self.at)(state);
        equations.hessian += hessian;
        equations.gradient += gradient;
        equations.cost += cost;
    }
}

/// The residual x, with `told` instead of its derivative, beside a constant residual `rest`.
fn slope_told_as(told: f64, rest: f64) -> impl LeastSquares<State = DVector<f64>> {
    let at = move |x: &DVector<f64>| {
        let cost = 0.5 * (x[0] * x[0] + rest * rest);
        (dmatrix![told * told], dvector![told * x[0]], cost)
    };
    Sums { unknowns: 1, at }
}

/// No thresholds, except those stated.
const EXACT: SolveOptions =
    SolveOptions { max_iterations: 100, initial_damping: 0.0, step_threshold: 0.0, cost_threshold: 0.0 };

fn from(
    problem: &impl LeastSquares<State = DVector<f64>>,
    x: f64,
    options: SolveOptions,
) -> Solution<DVector<f64>> {
    solve(problem, dvector![x], &[], &options).unwrap()
}

#[test]
fn damping_is_a_part_of_the_diagonal_and_lengths_are_standard_deviations() {
    let right = slope_told_as(2.0, 1.0);
    let once = from(&right, 3.0, SolveOptions { max_iterations: 1, initial_damping: 3.0, ..EXACT });
    // H = 4 damped to 16, g = 6: a step of −0.375, which is 0.75 standard deviations.
    assert_eq!((once.state[0], once.iterations[0].step), (2.625, 0.75));
    assert_eq!((once.iterations[0].cost, once.iterations[0].accepted), (5.0, true));
    // Promised: 6 × 0.375 − ½ 0.375 × 4 × 0.375. Actual: ½ (3² − 2.625²).
    assert_eq!(once.iterations[0].gain_ratio, 1.0546875 / 1.96875);
}

#[test]
fn a_step_that_was_taken_ends_it_below_the_threshold_and_not_at_it() {
    let right = slope_told_as(1.0, 1.0);
    // The step is exactly 3. The next one is zero and is not taken.
    let at = from(&right, 3.0, SolveOptions { step_threshold: 3.0, ..EXACT });
    assert_eq!(at.termination, Termination::StepConverged { step: 0.0, threshold: 3.0 });
    assert_eq!(at.iterations.len(), 2);
    let below = from(&right, 3.0, SolveOptions { step_threshold: 3.5, ..EXACT });
    assert_eq!(below.termination, Termination::StepConverged { step: 3.0, threshold: 3.5 });
    assert_eq!((below.iterations.len(), below.state[0]), (1, 0.0));
}

#[test]
fn at_the_minimum_nothing_is_promised_and_nothing_is_gained() {
    let there = from(&slope_told_as(1.0, 1.0), 0.0, EXACT);
    // A threshold of zero is never reached, but the cost cannot decrease further.
    assert_eq!(there.termination, Termination::CostConverged { decrease: 0.0, threshold: 1e-13 });
    let only = &there.iterations[0];
    assert_eq!((there.iterations.len(), only.gain_ratio, only.accepted), (1, 0.0, false));
}

#[test]
fn a_small_decrease_ends_it_only_after_a_step_that_kept_its_promise() {
    let options = SolveOptions { cost_threshold: 0.5, max_iterations: 3, ..EXACT };
    // With the derivative t, the step leads from x to x (1 − 1/t): 0.53 keeps 0.214 of its promise, 0.51 keeps 0.077.
    let kept = from(&slope_told_as(0.53, 0.0), 1.0, options);
    let Termination::CostConverged { decrease, threshold } = kept.termination else {
        panic!("{}", kept.termination)
    };
    let (before, after) = (kept.iterations[0].cost, kept.equations.cost);
    assert_eq!((decrease, threshold, kept.iterations.len()), ((before - after) / before, 0.5, 1));
    let broken = from(&slope_told_as(0.51, 0.0), 1.0, options);
    assert_eq!(broken.termination, Termination::IterationLimit { iterations: 3, threshold: 3 });
    assert!(broken.iterations.iter().all(|step| step.accepted && step.gain_ratio < 0.1));
    // A large one does not.
    let large = from(&slope_told_as(1.0, 0.0), 1.0, SolveOptions { max_iterations: 1, ..options });
    assert_eq!(large.termination, Termination::IterationLimit { iterations: 1, threshold: 1 });
}

#[test]
fn a_step_that_was_not_taken_ends_it_if_it_was_too_short_to_matter() {
    // The wrong direction: from 5 to 10.
    let short = from(&slope_told_as(-1.0, 1.0), 5.0, SolveOptions { step_threshold: 6.0, ..EXACT });
    assert_eq!(short.termination, Termination::StepConverged { step: 5.0, threshold: 6.0 });
    assert_eq!((short.iterations.len(), short.iterations[0].accepted, short.state[0]), (1, false, 5.0));
    // At the threshold it continues with a shorter one.
    let at = from(&slope_told_as(-1.0, 1.0), 5.0, SolveOptions { step_threshold: 5.0, ..EXACT });
    let Termination::StepConverged { step, threshold } = at.termination else { panic!("{}", at.termination) };
    assert!((step - 5.0 / 1.001).abs() < 1e-14 && threshold == 5.0 && at.iterations.len() == 2, "{step}");
}

#[test]
fn a_step_whose_promise_is_lost_in_rounding_is_taken_unless_it_is_seen_to_lose_and_ends_it() {
    // The wrong direction: ½ 1e-14 was promised for a cost of ½ × 9.
    let lost = from(&slope_told_as(-1.0, 3.0), 1e-7, EXACT);
    let Termination::CostConverged { decrease, threshold } = lost.termination else {
        panic!("{}", lost.termination)
    };
    assert!((decrease / (1e-14 / 9.0) - 1.0).abs() < 1e-12 && threshold == 1e-13, "{decrease}");
    // The cost does not show that it was the wrong one: it rises by 1.5e-14 of 4.5.
    assert_eq!((lost.iterations.len(), lost.iterations[0].accepted, lost.state[0]), (1, true, 2e-7));
    // A step that promises no more and visibly loses is rejected.
    let jump = |x: &DVector<f64>| {
        let cost = if x[0] == 1e-7 { 4.5 } else { 4.5 + 1e-11 };
        (dmatrix![1.0], dvector![x[0]], cost)
    };
    let jumped = from(&Sums { unknowns: 1, at: jump }, 1e-7, EXACT);
    assert!(matches!(jumped.termination, Termination::CostConverged { .. }), "{}", jumped.termination);
    assert_eq!((jumped.iterations.len(), jumped.iterations[0].accepted, jumped.state[0]), (1, false, 1e-7));
    // An increase a hundred times larger is visible. The step is shortened until the increase is lost in rounding as well: with a damping of λ it is
    // about 1/λ of 1e-12.
    let seen = from(&slope_told_as(-1.0, 1.0), 1e-6, EXACT);
    assert!(matches!(seen.termination, Termination::CostConverged { .. }), "{}", seen.termination);
    let tried: Vec<f64> = seen.iterations.iter().map(|step| step.damping).collect();
    assert_eq!(tried, [0.0, 1e-3, 4e-3, 3.2e-2, 0.512, 0.512 * 32.0, 0.512 * 32.0 * 64.0]);
}

#[test]
fn it_is_given_up_beyond_the_largest_damping_and_not_at_it() {
    let options = SolveOptions { initial_damping: 5e11, ..EXACT };
    // Twice 5e11 is the limit and is tried. Four times that is beyond it.
    let stuck = from(&slope_told_as(-1.0, 1.0), 5.0, options);
    assert_eq!(
        stuck.termination,
        Termination::NoFurtherDecrease { damping: 4e12, threshold: 1e12, step: 5.0 }
    );
    assert_eq!(stuck.iterations.len(), 2);
}

#[test]
fn a_matrix_that_is_not_positive_definite_is_damped_until_it_is() {
    // Eigenvalues 3 and −1: positive definite from a damping of 1 on. The cost is a paraboloid.
    let at = |x: &DVector<f64>| (dmatrix![1.0, 2.0; 2.0, 1.0], dvector![x[0], x[1]], 0.5 * x.norm_squared());
    let options = SolveOptions { max_iterations: 1, initial_damping: 1e-6, ..EXACT };
    let start = dvector![1.0, 1.0];
    let found = solve(&Sums { unknowns: 2, at }, start.clone(), &[], &options).unwrap();
    // At least 1e-3, then times 4, 8, 16, 32.
    let damping = 1e-3 * 2_f64.powi(2 + 3 + 4 + 5);
    assert_eq!((found.iterations.len(), found.iterations[0].damping), (1, damping));
    let step = -1.0 / (3.0 + damping);
    // Two sums and a root.
    assert!((&found.state - &start - dvector![step, step]).norm() < 1e-15, "{}", found.state);

    let never =
        |x: &DVector<f64>| (dmatrix![1.0, 1e30; 1e30, 1.0], dvector![x[0], x[1]], 0.5 * x.norm_squared());
    let given_up = |initial_damping: f64| {
        let options = SolveOptions { initial_damping, ..EXACT };
        let solution = solve(&Sums { unknowns: 2, at: never }, start.clone(), &[], &options).unwrap();
        assert!(solution.iterations.is_empty() && solution.state == start);
        solution.termination
    };
    // 1e-3 × 2^(2 + 3 + … + 9) = 1.8e10 is tried, × 2^10 is not, also from no damping at all; no step is left to report.
    let end = |damping| Termination::NoFurtherDecrease { damping, threshold: 1e12, step: f64::INFINITY };
    assert_eq!([given_up(1e-6), given_up(0.0)], [end(1e-3 * 2_f64.powi(54)); 2]);
    assert_eq!(given_up(5e11), end(4e12));
    assert!(!end(4e12).is_converged());
}

#[test]
fn unknowns_without_residuals_do_not_move() {
    let at = |_: &DVector<f64>| (DMatrix::zeros(2, 2), DVector::zeros(2), 1.0);
    let start = dvector![1.0, -2.0];
    let found = solve(&Sums { unknowns: 2, at }, start.clone(), &[], &SolveOptions::default()).unwrap();
    assert_eq!(found.termination, Termination::StepConverged { step: 0.0, threshold: 1e-7 });
    assert_eq!(found.state, start);
}

#[test]
fn a_state_of_which_not_all_is_finite_is_not_gone_to() {
    // A lower cost with undefined derivatives.
    for broken in 0..2 {
        let at = move |x: &DVector<f64>| {
            let outside = if x[0] < 1.0 { f64::NAN } else { 1.0 };
            let (hessian, gradient) = if broken == 0 { (1.0, outside) } else { (outside, 1.0) };
            (dmatrix![hessian], dvector![gradient * x[0]], 0.5 * x[0] * x[0])
        };
        let found = from(&Sums { unknowns: 1, at }, 1.5, SolveOptions { max_iterations: 5, ..EXACT });
        assert!(!found.iterations[0].accepted && found.state[0] >= 1.0, "{}", found.state);
        assert!(found.equations.is_finite());
    }
    let finite = NormalEquations::zeros(1);
    assert!(finite.is_finite());
    for part in 0..3 {
        let mut broken = finite.clone();
        let number = [&mut broken.cost, &mut broken.gradient[0], &mut broken.hessian[(0, 0)]];
        *number.into_iter().nth(part).unwrap() = f64::INFINITY;
        assert!(!broken.is_finite(), "{part}");
    }
}

#[test]
fn each_end_has_its_sentence() {
    let sentences = [
        (
            Termination::StepConverged { step: 3.2e-9, threshold: 1e-7 },
            "converged: last step 3.2e-9 σ, below 1e-7",
        ),
        (
            Termination::CostConverged { decrease: 4.5e-15, threshold: 1e-14 },
            "converged: relative cost change 4.5e-15, below 1e-14",
        ),
        (
            Termination::NoFurtherDecrease { damping: 4e12, threshold: 1e12, step: 5.25 },
            "no further decrease: damping 4e12 passed 1e12, step left over 5.2e0 σ",
        ),
        (Termination::IterationLimit { iterations: 4, threshold: 4 }, "stopped at the limit of 4 iterations"),
    ];
    for (end, sentence) in sentences {
        assert_eq!(end.to_string(), sentence);
    }
    // At 0.01 σ the remainder is no longer far below the data's resolution.
    let left = |step| Termination::NoFurtherDecrease { damping: 4e12, threshold: 1e12, step }.is_converged();
    assert_eq!((left(0.009), left(0.01)), (true, false));
}

/// H says 1 but the cost bends by 0.9, so every Gauss–Newton step leaves a tenth. The gain of the first step shows it, and
/// the second arrives.
#[test]
fn a_step_that_falls_short_tells_how_much_longer_the_next_one_is() {
    let bent = |curvature: f64| Sums {
        unknowns: 1,
        at: move |x: &DVector<f64>| {
            let cost = 1.0 + 0.5 * curvature * x[0] * x[0];
            (dmatrix![1.0], dvector![curvature * x[0]], cost)
        },
    };
    let two = SolveOptions { max_iterations: 2, ..EXACT };
    // Rounding of a cost of about one, which determines the curvature.
    assert!(from(&bent(0.9), 0.5, two).state[0].abs() < 1e-14);
    assert!((from(&bent(0.9), 0.5, SolveOptions { max_iterations: 1, ..two }).state[0] - 0.05).abs() < 1e-15);
    // Outside the range the loss is not the cause: plain Gauss–Newton, with errors of 0.3² and 0.5² of the first.
    assert!((from(&bent(0.7), 0.5, two).state[0] - 0.045).abs() < 1e-15);
    assert!((from(&bent(1.5), 0.5, two).state[0] - 0.125).abs() < 1e-15);
    assert!((from(&bent(0.995), 0.5, two).state[0] - 1.25e-5).abs() < 1e-15);
    // A step of several standard deviations gives no curvature.
    assert!((from(&bent(0.9), 3.0, two).state[0] - 0.03).abs() < 1e-15);
    // If the promise is lost in the sum's rounding, nothing is measured.
    let high = |x: &DVector<f64>| {
        let cost = 1e12 + 0.45 * x[0] * x[0];
        (dmatrix![1.0], dvector![0.9 * x[0]], cost)
    };
    let high = Sums { unknowns: 1, at: high };
    assert!((from(&high, 0.5, two).state[0] - 0.005).abs() < 1e-15);
}
