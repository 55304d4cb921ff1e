//! Tests the fast sums against the plain loop.

use nalgebra::{DVector, Vector3};
use proptest::prelude::*;
use trueline_geometry::{se3, so3};
use trueline_lsq::{LeastSquares, Loss, NormalEquations};
use trueline_method::input::noise_levels::NoiseLevels;
use trueline_method::input::observations::{self, Observation, Observations};
use trueline_method::input::shape_prior::ShapePrior;
use trueline_method::input::timestamps::Sampling;
use trueline_method::problem::line_problem::{Criterion, LineProblem};
use trueline_method::problem::scalar_sums::OneByOne;
use trueline_method::problem::usable::UsableObservations;
use trueline_method::solve::seam_chart::{with_bows, with_shape};
use trueline_method::{Config, Parameters, ResidualKind};
use trueline_sim::{Preset, random_cell, simulate};

const LOSSES: [Loss; 5] = [
    Loss::Squared,
    Loss::Huber { scale: 1.3 },
    Loss::Cauchy { scale: 2.0 },
    Loss::GemanMcClure { scale: 2.5 },
    Loss::Tukey { scale: 6.0 },
];

fn cell(preset: Preset, seed: u64, residual: ResidualKind) -> (Observations, Parameters) {
    let mut scenario = random_cell(&preset.scenario(), seed, 0.5);
    scenario.timing.duration_s = 4.0;
    scenario.disturbance.outlier_fraction = 0.1;
    let recording = simulate(&scenario, seed).unwrap();
    let sampling = Sampling::of(&recording, observations::origin_ns(&recording));
    let observed =
        observations::observe(&recording, &sampling, &Config { residual, ..Config::default() }).unwrap();
    let truth = recording.truth.unwrap();
    let at = Parameters::straight(&truth.parameters, truth.lines);
    (observed, at)
}

fn assert_alike(problem: &LineProblem<'_>, at: &Parameters) {
    let plain = OneByOne(problem);
    let [mut fast_sums, mut plain_sums] = [0, 1].map(|_| NormalEquations::zeros(problem.dimension()));
    problem.linearize(at, &mut fast_sums);
    plain.linearize(at, &mut plain_sums);
    // Sums of n settings in another order: √n eps of the largest partial sum, 100 eps for a few thousand samples; each
    // term itself is rounded dozens of times. An entry is measured against √(H_ii H_jj), which bounds it. If the line
    // meets the sheet at a grazing angle, its sine is a difference of numbers of 1, and everything is divided by it,
    // its derivative by its square.
    let tolerance = 1e-12 * (0.1 / smallest_sine(problem, at)).powi(2).max(1.0);
    // For a redescending loss, weights are differences of numbers near 1. They are accurate to 1e-12 of 1, not of themselves, so an entry is
    // compared with the unweighted one.
    let mut unweighted = NormalEquations::zeros(problem.dimension());
    let squared = problem.with_loss(Loss::Squared);
    OneByOne(&squared).linearize(at, &mut unweighted);
    let scale = unweighted.hessian.diagonal().map(f64::sqrt);
    // Residuals are differences of positions of 2 m. They are rounded to 2 m × eps × a dozen operations = 5e-15 m and whitened. Their errors move
    // the gradient by at most √H_ii times their norm.
    let sharpest = problem.whiteners.iter().flat_map(|w| w.0).map(|w| f64::from(w.abs())).fold(0.0, f64::max);
    let of_one = 5e-15 * sharpest;
    let rounding = of_one * (problem.list.len() as f64).sqrt();
    // A weight changes with its residual by less than its largest slope, 0.77 a standard deviation for the narrowest of these losses.
    let of_weight = if problem.loss == Loss::Squared { 0.0 } else { of_one };
    for i in 0..scale.len() {
        for j in 0..scale.len() {
            let off = (fast_sums.hessian[(i, j)] - plain_sums.hessian[(i, j)]).abs();
            let bound = (tolerance + of_weight) * scale[i] * scale[j];
            assert!(off <= bound, "H {i} {j}: {off:e}, at most {bound:e}");
        }
        let off = (fast_sums.gradient[i] - plain_sums.gradient[i]).abs();
        assert!(off <= scale[i] * (tolerance * (2.0 * plain_sums.cost).sqrt() + rounding), "g {i}: {off:e}");
    }
    for fast in [fast_sums.cost, problem.cost(at)] {
        let off = (fast - plain_sums.cost).abs();
        assert!(off <= tolerance * plain_sums.cost + rounding * (2.0 * plain_sums.cost).sqrt(), "{off:e}");
    }
    assert!((plain.cost(at) / plain_sums.cost - 1.0).abs() < 1e-12);
}

