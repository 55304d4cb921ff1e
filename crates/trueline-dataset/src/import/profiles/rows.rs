//! One row a profile: heights in mm with positions in the header or evenly spaced, or x and z in turn.

use super::leading_columns::LeadingColumns;
use super::{EvenColumns, Raw, RawProfile, numbers};
use crate::error::{Error, Problem};
use crate::log_problem::LogProblem;
use crate::profile::ProfilePoint;
use crate::unit::MM_PER_M;
use std::path::Path;

/// Reads rows of heights. A header of rising numbers is the position of each column, mm. A first column with a count or time
/// of the rows is not a height.
///
/// # Errors
/// Positions that are not known, rows of different lengths, or more values than positions.
pub(super) fn read(
    file: &Path,
    bytes: Vec<u8>,
    columns: Option<EvenColumns>,
    is_point: impl Fn(f64) -> bool,
) -> Result<Raw, Error> {
    let mut table = numbers::read(file, bytes)?;
    expect_one_width(file, &table.rows)?;
    let mut lead = LeadingColumns::taken_off(&mut table);
    let width = table.rows[0].1.len();
    let in_header = table
        .header
        .as_ref()
        .and_then(|header| rising(header.iter().map(|name| name.parse().ok())))
        .filter(|x_mm| !is_count(x_mm));
    let in_row = || rising(table.rows[0].1.iter().copied()).filter(|x_mm| !is_count(x_mm));
    let (x_mm, positions_are_a_row) = match (columns, in_header) {
        (Some(even), _) => {
            expect_room(&table.rows, even, &is_point)
                .map_err(|problem| Error::at_line(file, table.rows[0].0, problem))?;
            ((0..width).map(|k| even.first_mm + even.step_mm * k as f64).collect(), false)
        }
        (None, Some(x_mm)) => (x_mm, false),
        (None, None) => (in_row().ok_or_else(|| Error::in_file(file, Problem::NoColumnPositions))?, true),
    };
    if positions_are_a_row {
        table.rows.remove(0);
    }
    let profile = |(index, (line, row)): (usize, &(u64, Vec<Option<f64>>))| {
        let at = |problem| Error::at_line(file, *line, problem);
        if row.len() != x_mm.len() {
            return Err(at(Problem::FieldCount { expected: x_mm.len(), found: row.len() }));
        }
        let points = x_mm.iter().zip(row).filter_map(|(x, z)| Some((*x, z.filter(|z| is_point(*z))?)));
        let points: Vec<ProfilePoint> = points.map(|(x, z)| point_of_mm(x, z)).collect();
        let left_out = row.len() - points.len();
        let index = index + usize::from(positions_are_a_row);
        let stamp_ns = lead.stamp_ns(index).map_err(at)?;
        Ok(RawProfile { stamp_ns, frame: lead.frame(index), left_out, points })
    };
    let profiles = table.rows.iter().enumerate().map(profile).collect::<Result<_, Error>>()?;
    Ok(Raw { profiles, clock: lead.clock(), notes: lead.notes() })
}

fn expect_one_width(file: &Path, rows: &[Row]) -> Result<(), Error> {
    let expected = rows[0].1.len();
    match rows.iter().find(|(_, row)| row.len() != expected) {
        Some((line, row)) => {
            Err(Error::at_line(file, *line, Problem::FieldCount { expected, found: row.len() }))
        }
        None => Ok(()),
    }
}

/// Largest number of columns before the heights: more cannot be a counter, a time and an encoder.
const MOST_LEADING: usize = 8;

/// Fails where a few values more are there than positions that begin and end at the same distance from the middle of the view.
fn expect_room(rows: &[Row], even: EvenColumns, is_point: &impl Fn(f64) -> bool) -> Result<(), Problem> {
    let steps = -2.0 * even.first_mm / even.step_mm;
    let whole = steps.round();
    let found = rows[0].1.len();
    if !steps.is_finite() || whole <= 1.0 || (steps - whole).abs() >= 1e-6 * steps.abs() {
        return Ok(());
    }
    // The last height is at the mirrored place of the first, or one before it: with one value more the first may be no height.
    let (fewest, most) = (whole as usize, (whole as usize).saturating_add(1));
    let expected = match found {
        _ if found > most && found <= most.saturating_add(MOST_LEADING) => most,
        _ if found == most && !first_is_height(rows, even.step_mm, is_point) => fewest,
        _ => return Ok(()),
    };
    let (first_mm, step_mm) = (even.first_mm, even.step_mm);
    Err(LogProblem::MoreValues { found, expected, first_mm, step_mm }.into())
}

/// A row of a table, with its line.
type Row = (u64, Vec<Option<f64>>);

/// Whether the first values continue their neighbours: mostly no points where the second ones are none, and as near to these
/// as they are to the third ones. A counter, a time or an encoder is neither.
fn first_is_height(rows: &[Row], step_mm: f64, is_point: &impl Fn(f64) -> bool) -> bool {
    // Differences up to this many times those of neighbours in the profile, and slopes, are no break.
    const FARTHEST: f64 = 10.0;
    let value = |row: &Row, k: usize| row.1.get(k).copied().flatten().filter(|z| is_point(*z));
    let unlike = rows.iter().filter(|row| value(row, 0).is_some() && value(row, 1).is_none()).count();
    let middle = |a: usize, b: usize| {
        let mut apart: Vec<f64> =
            rows.iter().filter_map(|row| Some((value(row, a)? - value(row, b)?).abs())).collect();
        apart.sort_by(f64::total_cmp);
        apart.get(apart.len() / 2).copied().unwrap_or(0.0)
    };
    2 * unlike <= rows.len() && middle(0, 1) <= FARTHEST * (middle(1, 2) + step_mm.abs())
}

/// Whether numbers are 0, 1, 2, … or 1, 2, 3, …: of columns or rows they are the numbers, not positions in mm.
fn is_count(numbers: &[f64]) -> bool {
    matches!(numbers.first(), Some(0.0 | 1.0)) && numbers.windows(2).all(|two| two[1] - two[0] == 1.0)
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
pub(super) fn read_pairs(file: &Path, bytes: Vec<u8>) -> Result<Vec<RawProfile>, Error> {
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
