//! External axes of a cell: `axes.csv` with their values over time, and `[[axis]]` of `cell.toml` with what each of them carries.

use crate::error::{Error, Problem};
use crate::hash::sha256;
use crate::source_file;
use crate::unit::MM_PER_M;
use crate::{axes_csv, axes_toml, stamp};
use nalgebra::{UnitVector3, Vector3};
use std::collections::BTreeMap;
use std::path::Path;
use trueline_geometry::{Axis, AxisKind};

/// What the axes of a cell are, in a dataset folder.
pub const CELL_FILE: &str = "cell.toml";
/// Their values over time.
pub const VALUES_FILE: &str = "axes.csv";

/// What an axis moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Carries {
    /// The part with its seams: a table, a positioner.
    Part,
    /// The whole robot: a track, a gantry.
    Robot,
    /// The sensor, on the tool.
    Sensor,
}

/// What is known of an axis beforehand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisGuess {
    /// Its direction, in base; of an axis that carries the sensor, in the tool.
    pub direction: UnitVector3<f64>,
    /// A point of it, m; `None` where only the direction is known.
    pub point_m: Option<Vector3<f64>>,
    /// Standard deviations of direction (rad) and point (m), where stated.
    pub sigma: [Option<f64>; 2],
}

/// One value of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisValue {
    /// Its stamp, ns.
    pub stamp_ns: i64,
    /// Angle (rad) or way (m).
    pub value: f64,
}

/// An axis and what was recorded of it.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisRecord {
    /// Its name.
    pub name: String,
    /// Rotary or linear.
    pub kind: AxisKind,
    /// What it moves.
    pub carries: Carries,
    /// Whether the poses that the controller reports contain its motion already.
    pub in_pose: bool,
    /// What is known of it beforehand.
    pub guess: Option<AxisGuess>,
    /// Its values, by rising stamp.
    pub values: Vec<AxisValue>,
    /// Where it is, once that is known: what a calibration found, or the truth of a simulation.
    pub known: Option<Axis>,
}

impl AxisRecord {
    /// Whether it moves if its values are so far apart, rad or m.
    #[must_use]
    pub fn moves_by(&self, range: f64) -> bool {
        range > if self.kind == AxisKind::Rotary { STILL_RAD } else { STILL_M }
    }
}

/// An axis whose values are not further apart than this stands, rad.
const STILL_RAD: f64 = 2e-3;
/// … and m.
const STILL_M: f64 = 1e-3;

/// How far each axis moves between the first and the last stamp of what was read, rad or m; of a recording without readings, in all.
#[must_use]
pub fn ranges(axes: &[AxisRecord], read_ns: Option<[i64; 2]>) -> Vec<f64> {
    let [first_ns, last_ns] = read_ns.unwrap_or([i64::MIN, i64::MAX]);
    let range = |record: &AxisRecord| {
        let is_read = |value: &&AxisValue| (first_ns..=last_ns).contains(&value.stamp_ns);
        let values = || record.values.iter().filter(is_read).map(|value| value.value);
        values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
    };
    axes.iter().map(range).collect()
}

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

/// Writes the axes of a recording: their values, and what each of them is. Where its place is known it is not written: that is for the truth.
pub(crate) fn cell_text(axes: &[AxisRecord]) -> String {
    axes_toml::text(axes)
}

/// A point in mm.
pub(crate) fn in_mm(point_m: &Vector3<f64>) -> [f64; 3] {
    (point_m * MM_PER_M).into()
}
