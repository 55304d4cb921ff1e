//! Scans over curved seams, calibrated from nothing: how many are accepted and right, and are the ± honest?
//!
//! `cargo run --release -p trueline-studies -- curve_cells [CELLS A KIND] [KIND] [FIRST SEED] [--cells]` prints a row for each kind of
//! curve, and why scans were refused. With `--cells` a line for each cell as well.

use crate::arguments::number;
use nalgebra::{SMatrix, SVector};
use std::collections::BTreeMap;
use std::time::Instant;
use trueline_dataset::Guess;
use trueline_geometry::se3;
use trueline_method::order_statistics::median;
use trueline_method::{Calibration, Config, Status, calibrate};
use trueline_sim::curves::{CurveKind, CurveScan, scan_curve};

/// Cells of each kind, unless stated.
const CELLS: u64 = 60;
/// Time offset, rotation, translation.
const UNKNOWNS: usize = 7;
/// A time offset is right within this many of its ± …
const RIGHT_Z: f64 = 4.0;
/// … and within this, s.
const RIGHT_S: f64 = 1e-3;
/// An accepted answer is silently wrong beyond this many of its ±.
const WRONG_Z: f64 = 6.0;
/// Half a 95 % interval in standard deviations.
const HALF_95: f64 = 1.959_964;

/// What became of one scan.
#[derive(Default)]
struct Outcome {
    accepted: bool,
    /// Codes of the reasons, or the message of an error.
    reasons: Vec<String>,
    answer: Option<Answer>,
    seconds: f64,
}

/// An answer, against the truth.
struct Answer {
    is_curve: bool,
    /// Error of the time offset, s.
    offset_s: f64,
    /// Each error over its standard deviation; NaN where the scan does not show the unknown.
    z: SVector<f64, UNKNOWNS>,
    /// eᵀ C⁻¹ e over the number of unknowns; NaN where not all are shown.
    normalised: f64,
}

pub(crate) fn run(arguments: &[String]) -> Result<(), String> {
    let (options, places): (Vec<String>, Vec<String>) =
        arguments.iter().cloned().partition(|word| word.starts_with('-'));
    let (kinds, numbers): (Vec<String>, Vec<String>) =
        places.into_iter().partition(|word| CurveKind::ALL.iter().any(|kind| kind.name() == word));
    let count: u64 = number(&numbers, 0, CELLS)?;
    let first: u64 = number(&numbers, 1, 1)?;
    let prints_cells = options.iter().any(|option| option == "--cells");
    let is_wanted = |kind: &CurveKind| kinds.is_empty() || kinds.iter().any(|name| name == kind.name());
    println!("Right: time offset within 4 of its ± and 1 ms; wrong: accepted, and beyond 6 of its ±.\n");
    println!(
        "| curve | accepted | as a curve | as a line | right | offset wrong | any of the seven wrong | NEES/7 | t_d in 95 % | median s | refused for |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    for kind in CurveKind::ALL.into_iter().filter(is_wanted) {
        let outcome = |seed: u64| {
            let outcome = Outcome::of(kind, seed);
            if prints_cells {
                println!("{}-{seed:03} {}", kind.name(), outcome.in_words());
            }
            outcome
        };
        print_row(kind, &(first..first + count).map(outcome).collect::<Vec<_>>());
    }
    Ok(())
}

impl Outcome {
    fn of(kind: CurveKind, seed: u64) -> Self {
        let (recording, _) = scan_curve(&CurveScan::good(kind), seed);
        // The simulated robot has noise, and no error that lasts.
        let config = Config { robot_accuracy_m: Some(0.0), ..Config::default() };
        let began = Instant::now();
        let found = calibrate(&recording, None, &config);
        let seconds = began.elapsed().as_secs_f64();
        match found {
            Err(error) => Self { seconds, reasons: vec![format!("error: {error}")], ..Self::default() },
            Ok(found) => Self {
                seconds,
                accepted: found.status() == Status::Accepted,
                reasons: found.reasons().iter().map(|reason| reason.code().to_owned()).collect(),
                answer: recording.truth.map(|truth| Answer::of(&found, &truth.parameters)),
            },
        }
    }

