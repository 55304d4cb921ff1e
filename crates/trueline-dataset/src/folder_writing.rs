//! Writes dataset folders: whole ones, and single tables in place of others.

use crate::axes_csv;
use crate::axes_folder;
use crate::axes_toml;
use crate::error::{Error, Problem};
use crate::features_csv;
use crate::known_toml;
use crate::profile::Profile;
use crate::profile_file::{self, ProfileForm};
use crate::recording::{Feature, PlateStripe, Recording};
use crate::robot_csv;
use crate::sensor_toml::{self, SensorFile};
use crate::several_sensors;
use crate::stop_poses::StopPoses;
use crate::stripes_csv;
use crate::whole_file;
use crate::whole_folder::WholeFolder;
use std::fs;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// Replaces the features of a dataset folder; without features there is no file. The old file is kept: it is renamed
/// to the first free one of `features.previous-1.csv`, `features.previous-2.csv`, …, which is returned. The new file
/// appears as a whole or not at all.
///
/// # Errors
/// Error of the operating system.
pub fn replace_features(folder: &Path, features: &[Feature]) -> Result<Option<PathBuf>, Error> {
    let write = |out: &mut dyn Write| features_csv::write(out, features);
    replace(folder, "features", (!features.is_empty()).then_some(&write))
}

/// Writes the stripes on plates that were found in the pictures of a dataset to its `stripes.csv`. An old file is kept as
/// `stripes.previous-N.csv`, as it belongs to the old features. Its new path is returned. Without stripes none is
/// written.
///
/// # Errors
/// Error of the operating system.
pub fn replace_stripes(folder: &Path, stripes: &[PlateStripe]) -> Result<Option<PathBuf>, Error> {
    let write = |out: &mut dyn Write| stripes_csv::write(out, stripes);
    replace(folder, "stripes", (!stripes.is_empty()).then_some(&write))
}

/// Writer of a table.
type WriteTable<'a> = &'a dyn Fn(&mut dyn Write) -> std::io::Result<()>;

/// Replaces the table of a name, or removes it if there is none to write. The old one is kept under a new name, which is
/// returned.
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
    // An identical file needs no copy.
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

/// Files that are written.
const WRITTEN: [&str; 8] = [
    "sensor.toml",
    "robot.csv",
    "features.csv",
    "stripes.csv",
    "initial.toml",
    "truth.toml",
    axes_folder::VALUES_FILE,
    axes_folder::CELL_FILE,
];

/// Writes a dataset folder; it may exist, but none of the files may. A recording without features, with pictures
/// still to be searched, has no `features.csv`.
///
/// # Errors
/// Files that are there already, or that cannot be written.
pub fn write(folder: &Path, recording: &Recording) -> Result<(), Error> {
    for name in WRITTEN {
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
    if !recording.axes.is_empty() {
        write_with(&folder.join(axes_folder::VALUES_FILE), |out| axes_csv::write(out, &recording.axes))?;
        write_text(&folder.join(axes_folder::CELL_FILE), &axes_toml::text(&recording.axes))?;
    }
    if let Some(guess) = &recording.initial {
        write_text(&folder.join("initial.toml"), &known_toml::format(guess, &[]))?;
    }
    if let Some(truth) = &recording.truth {
        write_text(
            &folder.join("truth.toml"),
            &known_toml::format_with_axes(&truth.parameters, &truth.lines, &recording.axes),
        )?;
    }
    Ok(())
}

/// The same into a folder that appears as a whole; it must be new or empty, unless it may be replaced. Returns where the former folder
/// is kept, as [`WholeFolder::finish`] does.
///
/// # Errors
/// As [`WholeFolder::begin`], and data that cannot be written.
pub fn write_whole(folder: &Path, recording: &Recording, replace: bool) -> Result<Option<PathBuf>, Error> {
    let whole = WholeFolder::begin(folder, replace)?;
    write(whole.path(), recording)?;
    whole.finish()
}

/// Writes a dataset of several sensors on one robot, by name; it appears as a whole. Their poses are those of the first.
///
/// # Errors
/// As [`write_whole`].
pub fn write_sensors(
    folder: &Path,
    sensors: &[(String, Recording)],
    replace: bool,
) -> Result<Option<PathBuf>, Error> {
    let whole = WholeFolder::begin(folder, replace)?;
    for (k, (name, recording)) in sensors.iter().enumerate() {
        let own = whole.path().join(several_sensors::FOLDER).join(name);
        write(&own, recording)?;
        let (robot, common) = (own.join("robot.csv"), whole.path().join("robot.csv"));
        let placed = if k == 0 { fs::rename(&robot, &common) } else { fs::remove_file(&robot) };
        placed.map_err(|e| Error::in_file(&robot, Problem::Io(e)))?;
    }
    whole.finish()
}

fn sensor_text(recording: &Recording) -> String {
    let (sensor, setup) = (recording.sensor.clone(), recording.setup.clone());
    sensor_toml::format_file(&SensorFile { sensor, setup })
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
