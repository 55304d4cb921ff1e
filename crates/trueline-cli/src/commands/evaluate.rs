//! `trueline evaluate`.

use crate::args::EvaluateArgs;
use crate::failure::Failure;
use crate::{opening, output};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use trueline_dataset::unit::MM_PER_M;
use trueline_dataset::{KnownCalibration, Reference, calibration_file, reference_file};
use trueline_method::Config;
use trueline_method::evaluate::evaluation::evaluate;
use trueline_method::evaluate::other_cell::other_cell;
use trueline_method::evaluate::reference_curve::{Form, ReferenceCurve};
use trueline_method::evaluate::standstill::{self, Stop};
use trueline_report::evaluation_page::Judged;
use trueline_report::{evaluation_page, evaluation_summary};

/// Runs the command.
pub(crate) fn run(args: &EvaluateArgs) -> Result<ExitCode, Failure> {
    let inputs =
        [Some(&args.dataset), Some(&args.calibration), args.reference.as_ref(), args.static_scan.as_ref()];
    let inputs: Vec<&Path> = inputs.into_iter().flatten().map(PathBuf::as_path).collect();
    output::expect_files(&inputs, &[&args.json, &args.report, &args.csv].map(|file| file.as_deref()))?;
    let recording = opening::open(&args.dataset, None, args.quiet)?.recording;
    let calibration = calibration_file::read_without_time_offset(&args.calibration)?;
    let tolerance_m = args.tolerance;
    let is_trusted = output::fits(&args.calibration, &calibration, &recording)?;
    let recording = calibration.corrected(recording);
    let known = calibration.with_correction();
    if calibration.stamps_treated && !args.quiet {
        output::words(
            "note: that calibration used stamps with jitter or drift removed; this evaluation uses them as \
             recorded, as a robot that follows the seam would. The figures include their jitter and drift.",
        );
    }
    let stops = args.static_scan.as_deref().map(|scan| stops(scan, &calibration, args.quiet)).transpose()?;
    let references = references(args, &calibration, stops.as_deref())?;
    let is_own = references.is_some() && args.reference.is_none() && stops.is_none();
    let mut evaluation = evaluate(&recording, &known, references, args.fit)?;
    evaluation.known &= !is_own;
    let check = tolerance_m.map(|tolerance_m| evaluation.check(tolerance_m, args.coverage_percent / 100.0));
    let other = other_cell(&recording, &known, evaluation.fitted_median_m(), &Config::default());
    if let Some(file) = &args.json {
        let mut json = evaluation_summary::json(&evaluation, check.as_ref(), other.as_ref());
        if let Some(stops) = &stops {
            json["reference"]["stops"] = evaluation_summary::stops_json(stops);
        }
        json["said_seam_error_mm"] = calibration.seam_error_m.map(|said_m| said_m * MM_PER_M).into();
        output::json(file, &format!("{json:#}"))?;
    }
    if let Some(file) = &args.csv {
        let offset_s = known.time_offset_s;
        output::file(file, &evaluation_summary::points_csv(&evaluation, &recording.features, offset_s))?;
    }
    if let Some(file) = &args.report {
        let title = format!("{} by {}", args.dataset.display(), args.calibration.display());
        let judged = Judged { check: check.as_ref(), other: other.as_ref() };
        output::file(file, &evaluation_page::html(&evaluation, judged, &title, &output::command_line()))?;
    }
    if !args.quiet {
        let stops = stops.as_deref().map(evaluation_summary::stops_text).unwrap_or_default();
        output::summary(args.json.as_deref(), &format!("{stops}{}", evaluation_summary::text(&evaluation)))?;
    }
    let said = evaluation_summary::said_text(&evaluation, calibration.seam_error_m);
    said.iter().filter(|_| !args.quiet).for_each(|said| output::words(said));
    check.iter().for_each(|check| output::words(&evaluation_summary::tolerance_text(check)));
    other.iter().for_each(|other| output::words(&evaluation_summary::other_cell_text(other)));
    let passed = is_trusted
        && !other.is_some_and(|other| other.is_other_cell)
        && check.is_none_or(|check| check.passed());
    Ok(if passed { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

/// The points of a scan at which the robot stood still.
fn stops(scan: &Path, by: &KnownCalibration, quiet: bool) -> Result<Vec<Stop>, Failure> {
    let recording = by.corrected(opening::open(scan, None, quiet)?.recording);
    standstill::stops(&recording, &by.with_correction())
        .map_err(|e| Failure::new(format!("{}: {e}", scan.display()), e.hint()))
}

/// Expected form of the seams; `None` if it is fitted.
fn references(
    args: &EvaluateArgs,
    calibration: &KnownCalibration,
    stops: Option<&[Stop]>,
) -> Result<Option<Vec<ReferenceCurve>>, Failure> {
    Ok(match (&args.reference, stops) {
        (Some(file), _) => Some(curves(reference_file::read(file)?)),
        (None, Some(stops)) => Some(through(stops)?),
        // No form that is fitted is that of a curve: the calibration's own is.
        (None, None) if args.fit == Form::Auto => {
            let curves: Vec<ReferenceCurve> =
                calibration.curves.iter().cloned().map(ReferenceCurve::Curve).collect();
            (!curves.is_empty()).then_some(curves)
        }
        (None, None) => None,
    })
}

fn through(stops: &[Stop]) -> Result<Vec<ReferenceCurve>, Failure> {
    let curves = standstill::curves(stops).map_err(|e| Failure::new(e.to_string(), e.hint()))?;
    Ok(curves.into_iter().map(ReferenceCurve::Curve).collect())
}

fn curves(reference: Reference) -> Vec<ReferenceCurve> {
    match reference {
        Reference::Lines(lines) => lines.into_iter().map(ReferenceCurve::Line).collect(),
        Reference::Circle(circle) => vec![ReferenceCurve::Circle(circle)],
        Reference::Curve(curve) => vec![ReferenceCurve::Curve(curve)],
    }
}
