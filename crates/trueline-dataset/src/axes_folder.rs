//! External axes of a dataset folder: `axes.csv` with their values over time, and `[[axis]]` of `cell.toml` with what each of them carries.

use crate::axes::AxisRecord;
use crate::error::{Error, Problem};
use crate::hash::sha256;
use crate::source_file;
use crate::{axes_csv, axes_toml, stamp};
use std::collections::BTreeMap;
use std::path::Path;

/// What the axes of a cell are, in a dataset folder.
pub(crate) const CELL_FILE: &str = "cell.toml";
/// Their values over time.
pub(crate) const VALUES_FILE: &str = "axes.csv";

/// The axes of a dataset folder; none where `cell.toml` names none.
///
/// # Errors
/// The first file, line and column that cannot be used; axes without values, and values without an axis.
pub(crate) fn of_folder(
    folder: &Path,
    inputs: &mut BTreeMap<String, String>,
) -> Result<Vec<AxisRecord>, Error> {
    let (cell_file, values_file) = (folder.join(CELL_FILE), folder.join(VALUES_FILE));
    let mut load = |name: &str| -> Result<Option<Vec<u8>>, Error> {
        let Some(bytes) = source_file::bytes_if_there(&folder.join(name))? else { return Ok(None) };
        inputs.insert(name.to_owned(), sha256(&bytes));
        Ok(Some(bytes))
    };
    let values = load(VALUES_FILE)?;
    let described = match load(CELL_FILE)? {
        Some(bytes) => {
            let text = String::from_utf8(bytes).map_err(|_| Error::in_file(&cell_file, Problem::NotUtf8))?;
            axes_toml::parse(&cell_file, &text)?
        }
        None => Vec::new(),
    };
    if described.is_empty() {
        return match values {
            Some(_) => Err(Error::in_file(&cell_file, Problem::AxesNotDescribed)),
            None => Ok(Vec::new()),
        };
    }
    if let Some(bytes) = values {
        return axes_csv::read(&values_file, &bytes, described);
    }
    // A file for each axis.
    described
        .into_iter()
        .map(|axis| {
            let name = format!("axis-{}.csv", axis.name);
            let file = folder.join(&name);
            let Some(bytes) = load(&name)? else {
                return Err(Error::in_file(&values_file, Problem::Missing));
            };
            let mut read = axes_csv::read(&file, &bytes, vec![axis])?;
            Ok(read.remove(0))
        })
        .collect()
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
            let problem = Problem::AxisWithoutValue {
                name: name(),
                at_s: stamp::seconds(at_ns),
                from_s: stamp::seconds(first.stamp_ns),
                to_s: stamp::seconds(last.stamp_ns),
            };
            return Err(Error::in_file(&folder.join(VALUES_FILE), problem));
        }
    }
    Ok(())
}
