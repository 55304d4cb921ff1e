//! Scans in cells with an external axis, calibrated from nothing: how many are accepted and right, and are the ± honest?
//!
//! `cargo run --release -p trueline-studies -- axis_cells [CELLS A COURSE] [FIRST SEED] [--cells] [--only=WORDS]` prints a
//! row for each course of an axis with these words in its name: NEES of time offset and hand-eye transform (7 numbers) and
//! of the determined numbers of the axis, medians of the stated ± of the axis, and the largest error over its ±.

use crate::arguments::number;
use nalgebra::{DMatrix, DVector, SMatrix, SVector};
use std::time::Instant;
use trueline_dataset::{Carries, Guess};
use trueline_geometry::axis::{AXIS, AXIS_POINT, AXIS_TIME_OFFSET};
use trueline_geometry::{Axis, AxisKind, se3};
use trueline_method::axes::finding::{AxisFinding, AxisPart};
use trueline_method::order_statistics::median;
use trueline_method::{Calibration, Config, Status, calibrate};
use trueline_sim::{AxisCourse, Preset, SimulatedAxis, random_cell, simulate_with_axes};

/// Cells of each course, unless stated.
const CELLS: u64 = 40;
/// Largest time offset of a cell, s.
const OFFSET_S: f64 = 0.3;

