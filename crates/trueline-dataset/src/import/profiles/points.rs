//! One row a point: `x z` or `x y z` in mm, with or without a header of names.

use super::rows::point_of_mm;
use super::{RawProfile, numbers};
use crate::error::{Error, Problem};
use std::path::Path;

/// Where the numbers of a point stand in its row.
struct Places {
    x: usize,
    z: usize,
    time: Option<(usize, f64)>,
    frame: Option<usize>,
}

/// Reads points. A new profile begins where time or frame changes, or where x steps back.
///
/// # Errors
/// Rows of which it is not clear what is x and what is z.
pub fn read(file: &Path, bytes: Vec<u8>, is_point: impl Fn(f64) -> bool) -> Result<Vec<RawProfile>, Error> {
    let table = numbers::read(file, bytes)?;
    let places =
        places(table.header.as_deref(), table.rows[0].1.len()).map_err(|p| Error::in_file(file, p))?;
    let mut profiles: Vec<RawProfile> = Vec::new();
    let mut last_x = f64::NEG_INFINITY;
    for (line, row) in &table.rows {
        let value = |place: usize| row.get(place).copied().flatten();
        let (Some(x), Some(z)) = (value(places.x), value(places.z)) else {
            let problem = Problem::NotANumber { text: "an empty field".to_owned() };
            return Err(Error::at_line(file, *line, problem));
        };
        let stamp_ns = places.time.and_then(|(place, ns)| Some((value(place)? * ns).round() as i64));
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
    Ok(profiles)
}

fn places(header: Option<&[String]>, width: usize) -> Result<Places, Problem> {
    let without = |x, z| Ok(Places { x, z, time: None, frame: None });
    let Some(header) = header.filter(|header| header.len() == width) else {
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
    let time = [("time_s", 1e9), ("t", 1e9), ("time_ms", 1e6), ("time_us", 1e3), ("time_ns", 1.0)];
    Ok(Places {
        x: need(&["x", "x_mm", "x [mm]", "x(mm)"])?,
        z: need(&["z", "z_mm", "z [mm]", "z(mm)"])?,
        time: time.into_iter().find_map(|(name, ns)| Some((place(&[name])?, ns))),
        frame: place(&["frame", "frame_index", "picture counter", "picturecounter", "profile"]),
    })
}
