//! `trueline calibrate` of a dataset with several sensors on one robot.

use crate::args::CalibrateArgs;
use crate::failure::Failure;
use crate::{opening, output, progress};
use std::collections::BTreeMap;
use std::process::ExitCode;
use trueline_dataset::result_file::{Fact, ResultFile, Status as FileStatus};
use trueline_dataset::several_sensors::{self, SensorFolder};
use trueline_method::several_sensors::{Tied, tied};
use trueline_method::{Calibration, Status};
use trueline_report::{result, several_sensors as words, summary};

/// The sensors of the requested dataset; `None` if it has one.
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
            format!("`{option}` supports one sensor, but this dataset has {}", sensors.len()),
            format!("calibrate one separately: `trueline calibrate {}`", sensors[0].path.display()),
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
    let refused = each.iter().find(|one| !is_accepted(one));
    let together = if refused.is_none() { tied(&each) } else { None };
    let apart = refused.is_none().then(|| why_not(together.as_ref())).flatten();
    if let Some(apart) = &apart {
        output::words(&format!("not accepted: {}", apart.text));
    }
    let is_together = refused.is_none() && apart.is_none();
    // The whole result is that of the first, unless another is refused.
    let (_, first) = refused.unwrap_or(&each[0]);
    let mut whole = result::of(first);
    if let Some(apart) = apart {
        (whole.status, whole.reasons) = (Some(FileStatus::NotAccepted), vec![apart]);
    } else if let Some(tied) = &together {
        (whole.sensors, whole.between) = words::entries(tied);
    }
    write(args, &each, &whole, together.as_ref().filter(|_| is_together))?;
    Ok(if is_together { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

/// Why sensors that are each accepted are not accepted together.
fn why_not(together: Option<&Tied>) -> Option<Fact> {
    let (code, text, values) = match together {
        None => (
            "sensors-not-tied",
            "the sensors have no common seams, so nothing ties them together".to_owned(),
            BTreeMap::new(),
        ),
        Some(tied) if tied.disagrees() => {
            let sigmas = tied.apart_sigmas;
            let text = format!(
                "the sensors contradict each other about a seam, by {sigmas:.1} σ: check that each line \
                    number means the same seam for all"
            );
            ("sensors-disagree", text, BTreeMap::from([("sigmas".to_owned(), sigmas.into())]))
        }
        Some(_) => return None,
    };
    Some(Fact { code: code.to_owned(), text, values })
}

fn write(
    args: &CalibrateArgs,
    each: &[(String, Calibration)],
    whole: &ResultFile,
    together: Option<&Tied>,
) -> Result<(), Failure> {
    if let Some(file) = &args.json {
        output::result(file, whole)?;
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