/// Sine of the smallest angle at which a line meets the sheet, where it matters.
fn smallest_sine(problem: &LineProblem<'_>, at: &Parameters) -> f64 {
    let sine = |o: &Observation| {
        let normal = problem.observations.sheet.plane().normal();
        let placement = problem.placement(o, at)?;
        let sine = (placement.base_from_camera().rotation * normal.into_inner())
            .dot(&at.lines[o.line as usize].direction());
        (sine.abs() >= trueline_model::sheet_residual::MIN_SINE).then_some(sine.abs())
    };
    problem.list.iter().filter_map(sine).fold(1.0, f64::min)
}

fn moved(at: &Parameters, by: f64, seed: u64) -> Parameters {
    let step = DVector::from_fn(at.dimension(), |k, _| by * ((k as f64 + 1.7) * (seed as f64 + 0.3)).sin());
    at.retract(&step)
}

/// The same cell with bows of a few tenths of a millimetre and optionally a shape of some percent.
fn bowed(observed: &Observations, at: &Parameters, shaped: bool) -> Parameters {
    let mut at = with_bows(observed, &observed.list, at.clone());
    for (k, curvature) in at.curvatures.iter_mut().enumerate() {
        curvature.bow_m = [3e-4 - 1e-4 * k as f64, -2e-4];
    }
    if shaped {
        at = with_shape(observed, at);
        let step = nalgebra::SVector::from([0.01, -0.02, 0.013, 0.3, -0.4]);
        at.shape = at.shape.map(|shape| shape.retract(&step));
    }
    at
}

fn shape_prior() -> Option<ShapePrior> {
    let sigma = [5e-3, 5e-3, 5e-3, 0.15, 0.15_f64];
    let mut information = nalgebra::SMatrix::<f64, 5, 5>::from_diagonal(&sigma.map(|s| s.powi(-2)).into());
    information[(0, 1)] = 1e4;
    information[(1, 0)] = 1e4;
    Some(ShapePrior { information })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn sums_are_those_of_the_plain_loop(
        seed in 0u64..1000,
        preset in prop::sample::select(vec![Preset::Quick, Preset::TwoLines, Preset::Profiler]),
        loss in prop::sample::select(LOSSES.to_vec()),
        residual in prop::sample::select(vec![ResidualKind::Sheet, ResidualKind::PointToLine]),
        by in prop::sample::select(vec![0.0, 1e-3, 0.05]),
        // Lists whose length is no multiple of four.
        skipped in 0usize..7,
    ) {
        let (observed, truth) = cell(preset, seed, residual);
        let at = moved(&truth, by, seed);
        let noise = NoiseLevels { robot_sigma_m: 2e-5, stamp_sigma_s: 1e-4, factor: 1.3 };
        let list: &[Observation] = &observed.list[skipped..];
        let criterion = Criterion { residual, loss };
        assert_alike(&LineProblem::new(&observed, list, criterion, &noise, &truth), &at);
        assert_alike(&LineProblem::coarse(&observed, list, loss, &noise, at.unknowns()), &at);
    }

    #[test]
    fn sums_with_bows_and_shape_are_those_of_the_plain_loop(
        seed in 0u64..1000,
        preset in prop::sample::select(vec![Preset::Quick, Preset::TwoLines, Preset::Profiler]),
        loss in prop::sample::select(LOSSES.to_vec()),
        shaped in any::<bool>(),
        skipped in 0usize..7,
    ) {
        let (observed, truth) = cell(preset, seed, ResidualKind::Sheet);
        let at = bowed(&observed, &moved(&truth, 1e-3, seed), shaped);
        let noise = NoiseLevels { robot_sigma_m: 2e-5, stamp_sigma_s: 1e-4, factor: 1.3 };
        let list: &[Observation] = &observed.list[skipped..];
        let criterion = Criterion { residual: ResidualKind::Sheet, loss };
        let problem = LineProblem::new(&observed, list, criterion, &noise, &at).with_shape_prior(shape_prior());
        assert_alike(&problem, &at);
    }

    /// A wrong sign in any column, also of the prior, gives the gradient of another function.
    #[test]
    fn the_gradient_is_the_derivative_of_the_cost(seed in 0u64..1000, shaped in any::<bool>()) {
        let (observed, truth) = cell(Preset::TwoLines, seed, ResidualKind::Sheet);
        let at = bowed(&observed, &moved(&truth, 1e-3, seed), shaped);
        let noise = NoiseLevels { robot_sigma_m: 2e-5, stamp_sigma_s: 1e-4, factor: 1.0 };
        // No observation leaves the list within the steps.
        let list = UsableObservations::within(&observed, at.time_offset_s, 0.01);
        let criterion = Criterion { residual: ResidualKind::Sheet, loss: Loss::Squared };
        let problem = LineProblem::new(&observed, list.of(&observed), criterion, &noise, &at)
            .with_shape_prior(shape_prior());
        let mut sums = NormalEquations::zeros(problem.dimension());
        problem.linearize(&at, &mut sums);
        // The path has a kink at each of the robot's samples, so the time offset has its oracle elsewhere: in the tests
        // of the model.
        for k in 1..problem.dimension() {
            let step = 1e-2 / sums.hessian[(k, k)].sqrt();
            let cost = |multiple: f64| {
                let mut along = DVector::zeros(problem.dimension());
                along[k] = multiple * step;
                problem.cost(&at.retract(&along))
            };
            let slope = (cost(-2.0) - cost(2.0) + (cost(1.0) - cost(-1.0)) * 8.0) / 12.0;
            // In steps of 1e-2 σ a cost is quadratic up to 1e-4 of its slope. A cost of c is rounded at 1e-16 c, a few hundred times over.
            let off = (slope - sums.gradient[k] * step).abs();
            prop_assert!(off < 1e-4 * (sums.gradient[k] * step).abs() + 1e-13 * sums.cost + 1e-6, "{} {}", k, off);
        }
    }

    #[test]
    fn whiteners_are_those_of_the_covariance(seed in 0u64..1000) {
        let (observed, truth) = cell(Preset::TwoLines, seed, ResidualKind::Sheet);
        let noise = NoiseLevels { robot_sigma_m: 3e-5, stamp_sigma_s: 1e-4, factor: 0.7 };
        let criterion = Criterion { residual: ResidualKind::Sheet, loss: Loss::Squared };
        let problem = LineProblem::new(&observed, &observed.list, criterion, &noise, &truth);
        for (o, whitener) in problem.selected() {
            let Some(placement) = problem.placement(o, &truth) else { continue };
            let line = &truth.lines[o.line as usize];
            let parts = trueline_model::sheet_residual::linearize(
                &placement, &observed.sheet, &o.point_in_camera, line).unwrap();
            let by_time = parts.by_links(&placement).column(0).into_owned();
            let covariance = noise.covariance(o.covariance, &parts.by_shift(), &by_time);
            let w = whitener.matrix();
            // Single precision: 6e-8 of each of its three numbers, doubled by the product.
            let off = (w * covariance * w.transpose() - nalgebra::Matrix2::identity()).norm();
            prop_assert!(off < 1e-6, "{}", off);
        }
    }
}

