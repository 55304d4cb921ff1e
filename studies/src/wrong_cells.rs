//! Plans the example's first scan and calibrates it, without a guess, in cells that differ from the guess: does the spread
//! of the estimates agree with the prediction?
//!
//! ```text
//! cargo run --release -p trueline-studies -- wrong_cells [CELLS] [DURATION_S] [TRIES] [SEED]
//! ```
//!
//! The cells are drawn and their scans cast by the simulator and by this file; of the planner only the path is used.
#![allow(clippy::expect_used, reason = "a study fails by panicking")]

use crate::arguments::number;
use nalgebra::{UnitQuaternion, Vector3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::time::Instant;
use trueline_geometry::Pose;
use trueline_method::{Config, Status, calibrate};
use trueline_plan::{Cell, Plan, PlanRequest, Seam, plan};

#[path = "../../crates/trueline-plan/tests/it/cells/mod.rs"]
pub(crate) mod cells;

const NAMES: [&str; 7] = ["t_d ms", "rx deg", "ry deg", "rz deg", "tx mm", "ty mm", "tz mm"];

pub(crate) fn run(arguments: &[String]) -> Result<(), String> {
    let cells: u64 = number(arguments, 0, 200)?;
    let duration_s: f64 = number(arguments, 1, 20.0)?;
    let usual = PlanRequest::default();
    let evaluations = number(arguments, 2, usual.evaluations)?;
    let seed = number(arguments, 3, usual.seed)?;
    let cell = cells::example();
    let began = Instant::now();
    let ask = PlanRequest { duration_s, evaluations, seed, threads: 2, ..usual };
    let plan = plan(&cell, &ask, &|| ()).expect("the example can be planned");
    println!(
        "planned in {:.1} s: {}, {:?}",
        began.elapsed().as_secs_f64(),
        plan.motion.design().shape.name(),
        plan.loss
    );
    let units: [f64; 7] =
        std::array::from_fn(|k| [1e3, 1f64.to_degrees(), 1e3][(k > 0) as usize + (k > 3) as usize]);
    for (k, (name, unit)) in NAMES.iter().zip(units).enumerate() {
        println!("  {name:<7} ± {:.5}", plan.prediction.sigma(k) * unit);
    }
    if cells == 0 {
        return Ok(());
    }
    let began = Instant::now();
    let outcomes: Vec<Outcome> = std::thread::scope(|scope| {
        let half = |worker: u64| {
            let (cell, plan) = (&cell, &plan);
            scope.spawn(move || {
                (worker..cells).step_by(2).map(|seed| outcome(cell, plan, seed)).collect::<Vec<_>>()
            })
        };
        [half(0), half(1)].map(|worker| worker.join().expect("a worker")).concat()
    });
    let accepted: Vec<&Outcome> = outcomes.iter().filter(|o| o.accepted).collect();
    println!(
        "{} of {cells} calibrated from nothing in {:.0} s",
        accepted.len(),
        began.elapsed().as_secs_f64()
    );
    let mut kept: Vec<f64> = outcomes.iter().map(|o| o.frames_kept).collect();
    kept.sort_by(f64::total_cmp);
    let mean = kept.iter().sum::<f64>() / kept.len() as f64;
    println!(
        "frames kept: mean {mean:.4}, of 95 % of the cells at least {:.3}, least {:.3}",
        kept[kept.len() / 20],
        kept[0]
    );
    for (k, name) in NAMES.iter().enumerate() {
        let rms = |of: &dyn Fn(&Outcome) -> f64| {
            (accepted.iter().map(|o| of(o).powi(2)).sum::<f64>() / accepted.len() as f64).sqrt()
        };
        let (spread, said) = (rms(&|o| o.error[k]), rms(&|o| o.error[k] / o.sigma[k]));
        println!(
            "  {name:<7} spread / predicted {:.2}, spread / said by the estimate {said:.2}",
            spread / plan.prediction.sigma(k)
        );
    }
    Ok(())
}

#[derive(Clone)]
struct Outcome {
    accepted: bool,
    frames_kept: f64,
    error: [f64; 7],
    sigma: [f64; 7],
}

/// Anywhere within a ball.
fn within(random: &mut ChaCha8Rng, radius: f64) -> Vector3<f64> {
    loop {
        let v = Vector3::from_fn(|_, _| random.random_range(-1.0..1.0));
        if v.norm() <= 1.0 {
            return v * radius;
        }
    }
}

fn outcome(cell: &Cell, plan: &Plan, seed: u64) -> Outcome {
    let mut random = ChaCha8Rng::seed_from_u64(7_000_000 + seed);
    let guess = &cell.guess_error;
    let turn = UnitQuaternion::from_scaled_axis(within(&mut random, guess.rotation_rad));
    let tool_from_camera = Pose::from_parts(
        (cell.tool_from_camera.translation.vector + within(&mut random, guess.translation_m)).into(),
        turn * cell.tool_from_camera.rotation,
    );
    let from = cell.seam.from_m + within(&mut random, guess.line_m);
    let to = cell.seam.to_m + within(&mut random, guess.line_m);
    let seam = Seam { from_m: from, to_m: to };
    let scenario = cells::scenario(cell, (tool_from_camera, seam), plan.motion.design().duration_s);
    let mut scan = cells::scan(&scenario, &plan.motion, seed);
    // The simulator's line has no ends, the seam has.
    let truth = scan.truth.clone().expect("a simulation knows its truth").parameters;
    let frames = (plan.motion.design().duration_s / cell.frame_period_s - 0.5).floor();
    let along = (to - from).normalize();
    let offset_ns = truth.time_offset_s * 1e9;
    let first_ns = scan.robot[0].stamp_ns;
    scan.features.retain(|feature| {
        let time_s = ((feature.stamp_ns - first_ns) as f64 - offset_ns) * 1e-9;
        let base_from_camera = plan.motion.base_from_tool(time_s) * tool_from_camera;
        let normal = base_from_camera.rotation * cell.sheet.plane().normal().into_inner();
        let through = base_from_camera.translation.vector.dot(&normal) + cell.sheet.plane().offset();
        let at = (through - normal.dot(&from)) / normal.dot(&along);
        (0.0..=(to - from).norm()).contains(&at)
    });
    let frames_kept = scan.features.len() as f64 / frames;
    scan.initial = None;
    let lost = Outcome { accepted: false, frames_kept, error: [0.0; 7], sigma: [1.0; 7] };
    let Ok(found) = calibrate(&scan, None, &Config::noise_only()) else { return lost };
    if found.status() != Status::Accepted {
        println!("cell {seed}: {:?}", found.reasons());
        return lost;
    }
    let at = found.best_fit();
    let turned = (at.tool_from_camera.rotation * truth.tool_from_camera.rotation.inverse()).scaled_axis();
    let shifted = at.tool_from_camera.translation.vector - truth.tool_from_camera.translation.vector;
    let off = [&[at.time_offset_s - truth.time_offset_s], turned.as_slice(), shifted.as_slice()].concat();
    Outcome {
        accepted: true,
        frames_kept,
        error: std::array::from_fn(|k| off[k]),
        sigma: std::array::from_fn(|k| found.noise_sigma(k).unwrap_or(f64::NAN)),
    }
}
