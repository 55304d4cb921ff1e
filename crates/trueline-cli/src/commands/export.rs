//! `trueline export`.

use crate::args::ExportArgs;
use crate::args::export::{DEFAULT_CHILD, DEFAULT_TOOL};
use crate::failure::Failure;
use crate::output;
use std::path::Path;
use std::process::ExitCode;
use trueline_dataset::calibration_file::{self, KnownCalibration};
use trueline_dataset::result_file::{AxisEntry, ResultFile};
use trueline_dataset::sensor_setup::Mounted;
use trueline_dataset::{folder, sensor_toml};
use trueline_report::export::axes::{AxisForm, NoAxis, axis_named};
use trueline_report::export::curves::{CurveForm, CurvePoints, curve_named};
use trueline_report::export::{Mounting, named, time_offset};

/// Runs the command.
pub(crate) fn run(args: &ExportArgs) -> Result<ExitCode, Failure> {
    let (Some(result), Some(form)) = (&args.result, &args.form) else {
        output::summary(None, &trueline_report::export::list())?;
        return Ok(ExitCode::SUCCESS);
    };
    if let Some(form) = curve_named(form) {
        return curve(args, result, form);
    }
    if let Some(form) = axis_named(form) {
        return axes(args, result, form);
    }
    let calibration = calibration_file::read_without_time_offset(result)?;
    let known = &calibration.known.parameters;
    let beside_robot = calibration.mounted == Some(Mounted::Fixed);
    let carrier = if beside_robot { "base" } else { "flange" };
    let mut mounting = Mounting {
        parent: args.parent.clone().unwrap_or_else(|| carrier.to_owned()),
        child: args.child.clone(),
        tool_number: args.tool_number,
        ..Mounting::new(known.tool_from_camera, exported_offset_s(&calibration))
    };
    if let Some(file) = &args.sensor {
        let text = sensor_toml::read_text(file)?;
        mounting = mounting.with_camera_of(&sensor_toml::parse(file, &text)?);
        let sha256 = folder::sha256(text.as_bytes());
        if let Some(own) = calibration.sensor_file.as_ref().filter(|own| own.sha256 != sha256) {
            output::words(&format!(
                "warning: {} is not the file that the calibration belongs to ({}); name that file",
                file.display(),
                own.name
            ));
        }
    }
    let format = named(form).ok_or_else(|| {
        Failure::new(format!("there is no form `{form}`"), "`trueline export --list` names all")
    })?;
    let is_refused = calibration.accepted == Some(false);
    if is_refused && !calibration.at_stops && format.name == "time-offset" {
        output::words(&format!(
            "error: {}: the result was not accepted, so its time offset is not exported\n\nhint: {}",
            result.display(),
            "the result lists the reasons: remove their cause, and calibrate again"
        ));
        return Ok(ExitCode::from(1));
    }
    let text = format.text(&mounting).map_err(|error| {
        Failure::new(format!("{}: {error}", format.title), "choose another form: `trueline export --list`")
    })?;
    // Sentences are broken for the terminal; machine-readable output is not.
    if format.name == "time-offset" {
        output::summary(None, &text)?
    } else {
        output::data(&text)?
    }
    if !args.quiet {
        output::words(&format!("{}: {}", format.title, format.convention));
        explain(&calibration);
    }
    Ok(ExitCode::from(u8::from(!output::is_trusted(result, &calibration))))
}

/// Refuses options that say something of a transform.
fn refuse_options(args: &ExportArgs, what: &str) -> Result<(), Failure> {
    let ignored = [
        ("--parent", args.parent.is_some()),
        ("--sensor", args.sensor.is_some()),
        ("--child", args.child != DEFAULT_CHILD),
        ("--tool-number", args.tool_number != DEFAULT_TOOL),
    ];
    let Some((option, _)) = ignored.into_iter().find(|(_, given)| *given) else { return Ok(()) };
    Err(Failure::new(format!("`{option}` is of a transform, and {what}"), "leave it out"))
}

/// Writes the external axes of a result.
fn axes(args: &ExportArgs, file: &Path, form: &AxisForm) -> Result<ExitCode, Failure> {
    refuse_options(args, &format!("`--as {}` writes axes", form.name))?;
    let calibration = calibration_file::read_without_time_offset(file)?;
    let result = ResultFile::read(file)?;
    if result.axes.is_empty() {
        let why = format!("{}: the result has no external axes", file.display());
        return Err(Failure::new(why, "cell.toml and axes.csv beside robot.csv name them"));
    }
    let text = |axis: &AxisEntry| {
        form.text(axis).map_err(|why| {
            let hint = match why {
                NoAxis::NotShown => "its warnings name the motion that determines it",
                NoAxis::NotOfThisForm => "`--as axis-urdf` writes any axis",
            };
            Failure::new(format!("axis {}: {why}", axis.name), hint)
        })
    };
    let texts = result.axes.iter().map(text).collect::<Result<Vec<_>, _>>()?;
    output::data(&texts.join("\n"))?;
    if !args.quiet {
        output::words(&format!("{}: {}", form.title, form.convention));
    }
    Ok(ExitCode::from(u8::from(!output::is_trusted(file, &calibration))))
}

/// Writes the curve of a result.
fn curve(args: &ExportArgs, file: &Path, form: &CurveForm) -> Result<ExitCode, Failure> {
    refuse_options(args, &format!("`--as {}` writes a curve", form.name))?;
    let calibration = calibration_file::read_without_time_offset(file);
    let result = ResultFile::read(file)?;
    let found = match result.curves.first() {
        Some(found) if !found.points_mm.is_empty() => found,
        other => {
            let (why, hint) = if other.is_some() {
                (
                    "the scan does not determine the position of its curve",
                    "its reasons name the undetermined quantities",
                )
            } else {
                (
                    "the result has no curve: its seam is straight",
                    "its lines are in it: `jq .lines result.json`",
                )
            };
            return Err(Failure::new(format!("{}: {why}", file.display()), hint));
        }
    };
    if result.curves.len() > 1 {
        return Err(Failure::new(
            format!(
                "{}: the result has {} curves, and `--as {}` writes one",
                file.display(),
                result.curves.len(),
                form.name
            ),
            "their points are in the result: `jq .curves result.json`",
        ));
    }
    output::data(&form.text(CurvePoints { points_mm: &found.points_mm, sigma_mm: &found.sigma_mm }))?;
    if !args.quiet {
        output::words(&format!("{}: {}", form.title, form.convention));
    }
    Ok(ExitCode::from(u8::from(!output::is_trusted(file, &calibration?))))
}

/// The time offset, if there is one and the result was accepted.
fn exported_offset_s(calibration: &KnownCalibration) -> Option<f64> {
    let is_known = !calibration.at_stops && calibration.accepted != Some(false);
    is_known.then_some(calibration.known.parameters.time_offset_s)
}

/// Owner of the exported pose and time offset.
fn explain(calibration: &KnownCalibration) {
    let rule = match (calibration.at_stops, calibration.accepted) {
        (true, _) => "none: the robot stood still at each reading".to_owned(),
        (false, Some(false)) => "not exported: the result was not accepted".to_owned(),
        (false, _) => time_offset::rule(calibration.known.parameters.time_offset_s),
    };
    output::words(&format!("time offset: {rule}"));
    if calibration.mounted == Some(Mounted::Fixed) {
        output::words("the sensor stands beside the robot: this is its pose in the robot's base, no tool");
    }
    if let Some(file) = &calibration.sensor_file {
        output::words(&format!("belongs to the sensor file {} (SHA-256 {})", file.name, file.sha256));
    }
}
