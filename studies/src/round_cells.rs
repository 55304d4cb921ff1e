//! Whether the uncertainty of a calibration from a sphere or a cylinder is honest: many cells of the simulator, none with a guess.
//!
//! `cargo run --release -p trueline-studies -- round_cells [CELLS [CASE [FIRST SEED]]]` prints a row for each case: the normalised squared error of
//! each block (1 is honest), the largest error of an accepted answer in standard deviations, and how many are refused. Each sensor's shape
//! is drawn from what is assumed of it.
#![allow(clippy::unwrap_used, reason = "a study fails by panicking")]

#[path = "../../crates/trueline-sensor/tests/it/round/mod.rs"]
#[allow(dead_code, reason = "the tests use the rest of it")]
mod round;

use crate::arguments::{number, word};
use nalgebra::{SVector, Vector2};
use rayon::prelude::*;
use round::{ARM_M, err_slowly, of_cast, off, options, squares as squares_of};
use trueline_method::input::shape_knowledge::ShapeKnowledge;
use trueline_model::SheetShape;
use trueline_sensor::board_files::round_scan::{RoundCalibration, RoundCalibrationOptions};
use trueline_sensor::pose_verdict;
use trueline_sensor::round::{RoundTarget as Round, arc};
use trueline_sim::noise::Noise;
use trueline_sim::{RoundScan, RoundScanned, RoundTarget};

/// Cells of each case, unless stated.
const CELLS: u64 = 60;
const RADIUS_M: f64 = 0.02;
/// Errors of an accepted answer beyond so many standard deviations are wrong.
const WRONG: f64 = 4.0;
/// Blocks: time offset, rotation, translation, and the target's pose but for what is held.
const NAMES: [&str; 4] = ["t_d", "rotation", "translation", "target"];

/// Position errors of the robot, per axis, m: of an accuracy of six times as much.
const ROBOT_M: f64 = 0.02e-3;

/// How the robot moves and errs.
#[derive(Clone, Copy, PartialEq)]
enum Robot {
    /// It moves, and its poses have noise.
    Moves,
    /// It stands at stops, and errs anew at each.
    Restless,
    /// It stands at stops, and its errors change slowly over the workspace.
    Slow,
}

