//! `trueline simulate --sightings`.

use crate::args::SimulateArgs;
use crate::failure::Failure;
use crate::output;
use std::process::ExitCode;
use trueline_dataset::WholeFolder;
use trueline_sim::SightingScan;

/// Runs the command.
pub(crate) fn run(args: &SimulateArgs, scan: &SightingScan) -> Result<ExitCode, Failure> {
    let cast = scan.cast();
    let whole = WholeFolder::begin(&args.out, args.force)?;
    cast.write(whole.path())?;
    output::former_folder(&args.out, whole.finish()?);
    if !args.quiet {
        let wrong = cast.wrong.iter().filter(|wrong| **wrong).count();
        let offset = if scan.at_stops {
            "at stops".to_owned()
        } else {
            format!("time offset {} ms", scan.time_offset_s * 1e3)
        };
        output::words(&format!(
            "{0}: {1} robot poses, {2} sightings of which {wrong} are wrong, {offset}; the truth is in truth.toml\nnext: trueline \
             calibrate {0}",
            args.out.display(),
            cast.robot.len(),
            cast.sightings.len(),
        ));
    }
    Ok(ExitCode::SUCCESS)
}
