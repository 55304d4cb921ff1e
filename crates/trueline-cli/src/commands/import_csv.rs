//! `trueline import csv`.

use crate::args::ImportCsvArgs;
use crate::failure::Failure;
use crate::output;
use std::path::{Path, PathBuf};
use trueline_dataset::import::csv_folder::{CsvFolder, Imported, ProfileSource};
use trueline_dataset::import::profiles::{EvenColumns, ProfileFormat, Timing, times};
use trueline_dataset::import::robot_layout::RobotLayout;

/// Reads the files, and says what was recognised.
pub fn read(args: &ImportCsvArgs) -> Result<Imported, Failure> {
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
    .read()?;
    for note in &imported.notes {
        output::words(note);
    }
    Ok(imported)
}

/// The profiles that are named, or `profiles.csv` where there are no features.
fn profile_source(args: &ImportCsvArgs) -> Result<Option<ProfileSource>, Failure> {
    let usual = Path::new("profiles.csv");
    let file = match &args.profiles {
        Some(file) => file,
        None if !args.src.join(&args.features).exists() && args.src.join(usual).exists() => usual,
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
        return Err(Failure::new(
            format!("`--profile-rate-hz`: expected a rate above zero, found {hz}, from {start_s} s on"),
            "for example --profile-start-s 0 --profile-rate-hz 200",
        ));
    }
    Ok(Some(Timing::Rate { first_ns: (start_s * 1e9).round() as i64, hz }))
}

fn in_folder_or_here(folder: &Path, file: &Path) -> PathBuf {
    let inside = folder.join(file);
    if !inside.exists() && file.exists() { file.to_owned() } else { inside }
}
