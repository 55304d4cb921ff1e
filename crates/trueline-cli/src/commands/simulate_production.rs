//! `trueline simulate --production`.

use crate::args::ProductionArgs;
use crate::failure::Failure;
use crate::output;
use std::path::Path;
use std::process::ExitCode;
use trueline_dataset::folder;
use trueline_sim::production::{Production, piece};

/// Writes so many welds.
pub fn run(
    args: &ProductionArgs,
    pieces: u32,
    out: &Path,
    seed: u64,
    quiet: bool,
) -> Result<ExitCode, Failure> {
    let production = Production { change: args.change, ..args.layout.production() };
    for number in 0..pieces {
        let recording = piece(&production, number as usize, seed);
        folder::write(&out.join(format!("weld-{number:04}")), &recording)?;
    }
    if !quiet {
        output::words(&format!(
            "{}: {pieces} welds; watch them with --calibration {}, the truth of the first",
            out.display(),
            out.join("weld-0000").join("truth.toml").display()
        ));
    }
    Ok(ExitCode::SUCCESS)
}
