//! `trueline doctor`.

use crate::args::DoctorArgs;
use crate::failure::Failure;
use crate::{logging, opening, output, progress};
use std::num::NonZeroUsize;
use std::process::ExitCode;
use std::time::Duration;
use trueline_dataset::folder;
use trueline_method::{Config, diagnose::doctor::diagnose};
use trueline_report::diagnosis;

/// Runs the command.
pub(crate) fn run(args: &DoctorArgs) -> Result<ExitCode, Failure> {
    output::expect_files(&[&args.dataset], &[args.json.as_deref()])?;
    let opened = opening::open(&args.dataset, None, args.quiet)?;
    let recording = &opened.recording;
    let threads = std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
    let config = Config { threads, ..Config::default() };
    let longest = Some(Duration::from_secs_f64(args.longest_s));
    let mut found = progress::steps(args.quiet, |watch| diagnose(recording, &config, longest, watch));
    let measured = found.calibration.as_ref().and_then(|calibration| opened.measured_offset(calibration));
    match &measured {
        Some(measured) if !measured.offset.agrees() => found.findings.push(measured.to_string()),
        Some(measured) if !args.quiet => output::words(&measured.to_string()),
        _ => {}
    }
    if let Some(file) = &args.json {
        output::json(file, &format!("{:#}", diagnosis::json(&found)))?;
    }
    if !args.quiet {
        output::summary(args.json.as_deref(), &diagnosis::text(&found, logging::is_verbose()))?;
    }
    let is_well = found.findings.is_empty();
    if let (Some(out), true) = (&args.fix, is_well) {
        output::words(&format!("{}: not written: there is nothing to fix", out.display()));
    } else if let Some(out) = &args.fix {
        let mended = found.mended(recording).ok_or_else(|| {
            let what = format!("{}: not written: no single mistake explains the fit", out.display());
            Failure::new(what, "the findings are listed above; change the files by hand, and try again")
        })?;
        output::former_folder(out, folder::write_whole(out, &mended, args.force)?);
        let mistake = found.explained_by.join(", ");
        output::words(&format!("{}: the dataset without the mistake: {mistake}", out.display()));
    }
    Ok(if is_well { ExitCode::SUCCESS } else { ExitCode::from(1) })
}
