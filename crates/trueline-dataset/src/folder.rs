//! The dataset folder: `sensor.toml`, `robot.csv`, `features.csv` and their optional companions.

use crate::axes::AxisRecord;
use crate::dialect::plain_csv;
use crate::encoder_log::EncoderFile;
use crate::error::{Error, Problem};
pub use crate::folder_writing::{
    replace_features, replace_stripes, write, write_profiles, write_sensors, write_whole,
};
use crate::found_seams::FoundSeams;
pub use crate::hash::{sha256, sha256_of};
use crate::profile::Profile;
use crate::profile_file::ProfileFile;
use crate::recording::{Feature, PlateStripe, Recording, RobotSample, Sensor};
use crate::sensor_setup::{RegionOfInterest, SensorSetup};
use crate::sensor_toml::SensorFile;
use crate::several_sensors::{self, robot_folder};
use crate::source_file;
use crate::stop_poses::{self, Pairing, StopPoses};
use crate::stripes_csv;
use crate::{axes_folder, features_csv, known_toml, robot_csv, sensor_toml};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Reads a dataset folder.
///
/// # Errors
/// The first file, line and column that cannot be used.
pub fn read(folder: &Path) -> Result<Recording, Error> {
    let content = read_content(folder)?;
    if content.recording.features.is_empty() && content.recording.stripes.is_empty() {
        return Err(Error::in_file(&folder.join("features.csv"), Problem::OnlyProfiles));
    }
    Ok(content.recording)
}

/// A dataset folder as it was read.
#[derive(Clone, Debug)]
pub struct FolderContent {
    /// The recording; without features if there are profiles alone.
    pub recording: Recording,
    /// Whole profiles, if there are no features.
    pub profiles: Vec<Profile>,
    /// Remarks on tables that are not plain CSV.
    pub notes: Vec<String>,
}

/// Reads a dataset folder that may have `profiles.csv` or `profiles.parquet` in place of `features.csv`.
///
/// # Errors
/// As [`read`].
pub fn read_content(folder: &Path) -> Result<FolderContent, Error> {
    read_folder(folder, None, true)
}

/// The same without whole profiles, which stay in their file: [`crate::folder_profiles::FolderProfiles`] reads them one by one.
///
/// # Errors
/// As [`read`].
pub fn read_without_profiles(folder: &Path) -> Result<FolderContent, Error> {
    read_folder(folder, None, false)
}

/// Reads a dataset folder without its `features.csv`: the features were found in its pictures.
///
/// # Errors
/// As [`read`].
pub fn read_with_features(folder: &Path, found: FoundSeams) -> Result<FolderContent, Error> {
    read_folder(folder, Some(found), true)
}

/// The axes of a dataset, with a position at each feature.
fn axes_of(
    folder: &Path,
    stops: Option<&StopPoses>,
    features: &[Feature],
    inputs: &mut BTreeMap<String, String>,
) -> Result<Vec<AxisRecord>, Error> {
    let axes = axes_folder::of_dataset([folder, robot_folder(folder)], stops, inputs)?;
    axes_folder::check_readings(folder, &axes, features.iter().map(|feature| feature.stamp_ns))?;
    Ok(axes)
}

fn read_folder(
    folder: &Path,
    found: Option<FoundSeams>,
    reads_profiles: bool,
) -> Result<FolderContent, Error> {
    let mut notes = Vec::new();
    let mut inputs = BTreeMap::new();
    let stops = StopPoses::of(folder)?;
    let robot_file = robot_folder(folder).join(ROBOT);
    let sensor_text = sensor_text(folder, &mut inputs)?;
    let robot_text = if stops.is_some() { None } else { Some(required(&robot_file, ROBOT, &mut inputs)?) };
    let encoder = EncoderFile::of(robot_folder(folder));
    let pairing = Pairing { stops: stops.as_ref(), encoder: encoder.as_ref() };
    let mut load = |name: &str| load(&folder.join(name), name, &mut inputs);
    let features_text = if found.is_none() { load("features.csv")? } else { None };
    let look_at_profiles = found.is_none() && features_text.is_none() && !folder.join("stripes.csv").exists();
    let profile_file = if look_at_profiles { ProfileFile::of(folder)? } else { None };
    let stripes_text = if found.is_none() && profile_file.is_none() { load("stripes.csv")? } else { None };
    let [initial_text, truth_text] = [load("initial.toml")?, load("truth.toml")?];

    let sensor_path = folder.join("sensor.toml");
    let SensorFile { sensor, setup } =
        sensor_toml::parse_file(&sensor_path, &utf8(&sensor_path, sensor_text)?)?;
    refuse_what_is_not_applied(&sensor_path, &setup)?;
    let robot = match (robot_text, &stops) {
        (Some(robot_text), _) => robot_over_time(&robot_file, robot_text, &mut notes)?,
        (None, stops) => stops.as_ref().map(StopPoses::robot).unwrap_or_default(),
    };
    let mut profiles = Vec::new();
    let is_found = found.is_some();
    let FoundSeams { features, stripes } = match (found, profile_file) {
        (Some(found), _) => found,
        (None, Some(file)) => {
            check_is_profiler(&sensor_path, &sensor)?;
            inputs.insert(file.form.file_name().to_owned(), file.sha256()?);
            if reads_profiles {
                profiles = file.read(&mut notes, pairing)?;
            }
            FoundSeams::default()
        }
        (None, None) => Tables { folder, features_text, stripes_text }.read(&sensor, pairing, &mut notes)?,
    };
    let initial = parsed(&folder.join("initial.toml"), initial_text, known_toml::parse_guess)?;
    let truth = parsed(&folder.join("truth.toml"), truth_text, known_toml::parse_truth)?;
    if let Some(stops) = &stops {
        inputs.insert(stop_poses::FILE.to_owned(), stops.sha256.clone());
        if !is_found && (reads_profiles || !features.is_empty() || !stripes.is_empty()) {
            stops.check_each_is_read(&stamps_of(&features, &stripes, &profiles))?;
        }
        notes.extend(unused_beside_stops(folder));
    }
    // Profiles that stay in their file are not read yet: who reads them notes their encoder.
    let encoder = encoder.filter(|_| reads_profiles || !features.is_empty() || !stripes.is_empty());
    notes.extend(encoder.and_then(|file| file.noted(&mut inputs)));
    let axes = axes_of(folder, stops.as_ref(), &features, &mut inputs)?;
    let recording = Recording {
        stripes,
        initial,
        truth,
        inputs,
        axes,
        at_stops: stops.is_some(),
        ..Recording::new(sensor, setup, robot, features)
    };
    Ok(FolderContent { recording, profiles, notes })
}