/// Fast attitude changes between slow samples do not use the series.
#[test]
fn large_turns_between_samples() {
    let (mut observed, truth) = cell(Preset::Quick, 3, ResidualKind::Sheet);
    let times: Vec<f64> = (0..40).map(|k| f64::from(k) * 0.1).collect();
    let wrist = |t: f64| so3::exp(&(Vector3::new(0.3, 0.2, 1.0) * t * 9.0));
    let poses: Vec<_> =
        times.iter().map(|t| se3::from_parts(wrist(*t), Vector3::new(1.0 + 0.1 * t, 0.0, 0.5))).collect();
    observed.robot.trajectory = trueline_geometry::Trajectory::new(times, &poses).unwrap();
    let noise = NoiseLevels { robot_sigma_m: 0.0, stamp_sigma_s: 0.0, factor: 1.0 };
    let problem = LineProblem::coarse(
        &observed,
        &observed.list,
        Loss::GemanMcClure { scale: 1e3 },
        &noise,
        truth.unknowns(),
    );
    assert_alike(&problem, &truth);
}

/// Observations outside the recording, in a gap, and a line along the sheet have the cost of the plain loop.
#[test]
fn observations_that_cannot_be_placed() {
    let (observed, truth) = cell(Preset::Quick, 4, ResidualKind::Sheet);
    let noise = NoiseLevels { robot_sigma_m: 0.0, stamp_sigma_s: 0.0, factor: 1.0 };
    let problem = LineProblem::coarse(
        &observed,
        &observed.list,
        Loss::GemanMcClure { scale: 30.0 },
        &noise,
        truth.unknowns(),
    );
    let late = Parameters { time_offset_s: truth.time_offset_s + 2.0, ..truth.clone() };
    assert_alike(&problem, &late);
    let squared = problem.squared_residuals(&late).len();
    assert!(squared > 10 && squared < observed.list.len() - 10, "{squared}");
    let plain = |at: &Parameters| observed.list.iter().filter(|o| problem.residual(o, at).is_some()).count();
    assert_eq!(squared, plain(&late));
}

use crate::large_scan;

/// Two or five threads give the same bytes as one.
#[test]
fn threads_change_nothing() {
    let (observed, at) = large_scan::of_features(100_001);
    let criterion = Criterion { residual: ResidualKind::Sheet, loss: Loss::Tukey { scale: 8.0 } };
    let sums = |threads: usize| {
        let problem = LineProblem::new(&observed, &observed.list, criterion, &large_scan::NOISE, &at)
            .with_threads(threads);
        let mut sums = NormalEquations::zeros(problem.dimension());
        problem.linearize(&at, &mut sums);
        (sums.hessian, sums.gradient, sums.cost, problem.cost(&at))
    };
    let alone = sums(1);
    assert!(sums(2) == alone && sums(5) == alone);
    // Every chunk is used exactly once.
    assert_alike(&LineProblem::new(&observed, &observed.list, criterion, &large_scan::NOISE, &at), &at);
}
