//! `trueline simulate --shop`.

use crate::args::SimulateArgs;
use crate::failure::Failure;
use crate::output;
use std::fs;
use std::process::ExitCode;
use trueline_dataset::{WholeFolder, folder};
use trueline_sim::shop::Shop;

/// The check pass in the folder of a cell, and its truth there.
const CHECK: &str = "check";
const TRUTH: &str = "truth.json";

/// Writes the scan, and its check pass beside it.
pub(crate) fn run(args: &SimulateArgs, shop: &Shop) -> Result<ExitCode, Failure> {
    let cell = shop.cast().ok_or_else(|| {
        Failure::new(
            format!("the cell of seed {} has no scan that its sensor sees and its arm can follow", shop.seed),
            "another --seed has another cell",
        )
    })?;
    if let Some(kind) = shop.only.iter().flatten().find(|kind| !kind.is_of(cell.truth.sensor)) {
        return Err(Failure::new(
            format!(
                "`{}`: the sensor of seed {} cannot have it: {}",
                kind.row().name,
                shop.seed,
                cell.truth.sensor
            ),
            "another --seed has another sensor: a camera, a profiler, or one that gives points",
        ));
    }
    let whole = WholeFolder::begin(&args.out, args.force)?;
    folder::write(whole.path(), &cell.recording)?;
    let check = whole.path().join(CHECK);
    folder::write(&check, &cell.check)?;
    let truth = check.join(TRUTH);
    fs::write(&truth, cell.truth.to_json()).map_err(|error| Failure::cannot_write(&truth, &error))?;
    output::former_folder(&args.out, whole.finish()?);
    if !args.quiet {
        let truth = &cell.truth;
        output::words(&format!(
            "{}: {}; {}, {}, motion `{}`, {:.0} s, {} robot poses, {} features, time offset {:.2} ms",
            args.out.display(),
            truth.about(),
            truth.sensor,
            truth.arm,
            truth.motion.name(),
            truth.duration_s,
            cell.recording.robot.len(),
            cell.recording.features.len(),
            truth.time_offset_s * 1e3,
        ));
        output::words(&format!(
            "noise alone allows a seam error of {:.3} mm; {}",
            truth.bound_m * 1e3,
            if truth.is_good_scan() { "a good scan" } else { "too poor a scan to need an answer" },
        ));
    }
    Ok(ExitCode::SUCCESS)
}
