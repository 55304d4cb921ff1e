//! One row a point: `x z` or `x y z` in mm, with or without a header of names.

use super::numbers::NumberTable;
use super::rows::point_of_mm;
use super::{Raw, RawProfile, numbers};
use crate::error::{Error, Problem};
use crate::header_unit::{HeaderUnit, is_time_name, stem_and_unit};
use crate::import::clock::{Clock, ClockReader, unit_of_steps};
use std::path::Path;

/// Columns of a point's numbers.
struct Places {
    x: usize,
    z: usize,
    time: Option<Time>,
    frame: Option<usize>,
}

/// The column of times.
struct Time {
    place: usize,
    /// Nanoseconds of a unit.
    unit_ns: f64,
    /// Set for clock times or dates.
    reader: Option<ClockReader>,
    words: String,
}

/// Reads points. A new profile begins where time or frame changes, or where x steps back.
///
/// # Errors
/// Rows with ambiguous x and z.
pub(super) fn read(file: &Path, bytes: Vec<u8>, is_point: impl Fn(f64) -> bool) -> Result<Raw, Error> {
    let table = numbers::read(file, bytes)?;
    let mut places = places(&table).map_err(|problem| match problem {
        Problem::FieldCount { .. } => Error::at_line(file, table.rows[0].0, problem),
        _ => Error::in_file(file, problem),
    })?;
    let mut written = table.words_of(places.time.as_ref().map_or(0, |time| time.place));
    let mut profiles: Vec<RawProfile> = Vec::new();
    let mut last_x = f64::NEG_INFINITY;
    for (line, row) in &table.rows {
        let value = |place: usize| row.get(place).copied().flatten();
        let (Some(x), Some(z)) = (value(places.x), value(places.z)) else {
            let problem = Problem::NotANumber { text: "an empty field".to_owned() };
            return Err(Error::at_line(file, *line, problem));
        };
        let word = written.next().unwrap_or_default();
        let stamp_ns = match &mut places.time {
            None => None,
            Some(Time { reader: Some(reader), .. }) => {
                Some(reader.ns(word).map_err(|problem| Error::at_line(file, *line, problem))?)
            }
            Some(Time { place, unit_ns, .. }) => value(*place).map(|time| (time * *unit_ns).round() as i64),
        };
        let frame = places.frame.and_then(value).map(|frame| frame as u64);
        let same = profiles.last().is_some_and(|last| (last.stamp_ns, last.frame) == (stamp_ns, frame));
        if !same || (x < last_x && stamp_ns.is_none() && frame.is_none()) {
            profiles.push(RawProfile { stamp_ns, frame, points: Vec::new(), left_out: 0 });
        }
        last_x = x;
        match profiles.last_mut() {
            Some(last) if is_point(z) => last.points.push(point_of_mm(x, z)),
            Some(last) => last.left_out += 1,
            None => {}
        }
    }
    let clock =
        places.time.as_ref().and_then(|time| time.reader.as_ref()).map_or(Clock::Seconds, ClockReader::clock);
    Ok(Raw { profiles, notes: places.time.map(|time| time.words).into_iter().collect(), clock })
}

/// The column of times by its name: in its unit or, without one, in that of its steps.
fn time_of(header: &[String], table: &NumberTable) -> Option<Time> {
    let place = header.iter().position(|name| is_time_name(&stem_and_unit(name).0))?;
    let name = &header[place];
    if let Some(reader) = table.words_of(place).next().and_then(ClockReader::of) {
        let words = format!("`{name}` has clock times");
        return Some(Time { place, unit_ns: 1.0, reader: Some(reader), words });
    }
    let unit = match stem_and_unit(name) {
        (_, HeaderUnit::Known(unit)) => unit,
        (stem, _) if stem == "t" => "_s",
        _ => {
            // Points of one profile have one time.
            let mut times: Vec<String> = Vec::new();
            for (_, row) in &table.rows {
                let cell = row.get(place).copied().flatten()?.to_string();
                if times.last() != Some(&cell) {
                    times.push(cell);
                }
                if times.len() > 50 {
                    break;
                }
            }
            unit_of_steps(&times.iter().map(String::as_str).collect::<Vec<_>>())?.0
        }
    };
    let unit_ns = match unit {
        "_s" => 1e9,
        "_ms" => 1e6,
        "_us" => 1e3,
        "_ns" => 1.0,
        _ => return None,
    };
    Some(Time { place, unit_ns, reader: None, words: format!("`{name}` is the time, in {}", &unit[1..]) })
}

fn places(table: &NumberTable) -> Result<Places, Problem> {
    let width = table.rows[0].1.len();
    let without = |x, z| Ok(Places { x, z, time: None, frame: None });
    let Some(header) = table.header.as_deref().filter(|header| header.len() == width) else {
        return match width {
            2 => without(0, 1),
            3 => without(0, 2),
            _ => Err(Problem::FieldCount { expected: 3, found: width }),
        };
    };
    let names: Vec<String> = header.iter().map(|name| name.to_lowercase()).collect();
    let place = |accepted: &[&str]| names.iter().position(|name| accepted.contains(&name.as_str()));
    let need = |accepted: &[&str]| {
        place(accepted)
            .ok_or_else(|| Problem::MissingColumn { name: accepted[0].to_owned(), found: header.join(", ") })
    };
    Ok(Places {
        x: need(&["x", "x_mm", "x [mm]", "x(mm)", "x (mm)"])?,
        z: need(&["z", "z_mm", "z [mm]", "z(mm)", "z (mm)"])?,
        time: time_of(header, table),
        frame: place(&[
            "frame",
            "frame_index",
            "picture counter",
            "picturecounter",
            "profile",
            "profile counter",
            "profilecounter",
            "profile no.",
        ]),
    })
}
