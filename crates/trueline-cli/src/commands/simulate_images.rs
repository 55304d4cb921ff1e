//! `trueline simulate --images`.

use crate::args::SimulateArgs;
use crate::failure::Failure;
use crate::{output, progress};
use std::process::ExitCode;
use trueline_dataset::{WholeFolder, folder};
use trueline_sim::faults::Event;
use trueline_sim::images::{WrittenPictures, write_pictures};
use trueline_sim::{Fault, PictureScan, Scenario, simulate_with_faults};

/// Runs the command.
pub(crate) fn run(args: &SimulateArgs, scenario: &Scenario) -> Result<ExitCode, Failure> {
    let scan = scan(args, scenario)?;
    let mut recording = simulate_with_faults(scenario, &args.faults, args.seed).ok_or_else(no_pictures)?;
    recording.features.clear();
    // The joint may have other lines than the scenario's one seam; without a joint, that is where the seam would be.
    if let Some(truth) = recording.truth.as_mut().filter(|_| !scan.lines().is_empty()) {
        truth.lines = scan.lines();
    }
    let whole = WholeFolder::begin(&args.out, args.force)?;
    folder::write(whole.path(), &recording)?;
    let bar = progress::bar(scan.exposures().len() as u64, "pictures", args.quiet);
    let written = write_pictures(whole.path(), &scan, &|| bar.inc(1));
    bar.finish_and_clear();
    let WrittenPictures { pictures, with_seam } = written?;
    output::former_folder(&args.out, whole.finish()?);
    if !args.quiet {
        output::words(&format!(
            "{}: {} robot poses, {pictures} pictures, the seam in {with_seam} of them, time offset {} ms",
            args.out.display(),
            recording.robot.len(),
            scenario.timing.time_offset_s * 1e3,
        ));
    }
    Ok(ExitCode::SUCCESS)
}

/// Faults of the robot's stream alone, independent of the camera.
const ROBOT_STREAM_FAULTS: [Fault; 3] =
    [Fault::Event(Event::RobotGaps), Fault::Event(Event::DuplicateRows), Fault::Event(Event::RobotClockStep)];

fn no_pictures() -> Failure {
    Failure::new(
        "this preset has no camera, or no line",
        "--images needs a preset with a camera: paper or quick",
    )
}

fn scan<'a>(args: &SimulateArgs, scenario: &'a Scenario) -> Result<PictureScan<'a>, Failure> {
    if scenario.cell.lines.len() != 1 {
        return Err(Failure::new(
            "pictures show one seam, and this preset has several",
            "choose another preset",
        ));
    }
    if !args.faults.iter().all(|fault| ROBOT_STREAM_FAULTS.contains(fault)) {
        return Err(Failure::new(
            "`--fault` changes features, and pictures have none",
            "leave one of them out; robot-gaps, duplicate-rows and robot-clock-step work with both",
        ));
    }
    PictureScan::new(scenario, args.joint(), args.look(), args.seed).ok_or_else(no_pictures)
}
