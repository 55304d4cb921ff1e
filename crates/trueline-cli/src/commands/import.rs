//! `trueline import`.

use crate::args::{BagArgs, ClockName, ImportArgs, ImportFormat};
use crate::failure::Failure;
use crate::{opened_dataset, output};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use trueline_dataset::import::csv_columns::{ColumnMapping, rename};
use trueline_dataset::import::{lvs_st_calib, tum};
use trueline_dataset::{
    Error, PictureSource, Problem, Recording, SensorFile, features_csv, folder, robot_csv, sensor_toml,
};
use trueline_mcap::{Choice, DatasetFolder, StampClock, import};

/// Runs the command.
pub fn run(args: &ImportArgs) -> Result<ExitCode, Failure> {
    let (recording, out) = match &args.format {
        ImportFormat::LvsStCalib { src, out, robot, images, pixels, sensor } => {
            (lvs(src, [robot, images, pixels, sensor])?, out)
        }
        ImportFormat::Csv { src, out, robot, features, sensor, robot_map, features_map, delimiter } => {
            let delimiter = u8::try_from(*delimiter).map_err(|_| {
                Failure::new("`--delimiter`: expected one ASCII character", "for example --delimiter ';'")
            })?;
            let sensor = read_sensor(&src.join(sensor))?;
            let foreign = Foreign { delimiter, sensor };
            (foreign.read(&src.join(robot), robot_map, &src.join(features), features_map)?, out)
        }
        ImportFormat::Tum { src, out, features, sensor } => {
            let foreign = Foreign { delimiter: b',', sensor: read_sensor(sensor)? };
            let features = foreign.features(features, &[])?;
            (foreign.recording(tum::read_robot(src)?, features), out)
        }
        ImportFormat::Mcap(bag) | ImportFormat::Rosbag2(bag) => return unpack_bag(bag),
    };
    folder::write(out, &recording)?;
    output::words(&format!(
        "{}: {} robot poses, {} features ({})",
        out.display(),
        recording.robot.len(),
        recording.features.len(),
        recording.sensor.kind(),
    ));
    Ok(ExitCode::SUCCESS)
}

fn unpack_bag(args: &BagArgs) -> Result<ExitCode, Failure> {
    let choice = Choice {
        sensor: args.sensor.as_deref().map(read_sensor).transpose()?,
        pose_topic: args.pose_topic.clone(),
        image_topic: args.image_topic.clone(),
        base_frame: args.base.clone(),
        tool_frame: args.tool.clone(),
        clock: match args.stamps {
            ClockName::Recorded => StampClock::Recorded,
            ClockName::Ptp => StampClock::Ptp,
        },
    };
    let folder = DatasetFolder::begin(&args.out)?;
    let imported = import(&args.src, &choice)?;
    folder.write(&imported)?;
    opened_dataset::tell(&imported, false);
    output::words(&format!(
        "{}: {} robot poses, {} pictures, {} features",
        args.out.display(),
        imported.recording.robot.len(),
        imported.pictures.as_ref().map_or(0, PictureSource::count),
        imported.recording.features.len(),
    ));
    Ok(ExitCode::SUCCESS)
}

fn lvs(src: &Path, files: [&Option<PathBuf>; 4]) -> Result<Recording, Failure> {
    match files {
        [Some(robot), Some(images), Some(pixels), Some(sensor)] => {
            let sensor_file = if sensor.exists() { sensor.clone() } else { src.join(sensor) };
            let sensor = read_sensor(&sensor_file)?;
            Ok(lvs_st_calib::read_recording(&src.join(robot), &src.join(images), &src.join(pixels), sensor)?)
        }
        _ => Ok(lvs_st_calib::read_simulation(src)?),
    }
}

fn read_sensor(file: &Path) -> Result<SensorFile, Failure> {
    let text = std::fs::read_to_string(file).map_err(|error| {
        let missing = error.kind() == std::io::ErrorKind::NotFound;
        Error::in_file(file, if missing { Problem::Missing } else { Problem::Io(error) })
    })?;
    Ok(sensor_toml::parse_file(file, &text)?)
}

/// CSV files of another program and the sensor they belong to.
struct Foreign {
    delimiter: u8,
    sensor: SensorFile,
}

impl Foreign {
    fn read(
        &self,
        robot: &Path,
        robot_map: &[String],
        features: &Path,
        features_map: &[String],
    ) -> Result<Recording, Failure> {
        let robot_csv = self.table(robot, robot_map)?;
        let samples = robot_csv::read(robot, robot_csv.as_slice())?;
        Ok(self.recording(samples, self.features(features, features_map)?))
    }

    fn features(&self, file: &Path, map: &[String]) -> Result<Vec<trueline_dataset::Feature>, Failure> {
        Ok(features_csv::read(file, self.table(file, map)?.as_slice(), &self.sensor.sensor)?)
    }

    /// The file as CSV with our column names.
    fn table(&self, file: &Path, map: &[String]) -> Result<Vec<u8>, Failure> {
        let mapping = map.iter().map(|item| parse_mapping(item)).collect::<Result<Vec<_>, _>>()?;
        if mapping.is_empty() {
            return std::fs::read(file).map_err(|error| {
                let missing = error.kind() == std::io::ErrorKind::NotFound;
                Error::in_file(file, if missing { Problem::Missing } else { Problem::Io(error) }).into()
            });
        }
        let table = rename(file, self.delimiter, &mapping)?;
        if !table.left_out.is_empty() {
            output::words(&format!(
                "{}: columns not asked for: {}",
                file.display(),
                table.left_out.join(", ")
            ));
        }
        Ok(table.csv)
    }

    fn recording(
        &self,
        robot: Vec<trueline_dataset::RobotSample>,
        features: Vec<trueline_dataset::Feature>,
    ) -> Recording {
        Recording {
            sensor: self.sensor.sensor.clone(),
            setup: self.sensor.setup.clone(),
            robot,
            features,
            initial: None,
            truth: None,
            inputs: BTreeMap::new(),
        }
    }
}

fn parse_mapping(item: &str) -> Result<ColumnMapping, Failure> {
    match item.split_once('=') {
        Some((ours, theirs)) if !ours.is_empty() && !theirs.is_empty() => {
            Ok(ColumnMapping { ours: ours.trim().to_owned(), theirs: theirs.trim().to_owned() })
        }
        _ => Err(Failure::new(
            format!("`{item}` is no column mapping"),
            "write ours=theirs, for example x_mm=pos_x",
        )),
    }
}
