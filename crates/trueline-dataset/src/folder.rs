//! The dataset folder: `sensor.toml`, `robot.csv`, `features.csv` and what may stand beside them.

use crate::dialect::plain_csv;
use crate::error::{Error, Problem};
use crate::found_seams::FoundSeams;
pub use crate::hash::{sha256, sha256_of};
use crate::profile::Profile;
use crate::profile_file::{self, ProfileFile, ProfileForm};
use crate::recording::{Feature, PlateStripe, Recording, RobotSample, Sensor};
use crate::sensor_setup::{RegionOfInterest, SensorSetup};
use crate::sensor_toml::SensorFile;
use crate::source_file;
use crate::stop_poses::{self, StopPoses};
use crate::stripes_csv;
use crate::whole_file;
use crate::whole_folder::WholeFolder;
use crate::{features_csv, known_toml, robot_csv, sensor_toml};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

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
    /// The recording; without features where there are profiles alone.
    pub recording: Recording,
    /// Whole profiles, where there are no features.
    pub profiles: Vec<Profile>,
    /// How tables were written where that is not plain CSV: to be said.
    pub notes: Vec<String>,
}

/// Reads a dataset folder that may have `profiles.csv` or `profiles.parquet` in the place of `features.csv`.
///
/// # Errors
/// As [`read`].
pub fn read_content(folder: &Path) -> Result<FolderContent, Error> {
    read_folder(folder, None)
}

/// Reads a dataset folder without its `features.csv`: the features were found in its pictures.
///
/// # Errors
/// As [`read`].
pub fn read_with_features(folder: &Path, found: FoundSeams) -> Result<Recording, Error> {
    Ok(read_folder(folder, Some(found))?.recording)
}

fn read_folder(folder: &Path, found: Option<FoundSeams>) -> Result<FolderContent, Error> {
    let mut notes = Vec::new();
    let mut inputs = BTreeMap::new();
    let mut load = |name: &str| load(&folder.join(name), name, &mut inputs);
    let sensor_text = required(folder, "sensor.toml", &mut load)?;
    let stops = StopPoses::of(folder)?;
    let robot_text = if stops.is_some() { None } else { Some(required(folder, "robot.csv", &mut load)?) };
    let features_text = if found.is_none() { load("features.csv")? } else { None };
    let look_at_profiles = found.is_none() && features_text.is_none() && !folder.join("stripes.csv").exists();
    let profile_file = if look_at_profiles { ProfileFile::of(folder)? } else { None };
    let stripes_text = if found.is_none() && profile_file.is_none() { load("stripes.csv")? } else { None };
    let initial_text = load("initial.toml")?;
    let truth_text = load("truth.toml")?;

    let path = |name: &str| folder.join(name);
    let sensor_path = path("sensor.toml");
    let SensorFile { sensor, setup } =
        sensor_toml::parse_file(&sensor_path, &utf8(&sensor_path, sensor_text)?)?;
    refuse_what_is_not_applied(&sensor_path, &setup)?;
    let robot = match (robot_text, &stops) {
        (Some(robot_text), _) => robot_over_time(&path("robot.csv"), robot_text, &mut notes)?,
        (None, stops) => stops.as_ref().map(StopPoses::robot).unwrap_or_default(),
    };
    let mut profiles = Vec::new();
    let is_found = found.is_some();
    let FoundSeams { features, stripes } = match (found, profile_file) {
        (Some(found), _) => found,
        (None, Some(file)) => {
            check_is_profiler(&sensor_path, &sensor)?;
            inputs.insert(file.form.file_name().to_owned(), sha256(&file.bytes));
            profiles = file.read(&mut notes, stops.as_ref())?;
            FoundSeams::default()
        }
        (None, None) => {
            let tables = Tables { folder, features_text, stripes_text };
            tables.read(&sensor, stops.as_ref(), &mut notes)?
        }
    };
    let initial_path = path("initial.toml");
    let initial = initial_text
        .map(|text| known_toml::parse_guess(&initial_path, &utf8(&initial_path, text)?))
        .transpose()?;
    let truth_path = path("truth.toml");
    let truth =
        truth_text.map(|text| known_toml::parse_truth(&truth_path, &utf8(&truth_path, text)?)).transpose()?;
    if let Some(stops) = &stops {
        inputs.insert(stop_poses::FILE.to_owned(), stops.sha256.clone());
        if !is_found {
            stops.check_each_is_read(&stamps_of(&features, &stripes, &profiles))?;
        }
        notes.extend(unused_beside_stops(folder));
    }
    let recording = Recording {
        stripes,
        initial,
        truth,
        inputs,
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
    /// What they hold; rows name a stop where the robot stood at stops.
    fn read(
        self,
        sensor: &Sensor,
        stops: Option<&StopPoses>,
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
            found.features = features_csv::read_at(&features_file, &text, sensor, stops)?;
        }
        if let Some(text) = self.stripes_text {
            let text = plain(&stripes_file, text, notes)?;
            let lines = found.features.iter().map(|feature| feature.line + 1).max().unwrap_or(1);
            found.stripes = stripes_csv::read_of_lines(&stripes_file, &text, sensor, lines, stops)?;
        }
        Ok(found)
    }
}

