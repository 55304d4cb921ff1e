//! `trueline calibrate` of a dataset of pose sightings.

use super::calibrate_board;
use crate::args::CalibrateArgs;
use crate::failure::Failure;
use crate::{output, progress};
use std::path::Path;
use std::process::ExitCode;
use trueline_dataset::pose_folder;
use trueline_dataset::result_file::Options;
use trueline_dataset::sensor_setup::{Mounted, SensorSetup};
use trueline_method::Hold;
use trueline_method::input::stops::Stops;
use trueline_report::pose_result::{self, PoseReport};
use trueline_sensor::board_files::pose_scan::{self, SightingOptions};
use trueline_sensor::pose_verdict::{self, SightingRemark};

/// The dataset of a command line that calibrates pose sightings, if it does.
///
/// # Errors
/// Sightings beside other datasets: each is calibrated separately.
pub(crate) fn dataset(args: &CalibrateArgs) -> Result<Option<&Path>, Failure> {
    match args.datasets.as_slice() {
        [one] => Ok(pose_folder::is_one(one).then_some(one.as_path())),
        several => match several.iter().find(|dataset| pose_folder::is_one(dataset)) {
            Some(one) => Err(Failure::new(
                format!("{}: calibrate a dataset of pose sightings separately", one.display()),
                "calibrate one of them at a time",
            )),
            None => Ok(None),
        },
    }
}

/// Runs the command.
pub(crate) fn run(args: &CalibrateArgs, dataset: &Path) -> Result<ExitCode, Failure> {
    if let Some(option) = args.not_of_poses().next() {
        return Err(Failure::new(
            format!(
                "`{option}` does not apply to pose sightings: {} has `kind = \"poses\"`",
                dataset.display()
            ),
            "leave it out; --initial, --fix time-offset, --offset-within, --at-stops, --robot-accuracy-mm and --json apply",
        ));
    }
    let read = pose_folder::read(dataset)?;
    if !args.quiet {
        read.notes.iter().for_each(|note| output::words(note));
    }
    let (guess, guess_input) = calibrate_board::guess(args, dataset)?;
    let options = SightingOptions {
        at_stops: args.at_stops,
        guess,
        holds_offset: args.fix.contains(&Hold::TimeOffset),
        offset_within_s: args.offset_within,
        robot_accuracy_m: args.robot_accuracy_mm.map(|mm| mm * 1e-3),
    };
    let calibrate = || pose_scan::calibrate(dataset, &read, &options);
    let scan = progress::during("calibrating", args.quiet, calibrate)?;
    let (mut reasons, warnings) = pose_verdict::of_poses(&scan.fit, &scan.covariance);
    if scan.stops == Some(Stops::Recognised) {
        reasons.insert(0, SightingRemark::AtStops { stops: scan.fit.used.len() });
    }
    let inputs = read.inputs.clone().into_iter().chain(guess_input).collect();
    let report = PoseReport {
        fit: &scan.fit,
        covariance: scan.covariance,
        reasons: &reasons,
        warnings: &warnings,
        robot_noise_m: scan.robot_noise_m,
        at_stops: scan.stops.is_some(),
        estimates_offset: scan.estimates_offset,
        beside_robot: read.setup.mounted == Mounted::Fixed,
        round: None,
        options: stated(args, &read.setup, scan.stops.is_some()),
        inputs: &inputs,
    };
    if let Some(file) = &args.json {
        output::result(file, &pose_result::of(&report))?;
    }
    if args.quiet {
        reasons.iter().for_each(|reason| output::words(&format!("not accepted: {reason}")));
    } else {
        output::summary(args.json.as_deref(), &pose_result::text(&report))?;
    }
    Ok(if reasons.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

/// The options, as the result states them.
pub(crate) fn stated(args: &CalibrateArgs, setup: &SensorSetup, at_stops: bool) -> Options {
    let accuracy_mm = args.robot_accuracy_mm.or(setup.robot_accuracy_m.map(|m| m * 1e3));
    Options {
        at_stops,
        fix: args.fix.iter().map(|hold| hold.name().to_owned()).collect(),
        offset_within_s: args.offset_within,
        robot_accuracy_mm: accuracy_mm,
        offset_search_s: args.offset_within.unwrap_or(trueline_sensor::board_hand_eye::poses::REACH_S),
        ..Options::default()
    }
}
