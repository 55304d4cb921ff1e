//! A dataset folder of pose sightings: `sensor.toml` with `kind = "poses"`, `sightings.csv`, and `robot.csv` or `poses.csv`.

use crate::dialect::plain_csv;
use crate::encoder_log::EncoderFile;
use crate::error::{Error, Problem};
use crate::folder::{self, RobotPoses};
use crate::recording::{Guess, RobotSample};
use crate::sensor_setup::SensorSetup;
use crate::sightings_csv::{self, Sighting};
use crate::stop_poses::{self, Pairing, StopPoses};
use crate::{known_toml, robot_csv, sensor_toml, source_file};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::Write;
use std::path::Path;
use trueline_geometry::Pose;

const SENSOR_FILE: &str = "sensor.toml";
const ROBOT_FILE: &str = "robot.csv";

/// Content of a folder of pose sightings.
#[derive(Clone, Debug)]
pub struct PoseDataset {
    /// Carrier of the camera, and the robot's accuracy.
    pub setup: SensorSetup,
    /// The robot's poses.
    pub robot: RobotPoses,
    /// Sightings by rising stamp.
    pub sightings: Vec<Sighting>,
    /// SHA-256 of every file that was read, by name.
    pub inputs: BTreeMap<String, String>,
    /// Remarks on tables that are not plain CSV.
    pub notes: Vec<String>,
}

/// Whether a folder's `sensor.toml` describes pose sightings. A missing or broken file decides nothing: the reader of the
/// folder reports it.
#[must_use]
pub fn is_one(folder: &Path) -> bool {
    let text = source_file::text(&folder.join(SENSOR_FILE));
    text.is_ok_and(|text| sensor_toml::is_of_poses(&text))
}

/// Reads such a folder, but for a guess that may lie in it.
///
/// # Errors
/// The first file, line and column that cannot be used.
pub fn read(folder: &Path) -> Result<PoseDataset, Error> {
    let (mut inputs, mut notes) = (BTreeMap::new(), Vec::new());
    let sensor_file = folder.join(SENSOR_FILE);
    let sensor_text = source_file::text(&sensor_file)?;
    inputs.insert(SENSOR_FILE.to_owned(), folder::sha256(sensor_text.as_bytes()));
    let setup = sensor_toml::parse_poses(&sensor_file, &sensor_text)?;
    let stops = StopPoses::of(folder)?;
    let robot = folder::read_robot(folder)?;
    inputs.insert(robot.file_name.to_owned(), robot.sha256.clone());
    let file = folder.join(sightings_csv::FILE);
    let bytes = source_file::bytes_if_there(&file)?.ok_or_else(|| Error::in_file(&file, Problem::Missing))?;
    source_file::expect_lines(&file, &bytes)?;
    inputs.insert(sightings_csv::FILE.to_owned(), folder::sha256(&bytes));
    let (plain, dialect) = plain_csv(&file, bytes, None)?;
    if !dialect.is_plain() {
        notes.push(format!("{}: {dialect}", file.display()));
    }
    let encoder = EncoderFile::of(folder);
    let pairing = Pairing { stops: stops.as_ref(), encoder: encoder.as_ref() };
    let sightings = sightings_csv::read_at(&file, &plain, pairing)?;
    notes.extend(encoder.and_then(|file| file.noted(&mut inputs)));
    if let Some(stops) = &stops {
        let stamps_ns: BTreeSet<i64> = sightings.iter().map(|sighting| sighting.stamp_ns).collect();
        stops.check_each_is_read(&stamps_ns)?;
        if folder.join(ROBOT_FILE).exists() {
            notes.push(format!("{ROBOT_FILE} is ignored: {} has a pose for each stop", stop_poses::FILE));
        }
    }
    Ok(PoseDataset { setup, robot, sightings, inputs, notes })
}

/// Truth of a simulation of sightings.
#[derive(Clone, Debug)]
pub struct PoseTruth {
    /// Time offset, and `tool_from_camera`, or `base_from_camera` of a camera beside the robot.
    pub parameters: Guess,
    /// `base_from_target`, or `tool_from_target` before a camera beside the robot.
    pub base_from_target: Pose,
}

/// Writes such a folder into one that exists. With stops there is one robot pose for each sighting, and no stamps are written.
///
/// # Errors
/// Files that cannot be written.
pub fn write(
    folder: &Path,
    setup: &SensorSetup,
    (robot, at_stops): (&[RobotSample], bool),
    sightings: &[Sighting],
    truth: &PoseTruth,
) -> Result<(), Error> {
    let put = |name: &str, bytes: &[u8]| {
        let file = folder.join(name);
        fs::write(&file, bytes).map_err(|error| Error::in_file(&file, Problem::Io(error)))
    };
    put(SENSOR_FILE, sensor_toml::format_poses(setup).as_bytes())?;
    put("truth.toml", known_toml::format_poses(&truth.parameters, &truth.base_from_target).as_bytes())?;
    let table = |write: &dyn Fn(&mut Vec<u8>) -> std::io::Result<()>| {
        let mut bytes = Vec::new();
        write(&mut bytes).map_err(|error| Error::in_file(folder, Problem::Io(error)))?;
        Ok::<Vec<u8>, Error>(bytes)
    };
    if at_stops {
        put(stop_poses::FILE, &table(&|out| write_stops(out, robot))?)?;
        return put(sightings_csv::FILE, &table(&|out| sightings_csv::write_at_stops(out, sightings))?);
    }
    put(ROBOT_FILE, &table(&|out| robot_csv::write(out, robot))?)?;
    put(sightings_csv::FILE, &table(&|out| sightings_csv::write(out, sightings))?)
}

/// The poses of stops, numbered from 1, without their stamps.
pub(crate) fn write_stops(mut out: impl Write, robot: &[RobotSample]) -> std::io::Result<()> {
    let mut stamped = Vec::new();
    robot_csv::write(&mut stamped, robot)?;
    for (row, line) in String::from_utf8_lossy(&stamped).lines().enumerate() {
        let rest = line.split_once(',').map_or("", |(_, rest)| rest);
        let name = if row == 0 { "stop".to_owned() } else { row.to_string() };
        writeln!(out, "{name},{rest}")?;
    }
    Ok(())
}
