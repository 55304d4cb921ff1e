//! Parts of a calibration: one linearisation, one cost, a solve, a whole calibration from nothing.
//!
//! `cargo bench -p trueline-method`. Times per feature should not depend on the number of features.
#![allow(missing_docs, clippy::unwrap_used, clippy::panic, reason = "a benchmark fails by panicking")]

#[path = "../tests/it/large_scan/mod.rs"]
mod large_scan;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use large_scan::{NOISE, of_features};
use nalgebra::{DVector, Vector2};
use std::hint::black_box;
use trueline_lsq::{LeastSquares, Loss, NormalEquations, SolveOptions, solve};
use trueline_method::problem::line_problem::LineProblem;
use trueline_method::problem::scalar_sums::OneByOne;
use trueline_method::{Config, Measurements, Parameters, ResidualKind, calibrate, problem::line_problem};
use trueline_model::{Curvature, SheetShape};
use trueline_sim::{Plates, Preset, scan_plates, simulate};

const TUKEY: Loss = Loss::Tukey { scale: 6.0 };

fn sums(c: &mut Criterion) {
    let mut group = c.benchmark_group("linearize");
    for count in [1_000, 10_000, 100_000, 1_000_000] {
        let (observed, at) = of_features(count);
        let criterion = line_problem::Criterion { residual: ResidualKind::Sheet, loss: TUKEY };
        let problem = LineProblem::new(&observed, &observed.list, criterion, &NOISE, &at);
        let mut equations = NormalEquations::zeros(problem.dimension());
        group.throughput(Throughput::Elements(count as u64));
        group.bench_with_input(BenchmarkId::new("side by side", count), &count, |b, _| {
            b.iter(|| {
                equations.clear();
                problem.linearize(black_box(&at), &mut equations);
            });
        });
        group.bench_with_input(BenchmarkId::new("cost alone", count), &count, |b, _| {
            b.iter(|| problem.cost(black_box(&at)));
        });
        if count <= 100_000 {
            group.bench_with_input(BenchmarkId::new("one by one", count), &count, |b, _| {
                b.iter(|| {
                    equations.clear();
                    OneByOne(&problem).linearize(black_box(&at), &mut equations);
                });
            });
        }
    }
}

/// Cost of the seam's bow and the sensor's shape.
fn unknowns(c: &mut Criterion) {
    let mut group = c.benchmark_group("linearize 10000");
    let (observed, straight) = of_features(10_000);
    let bow = Curvature { bow_m: [0.0; 2], middle_m: 0.0, half_length_m: 0.1 };
    let bowed = Parameters { curvatures: vec![bow; straight.lines.len()], ..straight.clone() };
    let exact = SheetShape::exact_about(&Vector2::zeros());
    let shaped = Parameters { shape: Some(exact), ..bowed.clone() };
    for at in [straight, bowed, shaped] {
        let criterion = line_problem::Criterion { residual: ResidualKind::Sheet, loss: TUKEY };
        let problem = LineProblem::new(&observed, &observed.list, criterion, &NOISE, &at);
        let mut equations = NormalEquations::zeros(problem.dimension());
        group.bench_function(BenchmarkId::new("unknowns", problem.dimension()), |b| {
            b.iter(|| {
                equations.clear();
                problem.linearize(black_box(&at), &mut equations);
            });
        });
    }
}

fn optimum(c: &mut Criterion) {
    let mut group = c.benchmark_group("solve");
    group.sample_size(20);
    for count in [1_000, 10_000, 100_000, 1_000_000] {
        let (observed, at) = of_features(count);
        let criterion = line_problem::Criterion { residual: ResidualKind::Sheet, loss: Loss::Squared };
        let problem = LineProblem::new(&observed, &observed.list, criterion, &NOISE, &at);
        // 3 ms, a degree and some millimetres off.
        let off =
            DVector::from_fn(at.dimension(), |k, _| if k == 0 { 3e-3 } else { 1e-2 / (k as f64 + 1.0) });
        let start = at.retract(&off);
        group.throughput(Throughput::Elements(count as u64));
        group.bench_with_input(BenchmarkId::from_parameter(count), &count, |b, _| {
            b.iter(|| solve(&problem, start.clone(), &[], &SolveOptions::default()).unwrap());
        });
    }
}

fn from_nothing(c: &mut Criterion) {
    let mut group = c.benchmark_group("calibrate from nothing");
    group.sample_size(10);
    for preset in [Preset::Quick, Preset::Paper, Preset::TwoLines, Preset::Profiler] {
        let recording = simulate(&preset.scenario(), 1).unwrap();
        group.bench_function(preset.name(), |b| {
            b.iter(|| calibrate(black_box(&recording), None, &Config::default()).unwrap());
        });
    }
}

/// Cost of the plates besides the seam points: a whole calibration of the paper's scan of 60 s, from nothing.
fn whole_stripes(c: &mut Criterion) {
    let mut group = c.benchmark_group("calibrate with whole stripes");
    group.sample_size(10);
    let recording = scan_plates(&Preset::Paper.scenario(), &Plates::default(), 1).unwrap();
    for measurements in [Measurements::Seam, Measurements::Stripe, Measurements::Both] {
        let config = Config { measurements, ..Config::default() };
        group.bench_function(measurements.name(), |b| {
            b.iter(|| calibrate(black_box(&recording), None, &config).unwrap());
        });
    }
}

criterion_group!(benches, sums, unknowns, optimum, from_nothing, whole_stripes);
criterion_main!(benches);
