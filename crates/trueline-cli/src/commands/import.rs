//! `trueline import`.

use crate::args::{BagArgs, ImportArgs, ImportFormat, NewFolder};
use crate::failure::Failure;
use crate::{opening, output};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use trueline_dataset::dialect::plain_csv;
use trueline_dataset::import::{csv_folder, lvs_st_calib, tum};
use trueline_dataset::{PictureSource, Recording, SensorFile, features_csv, folder, sensor_toml};
use trueline_mcap::{Choice, DatasetFolder, import};

/// Runs the command.
pub(crate) fn run(args: &ImportArgs) -> Result<ExitCode, Failure> {
    let (recording, to) = match &args.format {
        ImportFormat::LvsStCalib { src, folder, robot, images, pixels, sensor } => {
            (lvs(src, [robot, images, pixels, sensor])?, folder)
        }
        ImportFormat::Csv(csv) => return super::import_csv::run(csv),
        ImportFormat::Tum { src, folder, features, sensor } => {
            (tum_recording(src, features, sensor)?, folder)
        }
        ImportFormat::Mcap(bag) => return unpack_bag(bag),
    };
    let out = &to.out;
    output::former_folder(out, folder::write_whole(out, &recording, to.force)?);
    summary(
        to,
        &format!(
            "{}: {} robot poses, {} features ({})",
            out.display(),
            recording.robot.len(),
            recording.features.len(),
            recording.sensor.kind(),
        ),
    );
    Ok(ExitCode::SUCCESS)
}

fn summary(to: &NewFolder, text: &str) {
    if !to.quiet {
        output::words(text);
    }
}

fn unpack_bag(args: &BagArgs) -> Result<ExitCode, Failure> {
    let choice = Choice {
        sensor: args.sensor.as_deref().map(sensor_toml::read).transpose()?,
        pose_topic: args.pose_topic.clone(),
        image_topic: args.image_topic.clone(),
        base_frame: args.base.clone(),
        tool_frame: args.tool.clone(),
        urdf: args.urdf.as_deref().map(sensor_toml::read_text).transpose()?,
        clock: args.stamps,
        no_return_m: args.no_return_mm.map(|mm| mm * 1e-3),
        allow_jpeg: args.allow_jpeg,
        axes: args.axes.clone(),
    };
    let folder = DatasetFolder::begin(&args.folder.out, args.folder.force)?;
    let imported = import(&args.src, &choice)?;
    output::former_folder(&args.folder.out, folder.write(&imported)?);
    opening::tell(&imported);
    summary(
        &args.folder,
        &format!(
            "{}: {} robot poses, {} pictures, {} profiles, {} features",
            args.folder.out.display(),
            imported.recording.robot.len(),
            imported.pictures.as_ref().map_or(0, PictureSource::count),
            imported.profiles.len(),
            imported.recording.features.len(),
        ),
    );
    Ok(ExitCode::SUCCESS)
}

fn lvs(src: &Path, files: [&Option<PathBuf>; 4]) -> Result<Recording, Failure> {
    match files {
        [Some(robot), Some(images), Some(pixels), Some(sensor)] => {
            let sensor_file = if sensor.exists() { sensor.clone() } else { src.join(sensor) };
            let sensor = sensor_toml::read(&sensor_file)?;
            Ok(lvs_st_calib::read_recording(&src.join(robot), &src.join(images), &src.join(pixels), sensor)?)
        }
        _ => Ok(lvs_st_calib::read_simulation(src)?),
    }
}

/// A trajectory, and the features and the sensor that belong to it.
fn tum_recording(poses: &Path, features: &Path, sensor: &Path) -> Result<Recording, Failure> {
    let SensorFile { sensor, setup } = sensor_toml::read(sensor)?;
    let (csv, dialect) = plain_csv(features, csv_folder::bytes_of(features)?, None)?;
    if !dialect.is_plain() {
        output::words(&format!("{}: {dialect}", features.display()));
    }
    let features = features_csv::read(features, csv.as_slice(), &sensor)?;
    let robot = tum::read_robot(poses)?;
    Ok(Recording::new(sensor, setup, robot, features))
}
