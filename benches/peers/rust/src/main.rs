//! Exports one problem and solves it with trueline and with a Rust factor-graph library.
//!
//! `peers EXPORT.bin [DATASET]`: the dataset folder, or a simulated scan of the paper's size.

mod exported;
mod factor_graph;

use nalgebra::DVector;
use std::time::Instant;
use trueline_method::input::noise_levels::NoiseLevels;
use trueline_method::input::observations::{self, Observations};
use trueline_method::problem::usable::UsableObservations;
use trueline_method::problem::line_problem::{Criterion, LineProblem};
use trueline_method::problem::scalar_sums::OneByOne;
use trueline_method::input::timestamps::Sampling;
use trueline_method::{Config, Parameters, ResidualKind, calibrate};
use trueline_dataset::Recording;
use trueline_geometry::{se3, so3};
use trueline_lsq::{Information, Loss, Solution, SolveOptions, solve};

/// Repetitions; the fastest counts on every side.
const REPEATS: usize = 20;

type Failure = Box<dyn std::error::Error>;

fn recording(dataset: Option<&str>) -> Result<Recording, Failure> {
    if let Some(folder) = dataset {
        return Ok(trueline_dataset::folder::read(folder.as_ref())?);
    }
    let mut scenario = trueline_sim::Preset::TwoLines.scenario();
    scenario.timing.duration_s = 140.0;
    scenario.timing.frame_period_s = 0.0276;
    trueline_sim::simulate(&scenario, 1).ok_or_else(|| "nothing is seen".into())
}

fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = std::env::args().collect();
    let recording = recording(arguments.get(2).map(String::as_str))?;
    let config = Config::default();
    let calibrated = calibrate(&recording, None, &config)?;
    // Straight lines and the sensor as its file has it: the model of the paper, which every side solves.
    let found = Parameters::straight(&calibrated.best_fit().guess(), calibrated.best_fit().lines.clone());
    let sampling = Sampling::of(&recording, observations::origin_ns(&recording));
    let observed: Observations = observations::observe(&recording, &sampling, &config)?;
    let noise = NoiseLevels { robot_sigma_m: observed.robot.noise_m, stamp_sigma_s: 1e-4, factor: 1.0 };
    let usable = UsableObservations::within(&observed, found.time_offset_s, 0.03);
    let criterion = Criterion { residual: ResidualKind::Sheet, loss: Loss::Squared };
    let problem = LineProblem::new(&observed, usable.of(&observed), criterion, &noise, &found);
    let start = paper_start(&found);
    // By the step alone, as every side.
    let options = SolveOptions { step_threshold: 1e-6, cost_threshold: 0.0, ..SolveOptions::default() };
    let (solution, seconds) = fastest(|| solve(&problem, start.clone(), &[], &options));
    let solution: Solution<Parameters> = solution?;
    let covariance =
        Information::new(&solution.equations.hessian, &[], 1e-9).ok_or("no covariance")?.covariance();
    let sigma: Vec<f64> = (0..7).map(|k| covariance[(k, k)].sqrt()).collect();
    exported::write(&problem, &start, &sigma, &arguments[1])?;
    let count = problem.list.len();
    println!(
        "{{\"side\":\"problem\",\"features\":{count},\"unknowns\":{},\"sigma\":{sigma:?}}}",
        start.dimension()
    );
    let report = |side: &str, found: &[f64; 7], iterations: usize, seconds: f64| {
        println!(
            "{{\"side\":\"{side}\",\"found\":{found:?},\"iterations\":{iterations},\"seconds\":{seconds:e}}}"
        );
    };
    report("trueline", &relative(&solution.state, &start), solution.iterations.len(), seconds);
    let (plain, seconds) = fastest(|| solve(&OneByOne(&problem), start.clone(), &[], &options));
    let plain = plain?;
    report("trueline, one by one", &relative(&plain.state, &start), plain.iterations.len(), seconds);
    if let Some((found, seconds)) = factor_graph::solve(&problem, &start, &solution.state) {
        report("tiny-solver (Rust, dual numbers)", &found, 0, seconds);
    }
    Ok(())
}

/// No time offset, 3.7 mm and 1.7° off, the lines as far as that puts them.
fn paper_start(found: &Parameters) -> Parameters {
    let mut step = DVector::zeros(found.dimension());
    let off = [-found.time_offset_s, 0.017, -0.017, 0.017, 0.002, -0.0025, 0.002];
    step.rows_mut(0, 7).copy_from_slice(&off);
    found.retract(&step)
}

fn relative(state: &Parameters, start: &Parameters) -> [f64; 7] {
    let (from, to) = (&start.tool_from_camera, &state.tool_from_camera);
    let turn = so3::log(&(to.rotation * from.rotation.inverse()));
    let shift = se3::difference_decoupled(to, from).1;
    [state.time_offset_s, turn.x, turn.y, turn.z, shift.x, shift.y, shift.z]
}

fn fastest<T>(run: impl Fn() -> T) -> (T, f64) {
    let mut best = f64::INFINITY;
    let mut result = run();
    for _ in 0..REPEATS {
        let began = Instant::now();
        result = run();
        best = best.min(began.elapsed().as_secs_f64());
    }
    (result, best)
}
