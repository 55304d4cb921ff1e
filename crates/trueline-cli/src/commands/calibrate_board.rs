//! `trueline calibrate --target board`: the reference with a board that the moving robot looks at.

use crate::args::{CalibrateArgs, TargetName};
use crate::failure::Failure;
use crate::output;
use std::fs;
use std::path::Path;
use std::process::ExitCode;
use trueline_dataset::{Guess, calibration_file, folder, sensor_toml};
use trueline_method::Hold;
use trueline_method::input::stops::Stops;
use trueline_report::board_result::{self, BoardReport};
use trueline_sensor::board_files::BoardError;
use trueline_sensor::board_files::moving_scan::{self, BoardOptions};
use trueline_sensor::verdict::Remark;
use trueline_sensor::{Board, verdict};

/// The sensor of a dataset.
const SENSOR_FILE: &str = "sensor.toml";

/// Runs the command.
pub(crate) fn run(args: &CalibrateArgs, board: &Board) -> Result<ExitCode, Failure> {
    if args.target != TargetName::Board {
        return Err(Failure::new(
            "--board belongs to --target board",
            "add --target board, or leave --board out",
        ));
    }
    let [dataset] = args.datasets.as_slice() else {
        return Err(Failure::new(
            "--target board takes one dataset",
            "calibrate one scan of the board at a time",
        ));
    };
    let (options, guess_input) = options(args, dataset)?;
    let scan = moving_scan::calibrate(dataset, board, &options)?;
    let (mut reasons, warnings) = verdict::of_board(&scan.fit, &scan.covariance);
    if scan.stops == Some(Stops::Recognised) {
        reasons.insert(0, Remark::AtStops { stops: scan.fit.used.len() });
    }
    let (robot_name, robot_sha256) = scan.robot_file.clone();
    let of_robot = [(robot_name.to_owned(), robot_sha256)];
    let inputs = of_robot.into_iter().chain(sensor_input(dataset)).chain(guess_input).collect();
    let report = BoardReport {
        fit: &scan.fit,
        covariance: scan.covariance,
        reasons: &reasons,
        warnings: &warnings,
        corner_sigma_px: scan.corner_sigma_px,
        robot_noise_m: scan.robot_noise_m,
        skipped: &scan.skipped,
        at_stops: scan.stops.is_some(),
        shows_time_offset: scan.shows_time_offset,
        inputs: &inputs,
    };
    if let Some(file) = &args.json {
        output::result(file, &board_result::of(&report))?;
    }
    if !args.quiet {
        output::summary(args.json.as_deref(), &board_result::text(&report))?;
    }
    Ok(if reasons.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

/// The sensor's file with its SHA-256: the transform belongs to it.
fn sensor_input(dataset: &Path) -> Option<(String, String)> {
    let bytes = fs::read(dataset.join(SENSOR_FILE)).ok()?;
    Some((SENSOR_FILE.to_owned(), folder::sha256(&bytes)))
}

/// The user's prior knowledge, and its file with its SHA-256.
fn options(
    args: &CalibrateArgs,
    dataset: &Path,
) -> Result<(BoardOptions, Option<(String, String)>), Failure> {
    let (guess, input) = guess(args, dataset)?;
    let holds_offset = args.fix.contains(&Hold::TimeOffset);
    let robot_accuracy_m = args.robot_accuracy_mm.map(|mm| mm * 1e-3);
    Ok((BoardOptions { at_stops: args.at_stops, guess, holds_offset, robot_accuracy_m }, input))
}

/// A file and its SHA-256.
pub(crate) type NamedHash = (String, String);

/// The start, and its file with its SHA-256. If the target is estimated, it holds all of the hand-eye transform.
///
/// # Errors
/// A hand-eye transform or a time offset that is held without a value; a file that cannot be used.
pub(crate) fn guess(
    args: &CalibrateArgs,
    dataset: &Path,
) -> Result<(Option<Guess>, Option<NamedHash>), Failure> {
    if args.fix.contains(&Hold::HandEye) {
        let hint = "hold the time offset alone: --fix time-offset";
        return Err(Failure::new(
            "the hand-eye transform cannot be held: it is the result of a board or a sighted target",
            hint,
        ));
    }
    let holds_offset = args.fix.contains(&Hold::TimeOffset);
    let beside = dataset.join("initial.toml");
    let file = args.initial.clone().or_else(|| beside.exists().then_some(beside));
    if holds_offset && file.is_none() && !args.at_stops {
        let message = "`time-offset` cannot be held fixed: there is no initial value for it";
        return Err(Failure::new(message, "give it in initial.toml or with --initial"));
    }
    let text = file.as_ref().map(|file| sensor_toml::read_text(file)).transpose()?;
    let read = file.as_ref().zip(text.as_ref());
    let guess = read.map(|(file, text)| calibration_file::parse_guess(file, text)).transpose()?;
    let input = read.map(|(file, text)| (file.display().to_string(), folder::sha256(text.as_bytes())));
    Ok((guess, input))
}

impl From<BoardError> for Failure {
    fn from(error: BoardError) -> Self {
        Self::new(error.to_string(), error.hint())
    }
}
