//! `trueline calibrate` of a dataset with several sensors on one robot.

use crate::args::CalibrateArgs;
use crate::failure::Failure;
use crate::{opening, output, progress};
use std::process::ExitCode;
use trueline_dataset::several_sensors::{self, SensorFolder};
use trueline_method::several_sensors::{Tied, tied};
use trueline_method::{Calibration, Status};
use trueline_report::{result, several_sensors as words, summary};

/// The sensors of the dataset that is asked for; `None` if it has one.
///
/// # Errors
/// Several sensors beside other scans, or with options that are of one sensor.
pub(crate) fn sensors(args: &CalibrateArgs) -> Result<Option<Vec<SensorFolder>>, Failure> {
    let mut found = None;
    for dataset in &args.datasets {
        found = found.or(several_sensors::of(dataset)?);
    }
    let Some(sensors) = found else { return Ok(None) };
    let of_one = [
        ("several datasets", args.datasets.len() > 1),
        ("--initial", args.initial.is_some()),
        ("--write-sensor", args.write_sensor.is_some()),
        ("--certificate", args.certificate.is_some()),
        ("--report", args.report.is_some()),
        ("--align-clocks", args.align_clocks),
    ];
    if let Some((option, _)) = of_one.into_iter().find(|(_, is_asked)| *is_asked) {
        return Err(Failure::new(
            format!("`{option}` is for one sensor, and this dataset has {}", sensors.len()),
            format!("calibrate one by itself: `trueline calibrate {}`", sensors[0].path.display()),
        ));
    }
    Ok(Some(sensors))
}

/// Calibrates each sensor, and ties them by their seams.
pub(crate) fn run(args: &CalibrateArgs, sensors: &[SensorFolder]) -> Result<ExitCode, Failure> {
    let config = args.config();
    let mut each = Vec::new();
    for SensorFolder { name, path } in sensors {
        let opened = opening::open(path, args.joint, args.quiet)?;
        let initial = opened.recording.initial;
        let calibrate = || trueline_method::calibrate(&opened.recording, initial.as_ref(), &config);
        let calibration = progress::during("calibrating", args.quiet, calibrate)?;
        for reason in calibration.reasons() {
            output::words(&format!("not accepted: {name}: {reason}"));
        }
        each.push((name.clone(), calibration));
    }
    let is_accepted = |(_, one): &(String, Calibration)| one.status() == Status::Accepted;
    let together = if each.iter().all(is_accepted) { tied(&each) } else { None };
    let agrees = together.as_ref().is_some_and(|tied| !tied.disagrees());
    if let Some(tied) = together.as_ref().filter(|_| !agrees) {
        output::words(&format!(
            "not accepted: the sensors contradict each other about a seam, by {:.1} of their ±: does a line of one number mean the same seam for each?",
            tied.apart_sigmas
        ));
    }
    write(args, &each, together.as_ref().filter(|_| agrees))?;
    Ok(if agrees { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

fn write(
    args: &CalibrateArgs,
    each: &[(String, Calibration)],
    together: Option<&Tied>,
) -> Result<(), Failure> {
    // The whole result is that of the first, unless another is refused.
    let refused = each.iter().find(|(_, one)| one.status() != Status::Accepted);
    let (_, first) = refused.unwrap_or(&each[0]);
    if let Some(file) = &args.json {
        let mut whole = result::of(first);
        if let Some(tied) = together {
            (whole.sensors, whole.between) = words::entries(tied);
        } else if refused.is_none() {
            whole.status = Some(trueline_dataset::result_file::Status::NotAccepted);
        }
        output::result(file, &whole)?;
    }
    if args.quiet {
        return Ok(());
    }
    for (name, one) in each {
        output::summary(args.json.as_deref(), &format!("Sensor {name}\n{}", summary::text(one)))?;
    }
    if let Some(tied) = together {
        output::summary(args.json.as_deref(), &words::text(tied))?;
    }
    Ok(())
}