/// The robot's poses over time. The text is the longest of all: it is let go once its poses are read.
fn robot_over_time(file: &Path, bytes: Vec<u8>, notes: &mut Vec<String>) -> Result<Vec<RobotSample>, Error> {
    let text = plain(file, bytes, notes)?;
    robot_csv::read(file, text.as_slice())
}

/// The tables of seam points and of stripes, not yet read.
struct Tables<'a> {
    folder: &'a Path,
    features_text: Option<Vec<u8>>,
    stripes_text: Option<Vec<u8>>,
}

impl Tables<'_> {
    /// Their content. Rows may name a stop, or the count of an encoder.
    fn read(
        self,
        sensor: &Sensor,
        pairing: Pairing<'_>,
        notes: &mut Vec<String>,
    ) -> Result<FoundSeams, Error> {
        let path = |name: &str| self.folder.join(name);
        let (features_file, stripes_file) = (path("features.csv"), path("stripes.csv"));
        let used = if self.features_text.is_some() { "features.csv" } else { "stripes.csv" };
        notes.extend(unused_profiles(self.folder, used, self.stripes_text.is_some()));
        if self.features_text.is_none() && self.stripes_text.is_none() {
            return Err(Error::in_file(&features_file, Problem::Missing));
        }
        let mut found = FoundSeams::default();
        if let Some(text) = self.features_text {
            let text = plain(&features_file, text, notes)?;
            found.features = features_csv::read_at(&features_file, &text, sensor, pairing)?;
        }
        if let Some(text) = self.stripes_text {
            let text = plain(&stripes_file, text, notes)?;
            let lines = found.features.iter().map(|feature| feature.line + 1).max().unwrap_or(1);
            found.stripes = stripes_csv::read_of_lines(&stripes_file, &text, sensor, lines, pairing)?;
        }
        Ok(found)
    }
}

/// Remarks on files that are ignored because poses.csv exists.
fn unused_beside_stops(folder: &Path) -> impl Iterator<Item = String> {
    let unused = ["robot.csv", "images/index.csv"].map(|name| folder.join(name)).into_iter();
    unused
        .filter(|file| file.exists())
        .map(|file| format!("{} is ignored: {} has a pose for each stop", file.display(), stop_poses::FILE))
}

/// Stamps of all that was read.
fn stamps_of(features: &[Feature], stripes: &[PlateStripe], profiles: &[Profile]) -> BTreeSet<i64> {
    let stripes = stripes.iter().map(|stripe| stripe.stamp_ns);
    let profiles = profiles.iter().map(|profile| profile.stamp_ns);
    features.iter().map(|feature| feature.stamp_ns).chain(stripes).chain(profiles).collect()
}

/// Remark on whole profiles that are ignored because a table of their features exists.
fn unused_profiles(folder: &Path, used: &str, has_stripes: bool) -> Option<String> {
    if let Some(file) = ProfileFile::newer_than(folder, used) {
        let file = file.display();
        return Some(format!(
            "{used} is used although {file} is newer: `trueline features` detects the seam in it"
        ));
    }
    let file = ProfileFile::path_in(folder).filter(|_| !has_stripes)?;
    let file = file.display();
    Some(format!(
        "{file} is ignored: {used} is used, without stripes.csv; `trueline features` detects the seam and \
            both plates in it"
    ))
}

/// A table as plain CSV; how it was written is noted.
fn plain(file: &Path, bytes: Vec<u8>, notes: &mut Vec<String>) -> Result<Vec<u8>, Error> {
    let (csv, dialect) = plain_csv(file, bytes, None)?;
    if !dialect.is_plain() {
        notes.push(format!("{}: {dialect}", file.display()));
    }
    Ok(csv)
}

