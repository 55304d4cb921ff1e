//! `trueline diff`.

use crate::args::DiffArgs;
use crate::failure::Failure;
use crate::output;
use std::path::Path;
use std::process::ExitCode;
use trueline_dataset::Guess;
use trueline_dataset::calibration_file;
use trueline_dataset::result_file::ResultFile;
use trueline_dataset::unit::MM_PER_M;
use trueline_method::evaluate::difference::{Estimate, Field, between};
use trueline_report::comparison;

/// Runs the command.
pub(crate) fn run(args: &DiffArgs) -> Result<ExitCode, Failure> {
    output::expect_files(&[&args.first, &args.second], &[args.json.as_deref()])?;
    let (first, second) = (ResultFile::read(&args.first)?, ResultFile::read(&args.second)?);
    let field = field(args, &first)?;
    let known = [
        &calibration_file::known_of(&args.first, &first)?,
        &calibration_file::known_of(&args.second, &second)?,
    ];
    if let Some(mounted) = known[1].mounted {
        known[0].check_mounting(&args.first, mounted)?;
    }
    let estimates = (
        estimate(&args.first, known[0].known.parameters, &first)?,
        estimate(&args.second, known[1].known.parameters, &second)?,
    );
    let difference = between(&estimates.0, &estimates.1, &field).ok_or_else(|| {
        Failure::new("the covariances are not positive", "calibrate again: these results cannot be compared")
    })?;
    let tolerance_m = args.tolerance;
    if let Some(file) = &args.json {
        output::json(file, &format!("{:#}", comparison::json(&difference, &field, tolerance_m)))?;
    }
    let is_trusted = output::is_trusted(&args.first, known[0]) & output::is_trusted(&args.second, known[1]);
    comparison::other_file(known).into_iter().for_each(output::words);
    if !args.quiet {
        output::summary(args.json.as_deref(), &comparison::text(&difference, &field))?;
    }
    let harmless = tolerance_m.is_some_and(|tolerance_m| difference.seam_shift_rms_m <= tolerance_m);
    if let (Some(tolerance_m), false) = (tolerance_m, args.quiet) {
        let how = if harmless { "within" } else { "BEYOND" };
        output::words(&format!("the seam has moved {how} the tolerance of {} mm", tolerance_m * MM_PER_M));
    }
    let failed = if tolerance_m.is_some() { !harmless } else { difference.moved() };
    Ok(if failed || !is_trusted { ExitCode::from(1) } else { ExitCode::SUCCESS })
}

/// Points at which the seam is compared, and speed of the sensor.
fn field(args: &DiffArgs, first: &ResultFile) -> Result<Field, Failure> {
    let used = first.at_torch.as_ref();
    let stand_off_mm = args.stand_off_mm.or(used.map(|used| used.stand_off_mm)).ok_or_else(|| {
        Failure::new(
            format!("{} does not state the distance of the seam from the sensor", args.first.display()),
            "state it: --stand-off-mm 300",
        )
    })?;
    let speed_mm_s = args.speed_mm_s.or(used.map(|used| used.speed_mm_s)).unwrap_or(0.0);
    let lengths = [args.width_mm, args.depth_mm, stand_off_mm, speed_mm_s];
    if lengths.iter().any(|mm| !(mm.is_finite() && *mm >= 0.0)) {
        return Err(Failure::new(
            format!(
                "width, depth, stand-off and speed: expected numbers of at least zero, found {lengths:?}"
            ),
            "leave them out for the defaults",
        ));
    }
    let [width_m, depth_m, stand_off_m, speed_m_s] = lengths.map(|mm| mm / MM_PER_M);
    Ok(Field { width_m, depth_m, stand_off_m, speed_m_s })
}

/// The seven numbers of a result and their covariance.
fn estimate(file: &Path, parameters: Guess, result: &ResultFile) -> Result<Estimate, Failure> {
    comparison::estimate(parameters, result).map_err(|[row, column]| {
        Failure::new(
            format!("{}: there is no covariance of {row} and {column}", file.display()),
            "quantities held fixed or undetermined cannot be compared",
        )
    })
}
