//! `trueline calibrate --target sphere` and `--target cylinder`.

use super::{calibrate_board, calibrate_poses};
use crate::args::CalibrateArgs;
use crate::failure::Failure;
use crate::{opening, output, progress};
use std::path::Path;
use std::process::ExitCode;
use trueline_dataset::Recording;
use trueline_dataset::result_file::Options;
use trueline_dataset::sensor_setup::Mounted;
use trueline_method::Hold;
use trueline_method::input::stops::Stops;
use trueline_report::pose_result::{self, PoseReport, RoundReport};
use trueline_sensor::board_files::pose_scan::SightingOptions;
use trueline_sensor::board_files::round_scan::{self, RoundCalibrationOptions};
use trueline_sensor::pose_verdict::{self, SightingRemark};
use trueline_sensor::round::RoundTarget;

/// Runs the command.
pub(crate) fn run(args: &CalibrateArgs, target: RoundTarget) -> Result<ExitCode, Failure> {
    let name = target.row().name;
    let [dataset] = args.datasets.as_slice() else {
        return Err(Failure::new(
            format!("--target {name} takes one dataset"),
            format!("calibrate one scan of the {name} at a time"),
        ));
    };
    refuse_others(args, name)?;
    let read = opening::measurements(dataset, args.quiet)?;
    let (recording, profiles) = (&read.recording, opening::all_profiles(&read)?);
    refuse_axes(dataset, recording, name)?;
    let (guess, guess_input) = calibrate_board::guess(args, dataset)?;
    let options = RoundCalibrationOptions {
        target,
        scan: SightingOptions {
            at_stops: args.at_stops,
            guess,
            holds_offset: args.fix.contains(&Hold::TimeOffset),
            offset_within_s: args.offset_within,
            robot_accuracy_m: args.robot_accuracy_mm.map(|mm| mm * 1e-3),
        },
        radius_m: args.radius_mm.map(|mm| mm * 1e-3),
        sensor: args.sensor,
    };
    let calibrate = || round_scan::calibrate(dataset, recording, &profiles, &options);
    let scan = progress::during("calibrating", args.quiet, calibrate)?;
    let (mut reasons, warnings) = pose_verdict::of_poses(&scan.round.pose, &scan.covariance);
    if scan.stops == Some(Stops::Recognised) {
        reasons.insert(0, SightingRemark::AtStops { stops: scan.round.pose.used.len() });
    }
    let inputs = recording.inputs.clone().into_iter().chain(guess_input).collect();
    let report = PoseReport {
        fit: &scan.round.pose,
        covariance: scan.covariance,
        reasons: &reasons,
        warnings: &warnings,
        robot_noise_m: scan.robot_noise_m,
        at_stops: scan.stops.is_some(),
        estimates_offset: scan.estimates_offset,
        beside_robot: recording.setup.mounted == Mounted::Fixed,
        round: Some(RoundReport { round: &scan.round, profiles: scan.profiles, mode: args.sensor }),
        options: Options {
            sensor: args.sensor.name().to_owned(),
            ..calibrate_poses::stated(args, &recording.setup, scan.stops.is_some())
        },
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

/// Options of seams would be ignored.
fn refuse_others(args: &CalibrateArgs, name: &str) -> Result<(), Failure> {
    if let Some(option) = args.not_of_poses().find(|option| *option != "--sensor") {
        return Err(Failure::new(
            format!("`{option}` does not apply to a {name}"),
            "leave it out; --radius-mm, --sensor, --initial, --fix time-offset, --offset-within, --at-stops, --robot-accuracy-mm \
             and --json apply",
        ));
    }
    Ok(())
}

fn refuse_axes(dataset: &Path, recording: &Recording, name: &str) -> Result<(), Failure> {
    if !recording.axes.is_empty() {
        return Err(Failure::new(
            format!("{}: external axes are not supported with --target {name}", dataset.display()),
            "keep the axes still and remove axes.csv, or calibrate the axes on a seam",
        ));
    }
    Ok(())
}
