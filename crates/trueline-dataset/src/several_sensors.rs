//! Datasets of several sensors on one robot: `robot.csv`, and a folder `sensors/NAME` for each sensor with all its data.

use crate::error::{Error, Problem};
use std::fs;
use std::path::{Path, PathBuf};

/// The folder with a folder for each sensor.
pub const FOLDER: &str = "sensors";

/// A sensor of a dataset.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SensorFolder {
    /// Its name.
    pub name: String,
    /// Its measurements: a dataset with the robot of the whole.
    pub path: PathBuf,
}

/// The sensors of a dataset, by name; `None` for one of a single sensor.
///
/// # Errors
/// A dataset that also has a sensor of its own, or only one in `sensors`; error of the operating system.
pub fn of(dataset: &Path) -> Result<Option<Vec<SensorFolder>>, Error> {
    let folder = dataset.join(FOLDER);
    if !folder.is_dir() {
        return Ok(None);
    }
    let io = |error| Error::in_file(&folder, Problem::Io(error));
    let mut sensors = Vec::new();
    for entry in fs::read_dir(&folder).map_err(io)? {
        let path = entry.map_err(io)?.path();
        if path.is_dir() {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            sensors.push(SensorFolder { name, path });
        }
    }
    sensors.sort_by(|a, b| a.name.cmp(&b.name));
    let own = dataset.join("sensor.toml");
    if own.exists() {
        return Err(Error::in_file(&own, Problem::SensorBesideSensors));
    }
    if sensors.len() < 2 {
        return Err(Error::in_file(&folder, Problem::TooFewSensors { found: sensors.len() }));
    }
    Ok(Some(sensors))
}

/// Error for a dataset with several sensors and none of its own; `None` if it has none.
///
/// # Errors
/// As [`of`].
pub(crate) fn in_place_of_one(dataset: &Path) -> Result<Option<Error>, Error> {
    let Some(sensors) = of(dataset)? else { return Ok(None) };
    let first = sensors.first().map(|sensor| sensor.path.display().to_string()).unwrap_or_default();
    let names = sensors.into_iter().map(|sensor| sensor.name).collect();
    Ok(Some(Error::in_file(dataset, Problem::DatasetOfSensors { names, first })))
}

/// Folder of a dataset's robot: for one of several sensors it is beside them.
#[must_use]
pub(crate) fn robot_folder(dataset: &Path) -> &Path {
    let beside = dataset.parent().filter(|parent| parent.file_name().is_some_and(|name| name == FOLDER));
    let whole = beside.and_then(Path::parent).filter(|_| !dataset.join("robot.csv").exists());
    whole.unwrap_or(dataset)
}