/// A case: the target, the robot, and whether the radius is stated.
type Case = (&'static str, RoundTarget, Robot, bool);

const CASES: [Case; 10] = [
    ("sphere, moving", RoundTarget::Sphere, Robot::Moves, true),
    ("sphere, moving, free radius", RoundTarget::Sphere, Robot::Moves, false),
    ("sphere, stops", RoundTarget::Sphere, Robot::Restless, true),
    ("sphere, stops, free radius", RoundTarget::Sphere, Robot::Restless, false),
    ("sphere, stops, slow errors", RoundTarget::Sphere, Robot::Slow, true),
    ("cylinder, moving", RoundTarget::Cylinder, Robot::Moves, true),
    ("cylinder, moving, free radius", RoundTarget::Cylinder, Robot::Moves, false),
    ("cylinder, stops", RoundTarget::Cylinder, Robot::Restless, true),
    ("cylinder, stops, free radius", RoundTarget::Cylinder, Robot::Restless, false),
    ("cylinder, stops, slow errors", RoundTarget::Cylinder, Robot::Slow, true),
];

pub(crate) fn run(arguments: &[String]) -> Result<(), String> {
    let cells: u64 = number(arguments, 0, CELLS)?;
    let first: u64 = number(arguments, 2, 0)?;
    println!(
        "| case | accepted of {cells} | NEES {} | radius | largest z | arcs left out | refused |",
        NAMES.join(" | ")
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for case in CASES.into_iter().filter(|case| case.0.contains(word(arguments, 1))) {
        let all: Vec<Cell> =
            (first..first + cells).into_par_iter().map(|seed| Cell::of(case, seed)).collect();
        println!("| {} | {}", case.0, row(&all));
    }
    Ok(())
}

/// What came of a cell.
enum Cell {
    Refused(String),
    Accepted { squares: [Option<f64>; 5], largest: f64, left_out: f64 },
}

impl Cell {
    fn of((name, target, robot, is_stated): Case, seed: u64) -> Self {
        let at_stops = robot != Robot::Moves;
        let mut scan = RoundScan::usual(target, RADIUS_M, at_stops, seed);
        scan.sighted.robot_noise = [ROBOT_M, ROBOT_M / ARM_M];
        let usual = options(&scan);
        if robot == Robot::Slow {
            scan.sighted.robot_noise = [0.0; 2];
        }
        let mut cast = drawn_sensor(&scan, target, seed);
        if robot == Robot::Slow {
            err_slowly(&mut cast.sighted.robot, ROBOT_M, seed);
        }
        let options = RoundCalibrationOptions { radius_m: usual.radius_m.filter(|_| is_stated), ..usual };
        let found = match of_cast(&scan, &cast, &options) {
            Ok(found) => found,
            Err(error) => return Self::Refused(error.to_string()),
        };
        let (reasons, _) = pose_verdict::of_poses(&found.round.pose, &found.covariance);
        if let Some(reason) = reasons.first() {
            return Self::Refused(reason.code().to_owned());
        }
        let off = off(&found, &cast.sighted.truth);
        let (squares, largest) = squares(&found, &off, at_stops);
        if largest > WRONG {
            eprintln!("{name}, seed {seed}: {largest:.1} standard deviations off, NEES {squares:.1?}");
        }
        let used = &found.round.pose.used;
        let left_out = used.iter().filter(|used| !**used).count() as f64 / used.len() as f64;
        Self::Accepted { squares, largest, left_out }
    }
}

/// The scan before a sensor whose shape is drawn.
fn drawn_sensor(scan: &RoundScan, target: RoundTarget, seed: u64) -> RoundScanned {
    let mut cast = scan.cast();
    let target = if target == RoundTarget::Sphere { Round::Sphere } else { Round::Cylinder };
    let points = |k: usize| -> Vec<Vector2<f64>> {
        cast.profiles[k].points.iter().map(|p| Vector2::new(p.x_m, p.z_m)).collect()
    };
    let arcs: Vec<Vector2<f64>> = (0..cast.profiles.len())
        .filter_map(|k| arc::arc(&points(k), target, Some(scan.radius_m)))
        .flatten()
        .collect();
    let mut shape = SheetShape::exact_about(&(arcs.iter().sum::<Vector2<f64>>() / arcs.len() as f64));
    let mut draw = Noise::new(seed, 77);
    let variances = ShapeKnowledge::of_profiler(None).covariance.diagonal();
    for (h, variance) in shape.h.iter_mut().zip(&variances) {
        *h = draw.normal(variance.sqrt());
    }
    for point in cast.profiles.iter_mut().flat_map(|profile| &mut profile.points) {
        let reported = shape.reported(&Vector2::new(point.x_m, point.z_m)).reported;
        (point.x_m, point.z_m) = (reported.x, reported.y);
    }
    cast
}

/// Normalised squares of each block and of the radius, and the largest error in standard deviations.
fn squares(found: &RoundCalibration, off: &SVector<f64, 13>, at_stops: bool) -> ([Option<f64>; 5], f64) {
    let covariance = found.covariance;
    let target: Vec<usize> = (7..13).filter(|k| covariance[(*k, *k)] > 0.0).collect();
    let of_block = |of: &[usize]| Some(squares_of(off, &covariance, of));
    let radius = found.round.radius_sigma_m.map(|sigma_m| (found.round.radius_m - RADIUS_M) / sigma_m);
    let of_time = if at_stops { None } else { of_block(&[0]) };
    let squares =
        [of_time, of_block(&[1, 2, 3]), of_block(&[4, 5, 6]), of_block(&target), radius.map(|z| z * z)];
    let estimated = (usize::from(at_stops)..7).chain(target.iter().copied());
    let largest = estimated.map(|k| off[k].abs() / found.covariance[(k, k)].sqrt());
    (squares, largest.chain(radius.map(f64::abs)).fold(0.0, f64::max))
}

fn row(all: &[Cell]) -> String {
    let accepted: Vec<(&[Option<f64>; 5], f64, f64)> = all
        .iter()
        .filter_map(|cell| match cell {
            Cell::Accepted { squares, largest, left_out } => Some((squares, *largest, *left_out)),
            Cell::Refused(_) => None,
        })
        .collect();
    let count = accepted.len() as f64;
    let mean = |k: usize| {
        let of: Vec<f64> = accepted.iter().filter_map(|(squares, ..)| squares[k]).collect();
        if of.is_empty() {
            "–".to_owned()
        } else {
            format!("{:.2}", of.iter().sum::<f64>() / of.len() as f64)
        }
    };
    let largest = accepted.iter().map(|(_, largest, _)| *largest).fold(0.0, f64::max);
    let left_out = accepted.iter().map(|(.., left_out)| left_out).sum::<f64>() / count;
    let mut refused: Vec<&str> = all
        .iter()
        .filter_map(|cell| if let Cell::Refused(why) = cell { Some(why.as_str()) } else { None })
        .collect();
    refused.sort_unstable();
    refused.dedup();
    format!(
        "{} | {} | {largest:.2} | {:.2} % | {} |",
        accepted.len(),
        (0..5).map(mean).collect::<Vec<_>>().join(" | "),
        100.0 * left_out,
        refused.join(", ")
    )
}
