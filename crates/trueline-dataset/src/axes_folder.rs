//! External axes of a dataset folder: `axes.csv` with their values over time, and `[[axis]]` of `cell.toml` with the body
//! that each carries.

use crate::axes::AxisRecord;
use crate::axis_problem::AxisProblem;
use crate::error::{Error, Problem};
use crate::hash::sha256;
use crate::source_file;
use crate::stop_poses::StopPoses;
use crate::{axes_csv, axes_toml, stamp};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// The axes of a cell, in a dataset folder.
pub(crate) const CELL_FILE: &str = "cell.toml";
/// Their values over time.
pub const VALUES_FILE: &str = "axes.csv";

/// The axes of a plan's folder with their planned values; none where `cell.toml` names none.
///
/// # Errors
/// As for a dataset's folder.
pub fn of_plan(folder: &Path) -> Result<Vec<AxisRecord>, Error> {
    of_folder(folder, None, &mut BTreeMap::new())
}

/// The axes of a dataset folder; none where `cell.toml` names none. If the robot stood at stops, they have a value at each.
///
/// # Errors
/// The first file, line and column that cannot be used; axes without values, values without an axis, and values of an axis in two files.
pub(crate) fn of_folder(
    folder: &Path,
    stops: Option<&StopPoses>,
    inputs: &mut BTreeMap<String, String>,
) -> Result<Vec<AxisRecord>, Error> {
    let values_file = folder.join(VALUES_FILE);
    let described = described(folder, inputs)?;
    let mut load = |name: &str| loaded(folder, name, inputs);
    let values = load(VALUES_FILE)?;
    if values.is_some()
        && let Some(second) = files_of_one(folder)?.first()
    {
        return Err(Error::in_file(&folder.join(second), AxisProblem::InTwoFiles.into()));
    }
    if described.is_empty() {
        return if values.is_some() || !files_of_one(folder)?.is_empty() {
            Err(Error::in_file(&folder.join(CELL_FILE), AxisProblem::NotDescribed.into()))
        } else {
            Ok(Vec::new())
        };
    }
    if let Some(bytes) = values {
        return axes_csv::read(&values_file, &bytes, described, stops);
    }
    let is_of_none = |name: &&String| described.iter().all(|axis| file_of_one(axis) != **name);
    if let Some(stranger) = files_of_one(folder)?.iter().find(is_of_none) {
        return Err(Error::in_file(&folder.join(stranger), AxisProblem::OfFileNotDescribed.into()));
    }
    described
        .into_iter()
        .map(|axis| {
            let name = file_of_one(&axis);
            let Some(bytes) = load(&name)? else {
                return Err(Error::in_file(
                    &values_file,
                    AxisProblem::WithoutValues { name: axis.name }.into(),
                ));
            };
            let mut read = axes_csv::read(&folder.join(&name), &bytes, vec![axis], stops)?;
            Ok(read.remove(0))
        })
        .collect()
}

/// The axes of a dataset by its folder and by that of its robot, which are one unless it is one of several sensors.
///
/// # Errors
/// As [`of_folder`], and files of axes in the folder of one of several sensors.
pub(crate) fn of_dataset(
    [own, of_robot]: [&Path; 2],
    stops: Option<&StopPoses>,
    inputs: &mut BTreeMap<String, String>,
) -> Result<Vec<AxisRecord>, Error> {
    if own != of_robot {
        refuse_beside_robot(own)?;
    }
    of_folder(of_robot, stops, inputs)
}

/// The axes that `cell.toml` of a folder describes, without values; none without that file.
///
/// # Errors
/// A file that cannot be used.
pub(crate) fn described(
    folder: &Path,
    inputs: &mut BTreeMap<String, String>,
) -> Result<Vec<AxisRecord>, Error> {
    let file = folder.join(CELL_FILE);
    let Some(bytes) = loaded(folder, CELL_FILE, inputs)? else { return Ok(Vec::new()) };
    let text = String::from_utf8(bytes).map_err(|_| Error::in_file(&file, Problem::NotUtf8))?;
    axes_toml::parse(&file, &text)
}

/// A file's bytes, with its hash noted; `None` if it is not there.
fn loaded(
    folder: &Path,
    name: &str,
    inputs: &mut BTreeMap<String, String>,
) -> Result<Option<Vec<u8>>, Error> {
    let Some(bytes) = source_file::bytes_if_there(&folder.join(name))? else { return Ok(None) };
    inputs.insert(name.to_owned(), sha256(&bytes));
    Ok(Some(bytes))
}

/// How the name of a file of one axis begins.
const OF_ONE: &str = "axis-";

fn file_of_one(axis: &AxisRecord) -> String {
    format!("{OF_ONE}{}.csv", axis.name)
}

/// Names of the files of single axes in a folder, in their order.
fn files_of_one(folder: &Path) -> Result<Vec<String>, Error> {
    let io = |error| Error::in_file(folder, Problem::Io(error));
    // Of a path with a name alone the folder is the current one.
    let listed = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let mut files = Vec::new();
    for entry in fs::read_dir(listed).map_err(io)? {
        let name = entry.map_err(io)?.file_name().to_string_lossy().into_owned();
        if name.starts_with(OF_ONE) && name.ends_with(".csv") {
            files.push(name);
        }
    }
    files.sort();
    Ok(files)
}

/// Refuses files of axes in the folder of one of several sensors: the robot is beside them.
///
/// # Errors
/// The first such file.
fn refuse_beside_robot(folder: &Path) -> Result<(), Error> {
    let fixed = [CELL_FILE, VALUES_FILE].into_iter().filter(|name| folder.join(name).exists());
    let mut files = fixed.map(str::to_owned).chain(files_of_one(folder)?);
    match files.next() {
        Some(file) => Err(Error::in_file(&folder.join(file), AxisProblem::BesideSensor.into())),
        None => Ok(()),
    }
}

/// Offsets of clocks that readings may be beyond the values of an axis, ns.
const LARGEST_OFFSET_NS: i64 = 1_000_000_000;

/// Checks that every axis has values where something was read.
///
/// # Errors
/// The first reading without them, by file.
pub(crate) fn check_readings(
    folder: &Path,
    axes: &[AxisRecord],
    stamps_ns: impl Iterator<Item = i64> + Clone,
) -> Result<(), Error> {
    for axis in axes {
        let [Some(first), Some(last)] = [axis.values.first(), axis.values.last()] else { continue };
        let name = || axis.name.clone();
        let is_there = |stamp_ns: i64| {
            (first.stamp_ns - LARGEST_OFFSET_NS..=last.stamp_ns + LARGEST_OFFSET_NS).contains(&stamp_ns)
        };
        let mut readings = stamps_ns.clone();
        if let Some(at_ns) = readings.find(|stamp_ns| !is_there(*stamp_ns)) {
            let problem = AxisProblem::WithoutValue {
                name: name(),
                at_s: stamp::seconds(at_ns),
                from_s: stamp::seconds(first.stamp_ns),
                to_s: stamp::seconds(last.stamp_ns),
            };
            return Err(Error::in_file(&folder.join(VALUES_FILE), problem.into()));
        }
    }
    Ok(())
}
