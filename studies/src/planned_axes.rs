//! Scans as planned in cells with an external axis: are the ± that a calibration states those that the plan promised, and are they true?
//!
//! `cargo run --release -p trueline-studies -- planned_axes [SCANS [WORDS OF A ROW [FIRST SEED]]]` prints a row for each axis: the ± stated over
//! promised of time offset and hand-eye (least to most of 7 numbers) and of each part of the axis, and the errors over the stated ±, RMS. Scans with a
//! stream on a regular clock are counted.
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a study fails by panicking")]

use crate::arguments::{number, word};
use crate::wrong_cells::cells::axes::{TABLE, TRACK, WRIST, cell, planned, scanned};
use rayon::prelude::*;
use trueline_geometry::{Axis, se3};
use trueline_method::axes::finding::{AxisFinding, AxisPart};
use trueline_method::problem::parameters::LINES;
use trueline_method::{Calibration, Config, Status, calibrate};
use trueline_plan::expected_axes::expected_axes;
use trueline_plan::{Cell, Plan};

/// Scans of each plan, unless stated.
const SCANS: u64 = 40;
/// The clock of an axis is late by this, s, as it is cast.
const AXIS_OFFSET_S: f64 = 0.02;

const ROWS: [(&str, &str, &str); 5] = [
    ("table swings", TABLE, "range_deg = [-30, 30]"),
    ("table stands", TABLE, "stand_deg = [0, 50, 100]"),
    ("track swings", TRACK, "range_mm = [-100, 200]"),
    ("wrist swings", WRIST, "range_deg = [-20, 20]"),
    ("wrist stands", WRIST, "stand_deg = [-20, 0, 20]"),
];

/// Time offset and hand-eye, and the parts of an axis.
const NUMBERS: usize = LINES + AxisPart::ALL.len();

/// What a scan gave.
struct Outcome {
    /// Stated over promised ±; none of what is hidden.
    ratios: [Option<f64>; NUMBERS],
    /// Error over the stated ±; of the parts of an axis the time offset alone.
    errors: [Option<f64>; NUMBERS],
    is_on_regular_clock: bool,
}

pub(crate) fn run(arguments: &[String]) -> Result<(), String> {
    let scans: u64 = number(arguments, 0, SCANS)?;
    let first: u64 = number(arguments, 2, 0)?;
    println!(
        "| axis | accepted | time offset, hand-eye | direction | place | axis' offset | errors | axis' offset | regular clock |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for (name, axis, limits) in ROWS.into_iter().filter(|row| row.0.contains(word(arguments, 1))) {
        let cell = cell(axis, limits);
        let plan = planned(&cell).expect("the cell can be planned");
        let said = expected_axes(&cell, &plan.motion, &plan.prediction);
        let all: Vec<Option<Outcome>> = (first..first + scans)
            .into_par_iter()
            .map(|seed| outcome(&cell, &plan, &said[0], seed))
            .collect();
        for (seed, outcome) in (first..).zip(&all) {
            match outcome {
                Some(outcome) if outcome.is_on_regular_clock => {
                    eprintln!(
                        "{name}, seed {seed}, regular clock: {:.2?}",
                        outcome.ratios.map(Option::unwrap_or_default)
                    );
                }
                Some(_) => {}
                None => eprintln!("{name}, seed {seed}: not accepted"),
            }
        }
        let accepted: Vec<&Outcome> = all.iter().flatten().collect();
        println!("| {name} | {} of {scans} | {} |", accepted.len(), row(&accepted));
    }
    Ok(())
}

fn outcome(cell: &Cell, plan: &Plan, said: &AxisFinding, seed: u64) -> Option<Outcome> {
    let recording = scanned(cell, plan, seed);
    let found = calibrate(&recording, None, &Config::noise_only()).ok()?;
    if found.status() != Status::Accepted {
        return None;
    }
    let own = &found.findings.axes[0];
    let mut ratios = [None; NUMBERS];
    for (k, ratio) in ratios.iter_mut().enumerate().take(LINES) {
        *ratio = Some(found.sigma(k)? / plan.prediction.sigma(k));
    }
    for (k, part) in AxisPart::ALL.into_iter().enumerate() {
        ratios[LINES + k] = own.sigma(part).zip(said.sigma(part)).map(|(own, said)| own / said);
    }
    let streams = &found.findings.streams;
    Some(Outcome {
        ratios,
        errors: errors(cell, &found),
        is_on_regular_clock: streams.images.dejittered || streams.robot.dejittered,
    })
}

fn errors(cell: &Cell, found: &Calibration) -> [Option<f64>; NUMBERS] {
    let (turn, shift) = se3::difference_decoupled(found.file_tool_from_camera(), &cell.tool_from_camera);
    let mut errors = [None; NUMBERS];
    for k in 0..3 {
        errors[1 + k] = found.sigma(1 + k).map(|sigma| turn[k] / sigma);
        errors[4 + k] = found.sigma(4 + k).map(|sigma| shift[k] / sigma);
    }
    let own = &found.findings.axes[0];
    let Axis { time_offset_s, .. } = own.axis;
    let of_offset = own.sigma(AxisPart::TimeOffset).map(|sigma| (time_offset_s - AXIS_OFFSET_S) / sigma);
    errors[NUMBERS - 1] = of_offset;
    errors
}

fn row(all: &[&Outcome]) -> String {
    let of = |numbers: std::ops::Range<usize>| -> Vec<f64> {
        all.iter().flat_map(|outcome| &outcome.ratios[numbers.clone()]).flatten().copied().collect()
    };
    let range = |list: &[f64]| {
        if list.is_empty() {
            return "–".to_owned();
        }
        let least = list.iter().copied().fold(f64::INFINITY, f64::min);
        let most = list.iter().copied().fold(0.0, f64::max);
        let mean = list.iter().sum::<f64>() / list.len() as f64;
        format!("{mean:.2} ({least:.2} to {most:.2})")
    };
    let rms = |numbers: std::ops::Range<usize>| {
        let list: Vec<f64> =
            all.iter().flat_map(|outcome| &outcome.errors[numbers.clone()]).flatten().copied().collect();
        if list.is_empty() {
            return "–".to_owned();
        }
        format!("{:.2}", (list.iter().map(|z| z * z).sum::<f64>() / list.len() as f64).sqrt())
    };
    let regular = all.iter().filter(|outcome| outcome.is_on_regular_clock).count();
    let [direction, place, offset] = [0, 1, 2].map(|k| range(&of(LINES + k..LINES + k + 1)));
    format!(
        "{} | {direction} | {place} | {offset} | {} | {} | {regular}",
        range(&of(0..LINES)),
        rms(1..LINES),
        rms(NUMBERS - 1..NUMBERS)
    )
}