/// Reads the sensor of a dataset folder alone.
///
/// # Errors
/// A file that is missing or cannot be used.
pub fn read_sensor(folder: &Path) -> Result<Sensor, Error> {
    Ok(read_sensor_file(folder)?.sensor)
}

/// Reads the sensor of a dataset folder with everything in its file.
///
/// # Errors
/// A file that is missing or cannot be used.
pub fn read_sensor_file(folder: &Path) -> Result<SensorFile, Error> {
    let file = folder.join("sensor.toml");
    let text = sensor_text(folder, &mut BTreeMap::new())?;
    let sensor = sensor_toml::parse_file(&file, &utf8(&file, text)?)?;
    refuse_what_is_not_applied(&file, &sensor.setup)?;
    Ok(sensor)
}

/// The bytes of a dataset's `sensor.toml`.
fn sensor_text(folder: &Path, inputs: &mut BTreeMap<String, String>) -> Result<Vec<u8>, Error> {
    let file = folder.join("sensor.toml");
    match load(&file, "sensor.toml", inputs)? {
        Some(bytes) => Ok(bytes),
        None => Err(several_sensors::in_place_of_one(folder)?
            .unwrap_or_else(|| Error::in_file(&file, Problem::Missing))),
    }
}

/// The robot's poses of a dataset folder.
#[derive(Clone, Debug)]
pub struct RobotPoses {
    /// The poses.
    pub samples: Vec<RobotSample>,
    /// Whether there is one for each stop, and stamps only pair them with readings.
    pub at_stops: bool,
    /// Their file.
    pub file_name: &'static str,
    /// SHA-256 of that file.
    pub sha256: String,
}

/// Reads the robot's poses of a dataset folder alone.
///
/// # Errors
/// A file that is missing or cannot be used.
pub fn read_robot(folder: &Path) -> Result<RobotPoses, Error> {
    if let Some(stops) = StopPoses::of(folder)? {
        let (samples, sha256) = (stops.robot(), stops.sha256);
        return Ok(RobotPoses { samples, at_stops: true, file_name: stop_poses::FILE, sha256 });
    }
    let file = robot_folder(folder).join(ROBOT);
    let mut inputs = BTreeMap::new();
    let bytes =
        load(&file, "robot.csv", &mut inputs)?.ok_or_else(|| Error::in_file(&file, Problem::Missing))?;
    let plain = plain(&file, bytes, &mut Vec::new())?;
    let samples = robot_csv::read(&file, plain.as_slice())?;
    let sha256 = inputs.remove("robot.csv").unwrap_or_default();
    Ok(RobotPoses { samples, at_stops: false, file_name: "robot.csv", sha256 })
}

/// No statement of a file is ignored: statements that no command applies yet are refused.
///
/// # Errors
/// The first such statement.
pub fn refuse_what_is_not_applied(file: &Path, setup: &SensorSetup) -> Result<(), Error> {
    if matches!(setup.region_of_interest, Some(RegionOfInterest::Sheet { .. })) {
        let expected = "no such table: for profiles it is not applied yet";
        let problem = Problem::Value { key: "region_of_interest", expected, found: "it".to_owned() };
        return Err(Error::in_file(file, problem));
    }
    Ok(())
}

/// Profiles need a profiler.
pub(crate) fn check_is_profiler(file: &Path, sensor: &Sensor) -> Result<(), Error> {
    if *sensor == Sensor::Profiler {
        return Ok(());
    }
    let expected = "\"profiler\" for whole profiles";
    Err(Error::in_file(file, Problem::Value { key: "kind", expected, found: sensor.kind().to_owned() }))
}

/// The robot's poses over time.
const ROBOT: &str = "robot.csv";

/// Content of a TOML file, if it exists.
fn parsed<T>(
    file: &Path,
    bytes: Option<Vec<u8>>,
    parse: fn(&Path, &str) -> Result<T, Error>,
) -> Result<Option<T>, Error> {
    bytes.map(|bytes| parse(file, &utf8(file, bytes)?)).transpose()
}

/// Reads a file that must be there.
fn required(file: &Path, name: &str, inputs: &mut BTreeMap<String, String>) -> Result<Vec<u8>, Error> {
    load(file, name, inputs)?.ok_or_else(|| Error::in_file(file, Problem::Missing))
}

/// Reads a file unchanged and notes its hash; `None` if it does not exist.
fn load(file: &Path, name: &str, inputs: &mut BTreeMap<String, String>) -> Result<Option<Vec<u8>>, Error> {
    let Some(bytes) = source_file::bytes_if_there(file)? else { return Ok(None) };
    if name.ends_with(".csv") {
        source_file::expect_lines(file, &bytes)?;
    }
    inputs.insert(name.to_owned(), sha256(&bytes));
    Ok(Some(bytes))
}

pub(crate) fn utf8(file: &Path, bytes: Vec<u8>) -> Result<String, Error> {
    String::from_utf8(bytes).map_err(|_| Error::in_file(file, Problem::NotUtf8))
}