/// Name, kind, load and motion.
type Row = (&'static str, AxisKind, Carries, AxisCourse);

fn rows() -> Vec<Row> {
    let degrees = |values: &[f64]| AxisCourse::Stands(values.iter().map(|v| v.to_radians()).collect());
    let swing = AxisCourse::Swings { by: 30f64.to_radians(), hz: 0.11 };
    let slide = AxisCourse::Swings { by: 0.2, hz: 0.11 };
    let (rotary, linear) = (AxisKind::Rotary, AxisKind::Linear);
    vec![
        ("table swings ±30°", rotary, Carries::Part, swing.clone()),
        ("table at 0, 60, 120°", rotary, Carries::Part, degrees(&[0.0, 60.0, 120.0])),
        ("table at 0, 60°", rotary, Carries::Part, degrees(&[0.0, 60.0])),
        ("table at 20°", rotary, Carries::Part, degrees(&[20.0])),
        ("table turns with 6°/s", rotary, Carries::Part, AxisCourse::Runs(6f64.to_radians())),
        ("column under the robot swings", rotary, Carries::Robot, swing.clone()),
        ("axis at the tool swings", rotary, Carries::Sensor, swing),
        ("track swings ±200 mm", linear, Carries::Robot, slide.clone()),
        ("slide under the part swings", linear, Carries::Part, slide),
    ]
}

/// Result of one scan.
struct Outcome {
    accepted: bool,
    /// eᵀ C⁻¹ e over the number of unknowns, of time offset and hand-eye, and of the axis.
    nees: Option<[f64; 2]>,
    /// Stated ± of direction (°), place (mm) and offset (ms).
    said: [Option<f64>; 3],
    largest_z: f64,
    seconds: f64,
    words: String,
}

pub(crate) fn run(arguments: &[String]) -> Result<(), String> {
    let (options, places): (Vec<String>, Vec<String>) =
        arguments.iter().cloned().partition(|word| word.starts_with('-'));
    let count: u64 = number(&places, 0, CELLS)?;
    let first: u64 = number(&places, 1, 1)?;
    let prints_cells = options.iter().any(|option| option == "--cells");
    println!(
        "| axis | accepted | NEES/7 | NEES of the axis | largest z | direction ° | place mm | offset ms | median s |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    let only = options.iter().find_map(|option| option.strip_prefix("--only=")).unwrap_or_default();
    for row in rows().into_iter().filter(|row| row.0.contains(only)) {
        let outcomes: Vec<Outcome> = (first..first + count).map(|seed| outcome(&row, seed)).collect();
        if prints_cells {
            (first..).zip(&outcomes).for_each(|(seed, outcome)| println!("{seed} {}", outcome.words));
        }
        print_row(row.0, &outcomes);
    }
    Ok(())
}

fn outcome((_, kind, carries, course): &Row, seed: u64) -> Outcome {
    let scenario = random_cell(&Preset::Good.scenario(), seed, OFFSET_S);
    let axis = SimulatedAxis::somewhere("axis", (*kind, *carries), course.clone(), &scenario, seed);
    let simulated = simulate_with_axes(&scenario, std::slice::from_ref(&axis), seed);
    let mut recording = simulated.unwrap_or_else(|| unreachable!("the preset has a seam"));
    recording.axes.iter_mut().for_each(|axis| axis.known = None);
    // The simulated robot has noise, and no error that lasts.
    let exact = Config { robot_accuracy_m: Some(0.0), feature_bias_px: 0.0, ..Config::default() };
    let began = Instant::now();
    let found = calibrate(&recording, None, &exact);
    let seconds = began.elapsed().as_secs_f64();
    let refused = |words: String| Outcome {
        accepted: false,
        nees: None,
        said: [None; 3],
        largest_z: f64::NAN,
        seconds,
        words,
    };
    let found = match found {
        Ok(found) => found,
        Err(error) => return refused(format!("error: {error}")),
    };
    let codes: Vec<&str> = found.reasons().iter().map(|reason| reason.code()).collect();
    if found.status() != Status::Accepted {
        return refused(codes.join(" "));
    }
    let truth = recording.truth.as_ref().map(|truth| truth.parameters);
    let (own, own_z) = truth.map_or((f64::NAN, f64::NAN), |truth| of_links(&found, &truth));
    let (of_axis, axis_z) = of_axis(&found.findings.axes[0], &axis.axis);
    let said = said(&found.findings.axes[0]);
    let words = format!("accepted NEES {own:.2} {of_axis:.2} largest z {own_z:.1} {axis_z:.1} said {said:?}");
    Outcome { accepted: true, nees: Some([own, of_axis]), said, largest_z: own_z.max(axis_z), seconds, words }
}

fn said(axis: &AxisFinding) -> [Option<f64>; 3] {
    [
        axis.sigma(AxisPart::Direction).map(f64::to_degrees),
        axis.sigma(AxisPart::Place).map(|sigma_m| sigma_m * 1e3),
        axis.sigma(AxisPart::TimeOffset).map(|sigma_s| sigma_s * 1e3),
    ]
}

/// NEES over the number of unknowns and the largest error over its ±, of time offset and hand-eye.
fn of_links(found: &Calibration, truth: &Guess) -> (f64, f64) {
    let (turn, shift) = se3::difference_decoupled(found.file_tool_from_camera(), &truth.tool_from_camera);
    let offset_s = found.best_fit().time_offset_s - truth.time_offset_s;
    let error = DVector::from_vec(vec![offset_s, turn.x, turn.y, turn.z, shift.x, shift.y, shift.z]);
    normalised(&error, DMatrix::from_fn(7, 7, |i, j| found.covariance(i, j).unwrap_or(f64::NAN)))
}

/// The same of the numbers of an axis that are shown.
fn of_axis(found: &AxisFinding, truth: &Axis) -> (f64, f64) {
    let Some(covariance) = found.covariance() else { return (f64::NAN, f64::NAN) };
    let across = found.axis.across();
    let lean = across.tr_mul(truth.direction.as_ref());
    // The point of the true axis that is nearest to the found one.
    let off = truth.point_m - found.axis.point_m;
    let along = truth.direction.as_ref()
        * (found.axis.direction.dot(&off) / found.axis.direction.dot(&truth.direction));
    let place = across.tr_mul(&(off - along));
    let mut error = SVector::<f64, AXIS>::zeros();
    error.fixed_rows_mut::<2>(0).copy_from(&lean);
    error.fixed_rows_mut::<2>(AXIS_POINT).copy_from(&place);
    error[AXIS_TIME_OFFSET] = truth.time_offset_s - found.axis.time_offset_s;
    let parts = [(AxisPart::Direction, 0..2), (AxisPart::Place, 2..4), (AxisPart::TimeOffset, 5..6)];
    let shown: Vec<usize> =
        parts.into_iter().filter(|(part, _)| found.sigma(*part).is_some()).flat_map(|(_, k)| k).collect();
    if shown.is_empty() {
        return (f64::NAN, 0.0);
    }
    let own: &SMatrix<f64, AXIS, AXIS> = covariance;
    let error = DVector::from_fn(shown.len(), |i, _| error[shown[i]]);
    normalised(&error, DMatrix::from_fn(shown.len(), shown.len(), |i, j| own[(shown[i], shown[j])]))
}

fn normalised(error: &DVector<f64>, covariance: DMatrix<f64>) -> (f64, f64) {
    let z = (0..error.len()).map(|k| error[k].abs() / covariance[(k, k)].sqrt()).fold(0.0, f64::max);
    let square = covariance.cholesky().map_or(f64::NAN, |factor| error.dot(&factor.solve(error)));
    (square / error.len() as f64, z)
}

fn print_row(name: &str, outcomes: &[Outcome]) {
    let accepted = outcomes.iter().filter(|outcome| outcome.accepted).count();
    let mean = |k: usize| {
        let list: Vec<f64> =
            outcomes.iter().filter_map(|o| o.nees).map(|n| n[k]).filter(|n| n.is_finite()).collect();
        if list.is_empty() {
            "–".to_owned()
        } else {
            format!("{:.2}", list.iter().sum::<f64>() / list.len() as f64)
        }
    };
    let said = |k: usize| {
        let middle = median(outcomes.iter().filter_map(|o| o.said[k]));
        middle.map_or_else(|| "–".to_owned(), |sigma| format!("{sigma:.3}"))
    };
    let largest = outcomes.iter().map(|o| o.largest_z).filter(|z| z.is_finite()).fold(0.0, f64::max);
    let seconds = median(outcomes.iter().map(|o| o.seconds)).unwrap_or(0.0);
    println!(
        "| {name} | {accepted} of {} | {} | {} | {largest:.1} | {} | {} | {} | {seconds:.1} |",
        outcomes.len(),
        mean(0),
        mean(1),
        said(0),
        said(1),
        said(2)
    );
}
