//! `trueline simulate --plates`.

use crate::failure::Failure;
use crate::output;
use std::process::ExitCode;
use trueline_args::SimulateArgs;
use trueline_dataset::{Recording, WholeFolder, folder};
use trueline_sim::{ProfileLook, Scenario, SensorModel, scan_plates, scan_profiles};

/// Runs the command.
pub(crate) fn run(args: &SimulateArgs, scenario: &Scenario) -> Result<ExitCode, Failure> {
    if scenario.cell.lines.len() != 1 {
        return Err(Failure::new(
            "two plates meet in one seam, and this preset has several",
            "choose another preset",
        ));
    }
    let plates = args.plates.plates(args.noise_free);
    let (recording, what) = match &scenario.cell.sensor {
        SensorModel::Profiler { .. } => {
            let look = if args.noise_free { perfect() } else { ProfileLook::default() };
            let (recording, profiles) =
                scan_profiles(scenario, &plates, &look, args.seed).ok_or_else(nothing_seen)?;
            let whole = WholeFolder::begin(&args.out, args.force)?;
            folder::write(whole.path(), &recording)?;
            folder::write_profiles(whole.path(), &profiles)?;
            whole.finish()?;
            (recording, format!("{} profiles", profiles.len()))
        }
        _ => {
            let recording = scan_plates(scenario, &plates, args.seed).ok_or_else(nothing_seen)?;
            if recording.stripes.is_empty() {
                return Err(nothing_seen());
            }
            folder::write_whole(&args.out, &recording, args.force)?;
            let what = format!("{} stripes, {} features", recording.stripes.len(), recording.features.len());
            (recording, what)
        }
    };
    if !args.quiet {
        tell(args, &recording, &what);
    }
    Ok(ExitCode::SUCCESS)
}

/// Columns without noise and drop-outs.
fn perfect() -> ProfileLook {
    ProfileLook { range_sigma_m: 0.0, drop_outs: 0.0, mixed: 0.0, reflections: 0.0, ..ProfileLook::default() }
}

fn nothing_seen() -> Failure {
    Failure::new(
        "the sensor never sees both plates",
        "`--plates` needs a camera or a profiler, and a scan of some length",
    )
}

fn tell(args: &SimulateArgs, recording: &Recording, what: &str) {
    output::words(&format!(
        "{}: {} robot poses, {what}, time offset {} ms",
        args.out.display(),
        recording.robot.len(),
        recording.truth.as_ref().map_or(0.0, |truth| truth.parameters.time_offset_s) * 1e3,
    ));
}
