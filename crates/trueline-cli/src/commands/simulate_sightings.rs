//! `trueline simulate --sightings` and `--target`.

use crate::args::SimulateArgs;
use crate::failure::Failure;
use crate::output;
use std::path::Path;
use std::process::ExitCode;
use trueline_dataset::WholeFolder;
use trueline_sim::{RoundScan, RoundTarget, Sighted, SightingScan};

/// Runs the command for sightings.
pub(crate) fn run(args: &SimulateArgs, scan: &SightingScan) -> Result<ExitCode, Failure> {
    let cast = scan.cast();
    write(args, |folder| cast.write(folder))?;
    tell(args, scan, &cast, ["sightings", ""]);
    Ok(ExitCode::SUCCESS)
}

/// Runs the command for profiles of a round target.
pub(crate) fn run_round(args: &SimulateArgs, scan: &RoundScan) -> Result<ExitCode, Failure> {
    let cast = scan.cast();
    write(args, |folder| cast.write(folder))?;
    let target = match scan.target {
        RoundTarget::Sphere => "sphere",
        RoundTarget::Cylinder => "cylinder",
    };
    let options = format!(" --target {target} --radius-mm {}", scan.radius_m * 1e3);
    tell(args, &scan.sighted, &cast.sighted, ["profiles", &options]);
    Ok(ExitCode::SUCCESS)
}

fn write(
    args: &SimulateArgs,
    write: impl FnOnce(&Path) -> Result<(), trueline_dataset::Error>,
) -> Result<(), Failure> {
    let whole = WholeFolder::begin(&args.out, args.force)?;
    write(whole.path())?;
    output::former_folder(&args.out, whole.finish()?);
    Ok(())
}

/// Says what was written; `options` are those that calibrate it.
fn tell(args: &SimulateArgs, scan: &SightingScan, cast: &Sighted, [readings, options]: [&str; 2]) {
    if args.quiet {
        return;
    }
    let wrong = cast.wrong.iter().filter(|wrong| **wrong).count();
    let offset = if scan.at_stops {
        "at stops".to_owned()
    } else {
        format!("time offset {} ms", scan.time_offset_s * 1e3)
    };
    output::words(&format!(
        "{0}: {1} robot poses, {2} {readings} of which {wrong} are wrong, {offset}; the truth is in truth.toml\nnext: trueline \
         calibrate {0}{options}",
        args.out.display(),
        cast.robot.len(),
        cast.sightings.len(),
    ));
}