    /// The answer, if it is accepted.
    fn taken(&self) -> Option<&Answer> {
        self.answer.as_ref().filter(|_| self.accepted)
    }

    fn in_words(&self) -> String {
        let status = if self.accepted { "accepted" } else { "refused" };
        let answer = self.answer.as_ref().map_or_else(String::new, |answer| {
            let z: Vec<String> = answer.z.iter().map(|z| format!("{z:.1}")).collect();
            let kind = if answer.is_curve { "curve" } else { "line" };
            format!(
                "{kind} t_d {:.4} ms z {} NEES/7 {:.2}",
                answer.offset_s * 1e3,
                z.join(" "),
                answer.normalised
            )
        });
        format!("{status} {answer} {:.2} s {}", self.seconds, self.reasons.join(" "))
    }
}

impl Answer {
    fn of(found: &Calibration, truth: &Guess) -> Self {
        let (turn, shift) = se3::difference_decoupled(found.file_tool_from_camera(), &truth.tool_from_camera);
        let offset_s = found.best_fit().time_offset_s - truth.time_offset_s;
        let error = SVector::from([offset_s, turn.x, turn.y, turn.z, shift.x, shift.y, shift.z]);
        let covariance =
            SMatrix::<f64, UNKNOWNS, UNKNOWNS>::from_fn(|i, j| found.covariance(i, j).unwrap_or(f64::NAN));
        let normalised = covariance.cholesky().map_or(f64::NAN, |factor| error.dot(&factor.solve(&error)));
        Self {
            is_curve: found.findings.curve.is_some(),
            offset_s,
            z: SVector::from_fn(|k, _| error[k] / covariance[(k, k)].sqrt()),
            normalised: normalised / UNKNOWNS as f64,
        }
    }

    fn is_right(&self) -> bool {
        self.z[0].abs() <= RIGHT_Z && self.offset_s.abs() <= RIGHT_S
    }
}

fn print_row(kind: CurveKind, outcomes: &[Outcome]) {
    let taken: Vec<&Answer> = outcomes.iter().filter_map(Outcome::taken).collect();
    let count = |of: &dyn Fn(&Answer) -> bool| taken.iter().filter(|answer| of(answer)).count();
    let curves = count(&|answer| answer.is_curve);
    let nees: Vec<f64> = taken.iter().map(|answer| answer.normalised).filter(|n| n.is_finite()).collect();
    // χ²₇/7 of each cell.
    let deviation = (2.0 / (UNKNOWNS * nees.len()) as f64).sqrt();
    let mut refused: BTreeMap<&str, usize> = BTreeMap::new();
    for reason in outcomes.iter().filter(|outcome| !outcome.accepted).flat_map(|outcome| &outcome.reasons) {
        *refused.entry(reason).or_default() += 1;
    }
    let refused: Vec<String> = refused.iter().map(|(code, count)| format!("{code} {count}")).collect();
    println!(
        "| {} | {} of {} | {curves} | {} | {} | {} | {} | {:.2} (1 ± {deviation:.2}) | {:.0} % | {:.2} | {} |",
        kind.name(),
        taken.len(),
        outcomes.len(),
        taken.len() - curves,
        count(&Answer::is_right),
        count(&|answer| answer.z[0].abs() > WRONG_Z),
        count(&|answer| answer.z.iter().any(|z| z.abs() > WRONG_Z)),
        nees.iter().sum::<f64>() / nees.len() as f64,
        100.0 * count(&|answer| answer.z[0].abs() <= HALF_95) as f64 / taken.len() as f64,
        median(outcomes.iter().map(|outcome| outcome.seconds)).unwrap_or(f64::NAN),
        refused.join(", ")
    );
}
