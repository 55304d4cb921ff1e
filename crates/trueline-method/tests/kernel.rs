//! The fast sums are those of the plain loop.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use nalgebra::{DVector, Vector3};
use proptest::prelude::*;
use trueline_geometry::{se3, so3};
use trueline_lsq::{LeastSquares, Loss, NormalEquations};
use trueline_method::input::noise_levels::NoiseLevels;
use trueline_method::input::observations::{self, Observation, Observations};
use trueline_method::input::timestamps::Sampling;
use trueline_method::problem::line_problem::{Criterion, LineProblem};
use trueline_method::problem::scalar_sums::OneByOne;
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
    let at = Parameters {
        time_offset_s: truth.parameters.time_offset_s,
        tool_from_camera: truth.parameters.tool_from_camera,
        lines: truth.lines,
    };
    (observed, at)
}

fn assert_alike(problem: &LineProblem<'_>, at: &Parameters) {
    let plain = OneByOne(problem);
    let [mut fast_sums, mut plain_sums] = [0, 1].map(|_| NormalEquations::zeros(problem.dimension()));
    problem.linearize(at, &mut fast_sums);
    plain.linearize(at, &mut plain_sums);
    // Sums of n settings in another order: √n eps of the largest partial sum, 100 eps for a few thousand samples; each
    // term itself is rounded a few dozen times. An entry is measured against √(H_ii H_jj), which bounds it. Where the
    // line meets the sheet at a grazing angle, its sine is a difference of numbers of 1, and everything is divided by
    // it, its derivative by its square.
    let tolerance = 1e-12 * (0.1 / smallest_sine(problem, at)).powi(2).max(1.0);
    // Weights are differences of numbers of 1 where a loss redescends: they are right to 1e-12 of 1, not of themselves,
    // so an entry is measured against the one without weights.
    let mut unweighted = NormalEquations::zeros(problem.dimension());
    let squared = LineProblem {
        observations: problem.observations,
        list: problem.list,
        whiteners: problem.whiteners.clone(),
        residual: problem.residual,
        loss: Loss::Squared,
        prior: None,
        threads: 1,
    };
    OneByOne(&squared).linearize(at, &mut unweighted);
    let scale = unweighted.hessian.diagonal().map(f64::sqrt);
    // Residuals are differences of positions of 2 m, which are rounded to 2 m × eps × a dozen operations = 5e-15 m,
    // and whitened; their errors move the gradient by no more than √H_ii times their norm.
    let sharpest = problem.whiteners.iter().flat_map(|w| w.0).map(|w| f64::from(w.abs())).fold(0.0, f64::max);
    let rounding = 5e-15 * sharpest * (problem.list.len() as f64).sqrt();
    for i in 0..scale.len() {
        for j in 0..scale.len() {
            let off = (fast_sums.hessian[(i, j)] - plain_sums.hessian[(i, j)]).abs();
            assert!(off <= tolerance * scale[i] * scale[j], "H {i} {j}: {off:e}");
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

/// Sine of the smallest angle at which a line meets the sheet where that counts.
fn smallest_sine(problem: &LineProblem<'_>, at: &Parameters) -> f64 {
    let mut hint = 0;
    let sine = |o: &Observation| {
        let normal = problem.observations.sheet.plane().normal();
        let placement = problem.placement(o, at, &mut hint)?;
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

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn sums_are_those_of_the_plain_loop(
        seed in 0u64..1000,
        preset in prop::sample::select(vec![Preset::Quick, Preset::TwoLines, Preset::Profiler]),
        loss in prop::sample::select(LOSSES.to_vec()),
        residual in prop::sample::select(vec![ResidualKind::Sheet, ResidualKind::PointToLine]),
        by in prop::sample::select(vec![0.0, 1e-3, 0.05]),
        // Lists that are no multiple of four.
        skipped in 0usize..7,
    ) {
        let (observed, truth) = cell(preset, seed, residual);
        let at = moved(&truth, by, seed);
        let noise = NoiseLevels { robot_sigma_m: 2e-5, stamp_sigma_s: 1e-4, factor: 1.3 };
        let list: &[Observation] = &observed.list[skipped..];
        let criterion = Criterion { residual, loss };
        assert_alike(&LineProblem::new(&observed, list, criterion, &noise, &truth), &at);
        assert_alike(&LineProblem::coarse(&observed, list, loss, &noise), &at);
    }

    #[test]
    fn whiteners_are_those_of_the_covariance(seed in 0u64..1000) {
        let (observed, truth) = cell(Preset::TwoLines, seed, ResidualKind::Sheet);
        let noise = NoiseLevels { robot_sigma_m: 3e-5, stamp_sigma_s: 1e-4, factor: 0.7 };
        let criterion = Criterion { residual: ResidualKind::Sheet, loss: Loss::Squared };
        let problem = LineProblem::new(&observed, &observed.list, criterion, &noise, &truth);
        let mut hint = 0;
        for (o, whitener) in problem.selected() {
            let Some(placement) = problem.placement(o, &truth, &mut hint) else { continue };
            let line = &truth.lines[o.line as usize];
            let (jacobian, onto_sheet) = trueline_model::sheet_residual::linearize(
                &placement, &observed.sheet, &o.point_in_camera, line).unwrap();
            let covariance = noise.covariance(o.covariance, &onto_sheet, &jacobian.d_time_offset);
            let w = whitener.matrix();
            // Single precision: 6e-8 of each of its three numbers, doubled by the product.
            let off = (w * covariance * w.transpose() - nalgebra::Matrix2::identity()).norm();
            prop_assert!(off < 1e-6, "{}", off);
        }
    }
}

/// Fast attitude changes between slow samples take the long way round the series.
#[test]
fn large_turns_between_samples() {
    let (mut observed, truth) = cell(Preset::Quick, 3, ResidualKind::Sheet);
    let times: Vec<f64> = (0..40).map(|k| f64::from(k) * 0.1).collect();
    let wrist = |t: f64| so3::exp(&(Vector3::new(0.3, 0.2, 1.0) * t * 9.0));
    let poses: Vec<_> =
        times.iter().map(|t| se3::from_parts(wrist(*t), Vector3::new(1.0 + 0.1 * t, 0.0, 0.5))).collect();
    observed.robot.trajectory = trueline_geometry::Trajectory::new(times, &poses).unwrap();
    let noise = NoiseLevels { robot_sigma_m: 0.0, stamp_sigma_s: 0.0, factor: 1.0 };
    let problem = LineProblem::coarse(&observed, &observed.list, Loss::GemanMcClure { scale: 1e3 }, &noise);
    assert_alike(&problem, &truth);
}

/// Observations beyond the recording, in a gap, and a line along the sheet cost what the plain loop says.
#[test]
fn what_cannot_be_placed() {
    let (observed, truth) = cell(Preset::Quick, 4, ResidualKind::Sheet);
    let noise = NoiseLevels { robot_sigma_m: 0.0, stamp_sigma_s: 0.0, factor: 1.0 };
    let problem = LineProblem::coarse(&observed, &observed.list, Loss::GemanMcClure { scale: 30.0 }, &noise);
    let late = Parameters { time_offset_s: truth.time_offset_s + 2.0, ..truth.clone() };
    assert_alike(&problem, &late);
    let squared = problem.squared_residuals(&late).len();
    assert!(squared > 10 && squared < observed.list.len() - 10, "{squared}");
    let plain = |at: &Parameters| {
        let mut hint = 0;
        observed.list.iter().filter(|o| problem.residual(o, at, &mut hint).is_some()).count()
    };
    assert_eq!(squared, plain(&late));
}

#[path = "large_scan/mod.rs"]
mod large_scan;

/// Two threads, or five, give the same bytes as one.
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
}
