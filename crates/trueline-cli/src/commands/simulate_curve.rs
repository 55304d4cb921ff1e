//! `trueline simulate --seam`.

use crate::args::SimulateArgs;
use crate::failure::Failure;
use crate::output;
use crate::planned_scan::curve_csv;
use std::process::ExitCode;
use trueline_dataset::{Recording, WholeFolder, folder};
use trueline_sim::curves::{CurveScan, scan_curve};

/// Points of the true curve in the folder of a scan, mm in base.
const CURVE: &str = "truth_curve.csv";

/// Writes a scan and points of its true curve, a table.
pub(super) fn write(args: &SimulateArgs, recording: &Recording, curve: &str) -> Result<(), Failure> {
    let whole = WholeFolder::begin(&args.out, args.force)?;
    folder::write(whole.path(), recording)?;
    output::file(&whole.path().join(CURVE), curve)?;
    output::former_folder(&args.out, whole.finish()?);
    Ok(())
}

/// Runs the command.
pub(crate) fn run(args: &SimulateArgs, scan: &CurveScan) -> Result<ExitCode, Failure> {
    let (recording, points) = scan_curve(scan, args.seed);
    write(args, &recording, &curve_csv(points.iter().map(|point| (*point).into())))?;
    if !args.quiet {
        output::words(&format!(
            "{0}: {1}, {2} times in {3} s: {4} robot poses, {5} features{7}, time offset {6:.2} ms; the true curve is in {CURVE}\nnext: \
             trueline calibrate {0}",
            args.out.display(),
            scan.kind.name(),
            scan.passes,
            scan.lasts_s,
            recording.robot.len(),
            recording.features.len(),
            recording.truth.as_ref().map_or(0.0, |truth| truth.parameters.time_offset_s) * 1e3,
            match recording.stripes.len() {
                0 => String::new(),
                stripes => format!(", {stripes} stripes"),
            },
        ));
    }
    Ok(ExitCode::SUCCESS)
}
