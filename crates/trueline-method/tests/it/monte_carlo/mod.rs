//! Many simulated scans of many cells: errors of the estimates, and their stated uncertainties.
//! Shared by the tests and by the study `monte_carlo`.
#![allow(
    dead_code,
    clippy::unwrap_used,
    missing_docs,
    reason = "two programs use a part each; a test fails by panicking"
)]

use nalgebra::{DVector, SVector};
use std::time::Instant;
use trueline_dataset::Recording;
use trueline_geometry::se3;
use trueline_lsq::{Information, LeastSquares, Loss, NormalEquations};
use trueline_method::assess::observability::RANK_THRESHOLD;
use trueline_method::input::noise_levels::NoiseLevels;
use trueline_method::input::timestamps::Sampling;
use trueline_method::problem::line_problem::{Criterion, LineProblem};
use trueline_method::problem::usable::UsableObservations;
use trueline_method::solve::seam_chart::with_bows;
use trueline_method::{Config, Parameters, ResidualKind, Status, calibrate, input::observations};
use trueline_sim::{Disturbance, Scenario, random_cell, simulate};

/// Time offset, rotation, translation.
pub(crate) const UNKNOWNS: usize = 7;

/// Start of a run.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Start {
    /// Without a guess.
    Nothing,
    /// From the truth: the same optimum, faster.
    Truth,
}

/// The disturbed quantities.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Noise {
    /// Everything as in the preset: features, robot poses, stamps of both streams.
    Preset,
    /// Independent Gaussian features alone, with a known Cramér–Rao bound.
    GaussianFeatures,
}

/// One run's outcome.
#[derive(Clone)]
pub(crate) struct Run {
    pub seed: u64,
    pub accepted: bool,
    pub said: String,
    pub error: SVector<f64, UNKNOWNS>,
    pub sigma: SVector<f64, UNKNOWNS>,
    /// eᵀ C⁻¹ e, the normalised error squared.
    pub normalised_squared: f64,
    /// Cramér–Rao bound of each standard deviation.
    pub bound: Option<SVector<f64, UNKNOWNS>>,
    pub seconds: f64,
}

impl Run {
    /// Accepted, with an error that honest sigmas allow once in 10⁸ such runs.
    pub(crate) fn is_wrong(&self) -> bool {
        self.accepted && !(0..UNKNOWNS).all(|k| self.error[k].abs() < 6.0 * self.sigma[k])
    }
}

/// Simulates a random cell with this scan and calibrates it.
pub(crate) fn run(scenario: &Scenario, noise: Noise, start: Start, seed: u64) -> Run {
    let mut scenario = random_cell(scenario, seed, 1.0);
    if noise == Noise::GaussianFeatures {
        let Disturbance { feature_noise_px, feature_noise_m, .. } = scenario.disturbance;
        scenario.disturbance = Disturbance { feature_noise_px, feature_noise_m, ..Disturbance::default() };
        scenario.timing.between = trueline_sim::Between::Straight;
    }
    let recording = simulate(&scenario, seed).unwrap();
    let truth = recording.truth.as_ref().unwrap();
    let guess = (start == Start::Truth).then_some(&truth.parameters);
    let config = Config::noise_only();
    let began = Instant::now();
    let calibration = calibrate(&recording, guess, &config);
    let seconds = began.elapsed().as_secs_f64();
    let mut run = Run {
        seed,
        accepted: false,
        said: String::new(),
        error: SVector::repeat(f64::NAN),
        sigma: SVector::repeat(f64::NAN),
        normalised_squared: f64::NAN,
        bound: (noise == Noise::GaussianFeatures).then(|| bound(&recording, &config)),
        seconds,
    };
    match calibration {
        Err(error) => run.said = error.to_string(),
        Ok(calibration) => {
            let (turn, shift) = se3::difference_decoupled(
                &calibration.best_fit().tool_from_camera,
                &truth.parameters.tool_from_camera,
            );
            run.error[0] = calibration.best_fit().time_offset_s - truth.parameters.time_offset_s;
            run.error.fixed_rows_mut::<3>(1).copy_from(&turn);
            run.error.fixed_rows_mut::<3>(4).copy_from(&shift);
            run.sigma = SVector::from_fn(|k, _| calibration.sigma(k).unwrap_or(f64::NAN));
            run.accepted = calibration.status() == Status::Accepted;
            run.said = calibration.reasons().iter().map(ToString::to_string).collect::<Vec<_>>().join("; ");
            let covariance =
                calibration.best_fit_covariance().view((0, 0), (UNKNOWNS, UNKNOWNS)).into_owned();
            let error = DVector::from_column_slice(run.error.as_slice());
            run.normalised_squared =
                covariance.cholesky().map_or(f64::NAN, |factor| error.dot(&factor.solve(&error)));
        }
    }
    run
}

