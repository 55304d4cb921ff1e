//! The dataset folder: `sensor.toml`, `robot.csv`, `features.csv` and what may stand beside them.

use crate::error::{Error, Problem};
use crate::recording::{Feature, Recording, Sensor};
use crate::sensor_setup::{Mounted, RegionOfInterest, SensorSetup};
use crate::sensor_toml::SensorFile;
use crate::{features_csv, known_toml, robot_csv, sensor_toml};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fs;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

/// Reads a dataset folder.
///
/// # Errors
/// The first file, line and column that cannot be used.
pub fn read(folder: &Path) -> Result<Recording, Error> {
    read_folder(folder, None)
}

/// Reads a dataset folder without its `features.csv`: the features were found in its pictures.
///
/// # Errors
/// As [`read`].
pub fn read_with_features(folder: &Path, features: Vec<Feature>) -> Result<Recording, Error> {
    read_folder(folder, Some(features))
}

fn read_folder(folder: &Path, found: Option<Vec<Feature>>) -> Result<Recording, Error> {
    let mut inputs = BTreeMap::new();
    let mut load = |name: &str| load(&folder.join(name), name, &mut inputs);
    let sensor_text = required(folder, "sensor.toml", &mut load)?;
    let robot_text = required(folder, "robot.csv", &mut load)?;
    let features_text = match found {
        Some(_) => Vec::new(),
        None => required(folder, "features.csv", &mut load)?,
    };
    let initial_text = load("initial.toml")?;
    let truth_text = load("truth.toml")?;

    let path = |name: &str| folder.join(name);
    let sensor_path = path("sensor.toml");
    let SensorFile { sensor, setup } =
        sensor_toml::parse_file(&sensor_path, &utf8(&sensor_path, sensor_text)?)?;
    refuse_what_is_not_applied(&sensor_path, &setup)?;
    let robot = robot_csv::read(&path("robot.csv"), robot_text.as_slice())?;
    let features = match found {
        Some(found) => found,
        None => features_csv::read(&path("features.csv"), features_text.as_slice(), &sensor)?,
    };
    let initial_path = path("initial.toml");
    let initial = initial_text
        .map(|text| known_toml::parse_guess(&initial_path, &utf8(&initial_path, text)?))
        .transpose()?;
    let truth_path = path("truth.toml");
    let truth =
        truth_text.map(|text| known_toml::parse_truth(&truth_path, &utf8(&truth_path, text)?)).transpose()?;
    Ok(Recording { sensor, setup, robot, features, initial, truth, inputs })
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

/// Nothing that a file states is ignored: what no command applies yet is refused.
///
/// # Errors
/// The first such statement.
pub fn refuse_what_is_not_applied(file: &Path, setup: &SensorSetup) -> Result<(), Error> {
    let refused = [
        (
            setup.mounted == Mounted::Fixed,
            "mounted",
            "\"tool\": a sensor beside the robot is not supported yet",
        ),
        (setup.shape.is_some(), "shape", "no [shape]: it is not applied yet"),
        (
            matches!(setup.region_of_interest, Some(RegionOfInterest::Sheet { .. })),
            "region_of_interest",
            "no such table: for profiles it is not applied yet",
        ),
    ];
    match refused.into_iter().find(|(stated, ..)| *stated) {
        Some((_, key, expected)) => {
            Err(Error::in_file(file, Problem::Value { key, expected, found: "it".to_owned() }))
        }
        None => Ok(()),
    }
}

/// Replaces the features of a dataset folder; without features there is no file. What was there is kept: it is renamed
/// to the first free one of `features.previous-1.csv`, `features.previous-2.csv`, …, which is returned. The new
/// file appears as a whole or not at all.
///
/// # Errors
/// What the operating system says.
pub fn replace_features(folder: &Path, features: &[Feature]) -> Result<Option<PathBuf>, Error> {
    let file = folder.join("features.csv");
    let unfinished = folder.join("features.unfinished.csv");
    if !features.is_empty() {
        write_with(&unfinished, |out| features_csv::write(out, features))?;
    }
    let mut kept = None;
    if file.exists() {
        let mut names = (1..).map(|k| folder.join(format!("features.previous-{k}.csv")));
        let free = names.find(|name| !name.exists()).unwrap_or_else(|| unreachable!("numbers do not end"));
        fs::rename(&file, &free).map_err(|e| Error::in_file(&file, Problem::Io(e)))?;
        kept = Some(free);
    }
    if !features.is_empty() {
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
    for name in ["sensor.toml", "robot.csv", "features.csv", "initial.toml", "truth.toml"] {
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
    if let Some(guess) = &recording.initial {
        write_text(&folder.join("initial.toml"), &known_toml::format(guess, &[]))?;
    }
    if let Some(truth) = &recording.truth {
        write_text(&folder.join("truth.toml"), &known_toml::format(&truth.parameters, &truth.lines))?;
    }
    Ok(())
}

fn sensor_text(recording: &Recording) -> String {
    let (sensor, setup) = (recording.sensor.clone(), recording.setup.clone());
    sensor_toml::format_file(&SensorFile { sensor, setup })
}

type Loader<'a> = dyn FnMut(&str) -> Result<Option<Vec<u8>>, Error> + 'a;

fn required(folder: &Path, name: &str, load: &mut Loader<'_>) -> Result<Vec<u8>, Error> {
    load(name)?.ok_or_else(|| Error::in_file(&folder.join(name), Problem::Missing))
}

/// Reads a file as it is and notes its hash; `None` if it does not exist.
fn load(file: &Path, name: &str, inputs: &mut BTreeMap<String, String>) -> Result<Option<Vec<u8>>, Error> {
    let bytes = match fs::read(file) {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(Error::in_file(file, Problem::Io(error))),
    };
    inputs.insert(name.to_owned(), sha256(&bytes));
    Ok(Some(bytes))
}

/// SHA-256 in hexadecimal.
#[must_use]
pub fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|b| format!("{b:02x}")).collect()
}

/// SHA-256 in hexadecimal of what can be read, however long it is.
///
/// # Errors
/// What the reader says.
pub fn sha256_of(mut reader: impl std::io::Read) -> std::io::Result<String> {
    let mut digest = Sha256::new();
    let mut block = vec![0; 1 << 16];
    loop {
        match reader.read(&mut block)? {
            0 => return Ok(digest.finalize().iter().map(|b| format!("{b:02x}")).collect()),
            count => digest.update(&block[..count]),
        }
    }
}

pub(crate) fn utf8(file: &Path, bytes: Vec<u8>) -> Result<String, Error> {
    String::from_utf8(bytes)
        .map_err(|_| Error::in_file(file, Problem::Csv("it is not UTF-8 text".to_owned())))
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
        std::io::Write::flush(&mut out)
    };
    write().map_err(|e| Error::in_file(file, Problem::Io(e)))
}
