//! `trueline simulate --production`.

use crate::args::{ProductionArgs, SimulateArgs};
use crate::failure::Failure;
use crate::output;
use std::process::ExitCode;
use trueline_dataset::folder;
use trueline_sim::Plates;
use trueline_sim::production::{Production, piece};

/// Writes this many welds.
pub(crate) fn run(args: &ProductionArgs, pieces: u32, of: &SimulateArgs) -> Result<ExitCode, Failure> {
    let out = &of.out;
    let plates = of.plates.plates.then(|| of.plates.plates(Plates::default(), false));
    let production = Production { change: args.change, plates, ..args.layout.production() };
    for number in 0..pieces {
        let recording = piece(&production, number as usize, of.seed);
        let folder = out.join(format!("weld-{number:04}"));
        output::former_folder(&folder, folder::write_whole(&folder, &recording, of.force)?);
    }
    if !of.quiet {
        output::words(&format!(
            "{}: {pieces} welds; watch them with --calibration {}, the truth of the first",
            out.display(),
            out.join("weld-0000").join("truth.toml").display()
        ));
    }
    Ok(ExitCode::SUCCESS)
}
