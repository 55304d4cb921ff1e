//! One row a profile: heights in mm whose positions stand in the header or are evenly spaced, or x and z in turn.

use super::{EvenColumns, RawProfile, numbers};
use crate::error::{Error, Problem};
use crate::profile::ProfilePoint;
use crate::unit::MM_PER_M;
use std::path::Path;

/// Reads rows of heights. A header of rising numbers is the position of each column, mm.
///
/// # Errors
/// Positions that are not known, or rows of different lengths.
pub fn read(
    file: &Path,
    bytes: Vec<u8>,
    columns: Option<EvenColumns>,
    is_point: impl Fn(f64) -> bool,
) -> Result<Vec<RawProfile>, Error> {
    let mut table = numbers::read(file, bytes)?;
    let width = table.rows[0].1.len();
    let in_header =
        table.header.as_ref().and_then(|header| rising(header.iter().map(|name| name.parse().ok())));
    let in_row = || rising(table.rows[0].1.iter().copied());
    let (x_mm, positions_are_a_row) = match (columns, in_header) {
        (Some(even), _) => ((0..width).map(|k| even.first_mm + even.step_mm * k as f64).collect(), false),
        (None, Some(x_mm)) => (x_mm, false),
        (None, None) => (in_row().ok_or_else(|| Error::in_file(file, Problem::NoColumnPositions))?, true),
    };
    if positions_are_a_row {
        table.rows.remove(0);
    }
    let profile = |(line, row): &(u64, Vec<Option<f64>>)| {
        if row.len() != x_mm.len() {
            let problem = Problem::FieldCount { expected: x_mm.len(), found: row.len() };
            return Err(Error::at_line(file, *line, problem));
        }
        let points = x_mm.iter().zip(row).filter_map(|(x, z)| Some((*x, z.filter(|z| is_point(*z))?)));
        let points: Vec<ProfilePoint> = points.map(|(x, z)| point_of_mm(x, z)).collect();
        let left_out = row.len() - points.len();
        Ok(RawProfile { left_out, ..RawProfile::of_points(points) })
    };
    table.rows.iter().map(profile).collect()
}

/// Numbers, if they are all there and rise.
fn rising(numbers: impl Iterator<Item = Option<f64>>) -> Option<Vec<f64>> {
    let numbers: Vec<f64> = numbers.collect::<Option<_>>()?;
    let rises = numbers.len() > 2 && numbers.windows(2).all(|two| two[1] > two[0]);
    rises.then_some(numbers)
}

/// Reads rows of x0, z0, x1, z1, … with `timestamp` (µs), and `frameIndex` if it is there.
///
/// # Errors
/// A header without `x0`.
pub(crate) fn read_pairs(file: &Path, bytes: Vec<u8>) -> Result<Vec<RawProfile>, Error> {
    let table = numbers::read(file, bytes)?;
    let header: Vec<String> =
        table.header.unwrap_or_default().iter().map(|name| name.to_lowercase()).collect();
    let place = |name: &str| header.iter().position(|known| known == name);
    let first = place("x0").ok_or_else(|| {
        let found = header.iter().take(12).cloned().collect::<Vec<_>>().join(", ");
        Error::in_file(file, Problem::MissingColumn { name: "x0".to_owned(), found })
    })?;
    let (time, frame) = (place("timestamp"), place("frameindex"));
    let profile = |(_, row): &(u64, Vec<Option<f64>>)| {
        let at = |place: Option<usize>| row.get(place?).copied().flatten();
        let places = row[first.min(row.len())..].chunks_exact(2);
        let of_row = places.len();
        let pairs = places.filter_map(|pair| Some((pair[0]?, pair[1]?)));
        let points: Vec<ProfilePoint> = pairs.map(|(x, z)| point_of_mm(x, z)).collect();
        RawProfile {
            stamp_ns: at(time).map(|microseconds| (microseconds * 1e3).round() as i64),
            frame: at(frame).map(|frame| frame as u64),
            left_out: of_row - points.len(),
            points,
        }
    };
    Ok(table.rows.iter().map(profile).collect())
}

pub(super) fn point_of_mm(x_mm: f64, z_mm: f64) -> ProfilePoint {
    ProfilePoint { x_m: x_mm / MM_PER_M, z_m: z_mm / MM_PER_M, intensity: None }
}
