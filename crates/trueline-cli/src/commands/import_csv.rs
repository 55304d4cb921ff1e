//! `trueline import csv`.

use crate::failure::Failure;
use crate::output;
use std::path::{Path, PathBuf};
use trueline_args::ImportCsvArgs;
use trueline_dataset::import::csv_folder::{CsvFolder, Imported, ProfileSource};
use trueline_dataset::import::profiles::{EvenColumns, ProfileFormat, Timing, times};
use trueline_dataset::import::robot_layout::RobotLayout;
use trueline_dataset::{Error, Problem};

/// Reads the files, and says what was recognised.
pub(crate) fn read(args: &ImportCsvArgs) -> Result<Imported, Failure> {
    let maker = args.robot.as_deref().and_then(RobotLayout::named);
    let layout = match args.euler {
        Some(sequence) => Some(RobotLayout::with_sequence(maker.as_ref(), sequence)),
        None => maker,
    };
    let imported = CsvFolder {
        robot: args.src.join(&args.robot_file),
        features: args.src.join(&args.features),
        profiles: profile_source(args)?,
        sensor: in_folder_or_here(&args.src, &args.sensor),
        robot_map: args.robot_map.clone(),
        features_map: args.features_map.clone(),
        layout,
        separator: args.delimiter,
    }
    .read()
    .map_err(with_mapping)?;
    for note in &imported.notes {
        output::words(note);
    }
    Ok(imported)
}

/// A column that is missing may have another name: the hint says how to tell.
fn with_mapping(error: Error) -> Failure {
    if matches!(error.problem, Problem::NoSuchFile) {
        return Failure::new(error.to_string(), "name the robot's log: --robot-file FILE, looked up in SRC");
    }
    let Problem::MissingColumn { name, found } = &error.problem else { return error.into() };
    let is_time =
        |theirs: &&str| ["time", "zeit", "stamp"].iter().any(|word| theirs.to_lowercase().contains(word));
    let theirs = found.split(", ").find(is_time).filter(|_| name.starts_with("time")).unwrap_or("THEIRS");
    let hint = format!(
        "which column is it? --robot-map {name}={theirs} (or --features-map); the unit stands in our name"
    );
    Failure::new(error.to_string(), hint)
}

/// The profiles that are named, or `profiles.csv` where there are no features.
fn profile_source(args: &ImportCsvArgs) -> Result<Option<ProfileSource>, Failure> {
    let usual = Path::new("profiles.csv");
    let is_there = |file: &Path| args.src.join(file).exists();
    if args.profiles.is_none() && !is_there(&args.features) && !is_there(usual) {
        return Err(Failure::new(
            format!("{}: there is neither {} nor profiles.csv", args.src.display(), args.features.display()),
            "name the file of the sensor: --profiles FILE for whole profiles, --features FILE for seam points",
        ));
    }
    let file = match &args.profiles {
        Some(file) => file,
        None if !is_there(&args.features) => usual,
        None => return Ok(None),
    };
    let even =
        args.x_start_mm.zip(args.x_step_mm).map(|(first_mm, step_mm)| EvenColumns { first_mm, step_mm });
    Ok(Some(ProfileSource {
        file: args.src.join(file),
        format: args.profile_format.as_deref().and_then(ProfileFormat::named),
        columns: even,
        timing: timing(args)?,
    }))
}

fn timing(args: &ImportCsvArgs) -> Result<Option<Timing>, Failure> {
    if let Some(file) = &args.profile_times {
        return Ok(Some(Timing::Stamps(times::read(&args.src.join(file))?)));
    }
    let Some((start_s, hz)) = args.profile_start_s.zip(args.profile_rate_hz) else {
        return Ok(None);
    };
    if !(hz > 0.0 && hz.is_finite() && start_s.abs() < 9e9) {
        let what =
            format!("`--profile-rate-hz`: expected a rate above zero, found {hz}, from {start_s} s on");
        return Err(Failure::new(what, "for example --profile-start-s 0 --profile-rate-hz 200"));
    }
    Ok(Some(Timing::Rate { first_ns: (start_s * 1e9).round() as i64, hz }))
}

fn in_folder_or_here(folder: &Path, file: &Path) -> PathBuf {
    let inside = folder.join(file);
    if !inside.exists() && file.exists() { file.to_owned() } else { inside }
}