/// What is said of files that are not looked at, since poses.csv is there.
fn unused_beside_stops(folder: &Path) -> impl Iterator<Item = String> {
    let unused = ["robot.csv", "images/index.csv"].map(|name| folder.join(name)).into_iter();
    unused.filter(|file| file.exists()).map(|file| {
        format!("{} is not looked at, for {} has a pose for each stop", file.display(), stop_poses::FILE)
    })
}

/// Stamps of all that was read.
fn stamps_of(features: &[Feature], stripes: &[PlateStripe], profiles: &[Profile]) -> BTreeSet<i64> {
    let stripes = stripes.iter().map(|stripe| stripe.stamp_ns);
    let profiles = profiles.iter().map(|profile| profile.stamp_ns);
    features.iter().map(|feature| feature.stamp_ns).chain(stripes).chain(profiles).collect()
}

/// What is said of whole profiles that are not looked at, since a table of what was found in them is there.
fn unused_profiles(folder: &Path, used: &str, has_stripes: bool) -> Option<String> {
    if let Some(file) = ProfileFile::newer_than(folder, used) {
        let file = file.display();
        return Some(format!(
            "{file} is newer than {used}, which is used: `trueline features` finds the seam in it"
        ));
    }
    let file = ProfileFile::path_in(folder).filter(|_| !has_stripes)?;
    let file = file.display();
    Some(format!(
        "{file} is not looked at, for {used} is used, without stripes.csv: `trueline features` finds the seam and both plates in it"
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

/// Reads the sensor of a dataset folder with all else that its file says.
///
/// # Errors
/// A file that is missing or cannot be used.
pub fn read_sensor_file(folder: &Path) -> Result<SensorFile, Error> {
    let file = folder.join("sensor.toml");
    let text = load(&file, "sensor.toml", &mut BTreeMap::new())?
        .ok_or_else(|| Error::in_file(&file, Problem::Missing))?;
    let sensor = sensor_toml::parse_file(&file, &utf8(&file, text)?)?;
    refuse_what_is_not_applied(&file, &sensor.setup)?;
    Ok(sensor)
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
    let file = folder.join("robot.csv");
    let mut inputs = BTreeMap::new();
    let bytes =
        load(&file, "robot.csv", &mut inputs)?.ok_or_else(|| Error::in_file(&file, Problem::Missing))?;
    let plain = plain(&file, bytes, &mut Vec::new())?;
    let samples = robot_csv::read(&file, plain.as_slice())?;
    let sha256 = inputs.remove("robot.csv").unwrap_or_default();
    Ok(RobotPoses { samples, at_stops: false, file_name: "robot.csv", sha256 })
}

/// Nothing that a file states is ignored: what no command applies yet is refused.
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

/// Replaces the features of a dataset folder; without features there is no file. What was there is kept: it is renamed
/// to the first free one of `features.previous-1.csv`, `features.previous-2.csv`, …, which is returned. The new
/// file appears as a whole or not at all.
///
/// # Errors
/// What the operating system says.
pub fn replace_features(folder: &Path, features: &[Feature]) -> Result<Option<PathBuf>, Error> {
    let write = |out: &mut dyn Write| features_csv::write(out, features);
    replace(folder, "features", (!features.is_empty()).then_some(&write))
}

/// Writes the stripes on plates that were found in the pictures of a dataset to its `stripes.csv`. One that is there is
/// kept as `stripes.previous-N.csv`: it belongs to the features before; its new path is returned. Without stripes none is
/// written.
///
/// # Errors
/// What the operating system says.
pub fn replace_stripes(folder: &Path, stripes: &[PlateStripe]) -> Result<Option<PathBuf>, Error> {
    let write = |out: &mut dyn Write| stripes_csv::write(out, stripes);
    replace(folder, "stripes", (!stripes.is_empty()).then_some(&write))
}

/// What writes a table.
type WriteTable<'a> = &'a dyn Fn(&mut dyn Write) -> std::io::Result<()>;

/// Replaces the table of a name, or removes it if there is none to write; the one before is kept under a new name, which
/// is returned.
fn replace(folder: &Path, name: &str, table: Option<WriteTable<'_>>) -> Result<Option<PathBuf>, Error> {
    let file = folder.join(format!("{name}.csv"));
    let unfinished = folder.join(format!("{name}.unfinished.csv"));
    let stops = StopPoses::of(folder)?;
    if let Some(write) = table {
        write_with(&unfinished, |out| match &stops {
            Some(stops) => {
                let mut stamped = Vec::new();
                write(&mut stamped)?;
                out.write_all(&stops.named(&stamped))
            }
            None => write(out),
        })?;
    }
    let mut kept = None;
    // What is there already, to the byte, needs no copy.
    let is_the_same = |[a, b]: [&Path; 2]| matches!((fs::read(a), fs::read(b)), (Ok(a), Ok(b)) if a == b);
    if file.exists() && !(table.is_some() && is_the_same([&file, &unfinished])) {
        let mut names = (1..).map(|k| folder.join(format!("{name}.previous-{k}.csv")));
        let free = names.find(|name| !name.exists()).unwrap_or_else(|| unreachable!("numbers do not end"));
        fs::rename(&file, &free).map_err(|e| Error::in_file(&file, Problem::Io(e)))?;
        kept = Some(free);
    }
    if table.is_some() {
        fs::rename(&unfinished, &file).map_err(|e| Error::in_file(&file, Problem::Io(e)))?;
    }
    Ok(kept)
}

/// Writes a dataset folder; it may exist, but none of the files may. A recording without features, whose
/// pictures are still to be looked at, has no `features.csv`.
///
/// # Errors
/// Files that are there already, or that cannot be written.
pub fn write(folder: &Path, recording: &Recording) -> Result<(), Error> {
    for name in ["sensor.toml", "robot.csv", "features.csv", "stripes.csv", "initial.toml", "truth.toml"] {
        let file = folder.join(name);
        if file.exists() {
            return Err(Error::in_file(&file, Problem::AlreadyExists));
        }
    }
    fs::create_dir_all(folder).map_err(|e| Error::in_file(folder, Problem::Io(e)))?;
    write_text(&folder.join("sensor.toml"), &sensor_text(recording))?;
    write_with(&folder.join("robot.csv"), |out| robot_csv::write(out, &recording.robot))?;
    if !recording.features.is_empty() {
        write_with(&folder.join("features.csv"), |out| features_csv::write(out, &recording.features))?;
    }
    if !recording.stripes.is_empty() {
        write_with(&folder.join("stripes.csv"), |out| stripes_csv::write(out, &recording.stripes))?;
    }
    if let Some(guess) = &recording.initial {
        write_text(&folder.join("initial.toml"), &known_toml::format(guess, &[]))?;
    }
    if let Some(truth) = &recording.truth {
        write_text(&folder.join("truth.toml"), &known_toml::format(&truth.parameters, &truth.lines))?;
    }
    Ok(())
}

/// The same into a folder that appears as a whole; it must be new or empty, unless it may be replaced. Returns where the former folder
/// is kept, as [`WholeFolder::finish`] does.
///
/// # Errors
/// As [`WholeFolder::begin`], and what cannot be written.
pub fn write_whole(folder: &Path, recording: &Recording, replace: bool) -> Result<Option<PathBuf>, Error> {
    let whole = WholeFolder::begin(folder, replace)?;
    write(whole.path(), recording)?;
    whole.finish()
}

fn sensor_text(recording: &Recording) -> String {
    let (sensor, setup) = (recording.sensor.clone(), recording.setup.clone());
    sensor_toml::format_file(&SensorFile { sensor, setup })
}

/// Reads the profiles of a dataset folder alone, features or not; `None` if it has none.
///
/// # Errors
/// A file that cannot be used, or a sensor that is no profiler.
pub fn read_profiles(folder: &Path) -> Result<Option<Vec<Profile>>, Error> {
    let Some(file) = ProfileFile::of(folder)? else { return Ok(None) };
    check_is_profiler(&folder.join("sensor.toml"), &read_sensor(folder)?)?;
    file.read(&mut Vec::new(), StopPoses::of(folder)?.as_ref()).map(Some)
}

/// Profiles are those of a profiler.
fn check_is_profiler(file: &Path, sensor: &Sensor) -> Result<(), Error> {
    if *sensor == Sensor::Profiler {
        return Ok(());
    }
    let expected = "\"profiler\" for whole profiles";
    Err(Error::in_file(file, Problem::Value { key: "kind", expected, found: sensor.kind().to_owned() }))
}

/// Writes profiles into a dataset folder, whole or not at all; their file may not be there yet.
///
/// # Errors
/// A file that is there already, or that cannot be written.
pub fn write_profiles(folder: &Path, profiles: &[Profile], form: ProfileForm) -> Result<(), Error> {
    let file = folder.join(form.file_name());
    if file.exists() {
        return Err(Error::in_file(&file, Problem::AlreadyExists));
    }
    let bytes = profile_file::bytes_of(&file, profiles, form)?;
    whole_file::write(&file, &bytes).map_err(|e| Error::in_file(&file, Problem::Io(e)))
}

type Loader<'a> = dyn FnMut(&str) -> Result<Option<Vec<u8>>, Error> + 'a;

fn required(folder: &Path, name: &str, load: &mut Loader<'_>) -> Result<Vec<u8>, Error> {
    load(name)?.ok_or_else(|| Error::in_file(&folder.join(name), Problem::Missing))
}

/// Reads a file as it is and notes its hash; `None` if it does not exist.
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

fn write_text(file: &Path, text: &str) -> Result<(), Error> {
    fs::write(file, text).map_err(|e| Error::in_file(file, Problem::Io(e)))
}

fn write_with(
    file: &Path,
    body: impl FnOnce(&mut BufWriter<fs::File>) -> std::io::Result<()>,
) -> Result<(), Error> {
    let write = || {
        let mut out = BufWriter::new(fs::File::create(file)?);
        body(&mut out)?;
        out.flush()
    };
    write().map_err(|e| Error::in_file(file, Problem::Io(e)))
}
