//! Keyence LJ-V7000: the file that the maker's sample program saves. X is in the first column, one profile in each further
//! one, all integers of 0.01 µm (LJ-V7000 series communication library, reference manual, 11.2).

use super::{RawProfile, numbers};
use crate::error::{Error, Problem};
use crate::profile::ProfilePoint;
use std::path::Path;

/// 0.01 µm.
const UNIT_M: f64 = 1e-8;
/// The lowest numbers of 32 bits are codes, not heights.
const NO_POINT_32: f64 = -2_147_483_640.0;
/// Nor are the lowest four of 20 bits, in which fast transfers are packed.
const NO_POINT_20: std::ops::RangeInclusive<f64> = -524_288.0..=-524_285.0;

/// Reads a table of columns.
///
/// # Errors
/// Rows that are not integers, or an X that does not rise or fall.
pub(crate) fn read_columns(file: &Path, bytes: Vec<u8>) -> Result<Vec<RawProfile>, Error> {
    let table = numbers::read(file, bytes)?;
    let columns = table.rows[0].1.len();
    if columns < 2 {
        return Err(Error::at_line(
            file,
            table.rows[0].0,
            Problem::FieldCount { expected: 2, found: columns },
        ));
    }
    let mut profiles = vec![RawProfile::of_points(Vec::with_capacity(table.rows.len())); columns - 1];
    let (mut last_x, mut last_step): (Option<f64>, Option<f64>) = (None, None);
    for (line, row) in &table.rows {
        let at = |problem| Error::at_line(file, *line, problem);
        if row.len() != columns {
            return Err(at(Problem::FieldCount { expected: columns, found: row.len() }));
        }
        let x = row[0].filter(|x| x.fract() == 0.0).ok_or_else(|| at(not_an_integer(row[0])))?;
        let step = last_x.map(|last| x - last);
        if step == Some(0.0) {
            return Err(at(Problem::PointRepeated));
        }
        if last_step.zip(step).is_some_and(|(last, step)| last * step < 0.0) {
            return Err(at(turned_back(x)));
        }
        (last_x, last_step) = (Some(x), step);
        for (profile, value) in profiles.iter_mut().zip(&row[1..]) {
            let z = value.filter(|z| z.fract() == 0.0).ok_or_else(|| at(not_an_integer(*value)))?;
            if z > NO_POINT_32 && !NO_POINT_20.contains(&z) {
                profile.points.push(ProfilePoint { x_m: x * UNIT_M, z_m: z * UNIT_M, intensity: None });
            } else {
                profile.left_out += 1;
            }
        }
    }
    Ok(profiles)
}

fn turned_back(x: f64) -> Problem {
    let expected = "numbers in the first column that rise to the end, or fall";
    Problem::Value { key: "X", expected, found: format!("{x}, which turns back") }
}

fn not_an_integer(found: Option<f64>) -> Problem {
    Problem::Value {
        key: "height",
        expected: "a whole number of 0.01 µm (for heights in mm see the format keyence-lj-x)",
        found: found.map_or_else(|| "no number".to_owned(), |value| value.to_string()),
    }
}