/// Cramér–Rao bound at the truth for feature noise alone, at the configured level.
fn bound(recording: &Recording, config: &Config) -> SVector<f64, UNKNOWNS> {
    let truth = recording.truth.as_ref().unwrap();
    let sampling = Sampling::of(recording, observations::origin_ns(recording));
    let observed = observations::observe(recording, &sampling, config).unwrap();
    let at = Parameters::straight(&truth.parameters, truth.lines.clone());
    let noise = NoiseLevels { robot_sigma_m: 0.0, stamp_sigma_s: 0.0, factor: 1.0 };
    let criterion = Criterion { residual: ResidualKind::Sheet, loss: Loss::Squared };
    let list = UsableObservations::within(&observed, at.time_offset_s, 0.0);
    // A bow of each seam is estimated too.
    let at = with_bows(&observed, list.of(&observed), at);
    let problem = LineProblem::new(&observed, list.of(&observed), criterion, &noise, &at);
    let mut equations = NormalEquations::zeros(problem.dimension());
    problem.linearize(&at, &mut equations);
    let covariance = Information::new(&equations.hessian, &[], RANK_THRESHOLD).unwrap().covariance();
    SVector::from_fn(|k, _| covariance[(k, k)].sqrt())
}

/// All runs of some seeds, on all cores.
pub(crate) fn runs(scenario: &Scenario, noise: Noise, start: Start, seeds: std::ops::Range<u64>) -> Vec<Run> {
    let threads = std::thread::available_parallelism().map_or(1, usize::from) as u64;
    let mut all: Vec<Run> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads)
            .map(|worker| {
                let seeds = seeds.clone().filter(move |seed| seed % threads == worker);
                scope.spawn(move || seeds.map(|seed| run(scenario, noise, start, seed)).collect::<Vec<_>>())
            })
            .collect();
        workers.into_iter().flat_map(|worker| worker.join().unwrap()).collect()
    });
    all.sort_by_key(|run| run.seed);
    all
}

/// Statistics of the accepted runs.
pub(crate) struct Statistics {
    pub runs: usize,
    pub accepted: usize,
    pub wrong: usize,
    /// Mean of eᵀ C⁻¹ e over the number of unknowns: 1 for honest covariances.
    pub normalised_per_unknown: f64,
    /// Fraction of the runs whose 95 % interval contains the truth.
    pub coverage: SVector<f64, UNKNOWNS>,
    /// RMS ratio of error to bound: 1 for an efficient estimator.
    pub spread_over_bound: Option<SVector<f64, UNKNOWNS>>,
    pub mean_seconds: f64,
}

/// Summarises runs.
pub(crate) fn statistics(runs: &[Run]) -> Statistics {
    let accepted: Vec<&Run> = runs.iter().filter(|r| r.accepted).collect();
    let count = accepted.len() as f64;
    let mean = |f: &dyn Fn(&Run) -> f64| accepted.iter().map(|r| f(r)).sum::<f64>() / count;
    let bounded = accepted.iter().all(|r| r.bound.is_some());
    let ratio = |k: usize| {
        let square = |r: &Run| r.bound.map_or(f64::NAN, |bound| (r.error[k] / bound[k]).powi(2));
        mean(&square).sqrt()
    };
    Statistics {
        runs: runs.len(),
        accepted: accepted.len(),
        wrong: runs.iter().filter(|r| r.is_wrong()).count(),
        normalised_per_unknown: mean(&|r| r.normalised_squared) / UNKNOWNS as f64,
        coverage: SVector::from_fn(|k, _| mean(&|r| f64::from(r.error[k].abs() <= 1.959_964 * r.sigma[k]))),
        spread_over_bound: bounded.then(|| SVector::from_fn(|k, _| ratio(k))),
        mean_seconds: runs.iter().map(|r| r.seconds).sum::<f64>() / runs.len() as f64,
    }
}
