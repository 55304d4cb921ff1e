//! `trueline simulate --plates`.

use crate::args::SimulateArgs;
use crate::failure::Failure;
use crate::output;
use crate::planned_scan::PlannedScan;
use std::process::ExitCode;
use trueline_dataset::{Recording, WholeFolder, folder};
use trueline_experiments::planned;
use trueline_geometry::Pose;
use trueline_sim::motion::Motion;
use trueline_sim::{Plates, Scenario, SensorModel, scan_plates_along, scan_profiles_along};

/// Runs the command along the scenario's own path.
pub(crate) fn run(args: &SimulateArgs, scenario: &Scenario) -> Result<ExitCode, Failure> {
    if scenario.cell.lines.len() != 1 {
        return Err(Failure::new(
            "two plates meet in one seam, and this preset has several",
            "choose another preset",
        ));
    }
    let motion = Motion::new(scenario).ok_or_else(nothing_seen)?;
    let plates = args.plates.plates(Plates::default(), args.noise_free);
    along(args, scenario, &plates, &|time_s| motion.base_from_tool(time_s))
}

/// The same along a plan, with the plates of its cell.
pub(crate) fn follow(args: &SimulateArgs, planned: PlannedScan) -> Result<ExitCode, Failure> {
    let PlannedScan { mut scenario, path, cell, .. } = planned;
    args.adapt(&mut scenario);
    let usual = planned::plates(&cell, &mut scenario)
        .map_err(|why| Failure::new(format!("--plates: {why}"), why.hint()))?;
    let plates = args.plates.plates(usual, args.noise_free);
    along(args, &scenario, &plates, &|time_s| path.base_from_tool(time_s))
}

fn along(
    args: &SimulateArgs,
    scenario: &Scenario,
    plates: &Plates,
    base_from_tool: &dyn Fn(f64) -> Pose,
) -> Result<ExitCode, Failure> {
    let (recording, what) = match &scenario.cell.sensor {
        SensorModel::Profiler { .. } => {
            let look = args.plates.profile_look(scenario.disturbance.feature_noise_m, args.noise_free);
            let (recording, profiles) =
                scan_profiles_along(scenario, plates, &look, base_from_tool, args.seed)
                    .ok_or_else(nothing_seen)?;
            let whole = WholeFolder::begin(&args.out, args.force)?;
            folder::write(whole.path(), &recording)?;
            folder::write_profiles(whole.path(), &profiles, args.plates.profile_form())?;
            output::former_folder(&args.out, whole.finish()?);
            (recording, format!("{} profiles", profiles.len()))
        }
        _ => {
            let recording =
                scan_plates_along(scenario, plates, base_from_tool, args.seed).ok_or_else(nothing_seen)?;
            if recording.features.is_empty() {
                return Err(nothing_seen());
            }
            output::former_folder(&args.out, folder::write_whole(&args.out, &recording, args.force)?);
            let what = format!("{} stripes, {} features", recording.stripes.len(), recording.features.len());
            (recording, what)
        }
    };
    if !args.quiet {
        tell(args, &recording, &what);
    }
    Ok(ExitCode::SUCCESS)
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
