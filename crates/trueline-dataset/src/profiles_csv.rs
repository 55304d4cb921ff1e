//! `profiles.csv`: whole profiles, one row a point (long) or one row a profile (wide).
//!
//! | form | columns |
//! |---|---|
//! | long | `time_s`, `x_mm`, `z_mm`; optional `frame`, `intensity`; rows with the same stamp and frame are one profile |
//! | wide | `time_s`, `x0_mm`, `dx_mm`, `z0_mm`, `z1_mm`, …; optional `frame`; an empty cell is no return |

use crate::encoder_log;
use crate::error::{Error, Problem};
use crate::profile::{Profile, ProfilePoint};
use crate::profile_stream::Assembly;
use crate::stamp;
use crate::stop_poses::{Pairing, RowKey};
use crate::table::{self, ColumnSpec, Header, optional, required};
use crate::unit::{MM_PER_M, Quantity};
use std::collections::BTreeSet;
use std::io::Write;
use std::ops::ControlFlow;
use std::path::Path;

pub(crate) const TIME: usize = 0;
pub(crate) const FRAME: usize = 1;
/// First column of a form.
pub(crate) const FIRST: usize = 2;

pub(crate) const SHARED: [ColumnSpec<'static>; 2] =
    [required("time", Quantity::Time), optional("frame", Quantity::Count)];

pub(crate) const LONG: [ColumnSpec<'static>; 3] = [
    required("x", Quantity::Length),
    required("z", Quantity::Length),
    optional("intensity", Quantity::Plain),
];

const WIDE: [ColumnSpec<'static>; 2] = [required("x0", Quantity::Length), required("dx", Quantity::Length)];

/// Whether a name is that of a column of this file.
#[must_use]
pub(crate) fn is_column(name: &str) -> bool {
    [&SHARED[..], &LONG, &WIDE].iter().any(|specs| table::is_one_of(name, specs))
        || height_number(name).is_some()
        || name == encoder_log::COLUMN
}

/// Which height of a row a column is: `z12_mm` → 12.
fn height_number(name: &str) -> Option<usize> {
    let rest = name.strip_prefix('z')?;
    let (number, _) = rest.split_once('_')?;
    if number.starts_with('0') && number.len() > 1 {
        return None;
    }
    number.parse().ok()
}

/// Reads profiles of either form.
///
/// # Errors
/// Anything that is not a clean table with rising stamps.
pub fn read(file: &Path, bytes: &[u8]) -> Result<Vec<Profile>, Error> {
    read_at(file, bytes, Pairing::default())
}

/// The same if rows name a stop, or the count of an encoder, in place of a stamp.
///
/// # Errors
/// As [`read`], and a stop without a pose, or a count beyond the encoder's log.
pub(crate) fn read_at(file: &Path, bytes: &[u8], pairing: Pairing<'_>) -> Result<Vec<Profile>, Error> {
    let mut profiles = Vec::new();
    let mut keep = |profile| {
        profiles.push(profile);
        ControlFlow::Continue(())
    };
    let mut tables = Tables { file, pairing, all: Assembly::new(&mut keep) };
    let _all = tables.take(bytes)?;
    tables.end()?;
    profiles.sort_by_key(|profile| profile.stamp_ns);
    Ok(profiles)
}

/// A table in one piece or in several, each under the same header.
pub(crate) struct Tables<'a, 'b> {
    pub file: &'a Path,
    pub pairing: Pairing<'a>,
    pub all: Assembly<'a, 'b>,
}

impl Tables<'_, '_> {
    /// Hands over the profiles of a piece. The last one may go on in the next piece.
    ///
    /// # Errors
    /// As [`read_at`], with lines from the beginning of this piece.
    pub(crate) fn take(&mut self, bytes: &[u8]) -> Result<ControlFlow<()>, Error> {
        let header = Header::read(self.file, bytes)?;
        let key = RowKey::of(&header, self.pairing)?;
        let heights = header.names().iter().filter(|name| height_number(name).is_some()).count();
        if heights > 0 {
            read_wide(header, heights, key, &mut self.all)
        } else {
            read_long(header, key, &mut self.all)
        }
    }

    /// Hands over the last profile.
    ///
    /// # Errors
    /// A table without rows, or without a point.
    pub(crate) fn end(self) -> Result<(), Error> {
        let (file, profiles) = (self.file, self.all.profiles);
        if profiles == 0 {
            return Err(Error::in_file(file, Problem::NoRows));
        }
        if !self.all.end() {
            return Err(Error::in_file(file, Problem::NoPoints { profiles }));
        }
        Ok(())
    }
}

fn read_long(
    header: Header<'_>,
    key: RowKey<'_>,
    all: &mut Assembly<'_, '_>,
) -> Result<ControlFlow<()>, Error> {
    let specs: Vec<ColumnSpec<'_>> = shared(key).into_iter().chain(LONG).collect();
    let mut table = header.find(&specs)?;
    while table.next_row()? {
        let last_ns = all.last().map(|last| last.stamp_ns);
        let (stamp_ns, frame) = (key.stamp_ns(&table, TIME, last_ns)?, table.count(FRAME)?);
        let point = ProfilePoint {
            x_m: table.required_number(FIRST)?,
            z_m: table.required_number(FIRST + 1)?,
            intensity: table.number(FIRST + 2)?,
        };
        match all.of_row(stamp_ns, frame) {
            ControlFlow::Continue(profile) => profile.points.push(point),
            ControlFlow::Break(()) => return Ok(ControlFlow::Break(())),
        }
    }
    Ok(ControlFlow::Continue(()))
}

/// The first height that the header of a wide table leaves out, of those before its last one.
fn missing_height(header: &Header<'_>) -> Option<Problem> {
    let numbers: BTreeSet<usize> = header.names().iter().filter_map(|name| height_number(name)).collect();
    let last = *numbers.last()?;
    let missing = (0..last).find(|number| !numbers.contains(number))?;
    let others = header.names().iter().filter(|name| height_number(name).is_none());
    let others = others.map(|name| name.to_string()).collect::<Vec<_>>().join(", ");
    let found = format!("{others}, and {} heights up to z{last}", numbers.len());
    Some(Problem::MissingColumn { name: format!("z{missing}_mm"), found })
}

fn read_wide(
    header: Header<'_>,
    heights: usize,
    key: RowKey<'_>,
    all: &mut Assembly<'_, '_>,
) -> Result<ControlFlow<()>, Error> {
    if let Some(missing) = missing_height(&header) {
        return Err(header.error(missing));
    }
    let names: Vec<String> = (0..heights).map(|k| format!("z{k}")).collect();
    let columns = names.iter().map(|name| required(name, Quantity::Length));
    let specs: Vec<ColumnSpec<'_>> = shared(key).into_iter().chain(WIDE).chain(columns).collect();
    let mut table = header.find(&specs)?;
    while table.next_row()? {
        let last_ns = all.last().map(|last| last.stamp_ns);
        let (stamp_ns, frame) = (key.stamp_ns(&table, TIME, last_ns)?, table.count(FRAME)?);
        let (x0_m, dx_m) = (table.required_number(FIRST)?, table.required_number(FIRST + 1)?);
        if dx_m == 0.0 {
            let expected = "the distance of one column from the next";
            let problem = Problem::Value { key: "dx", expected, found: "0".to_owned() };
            return Err(table.error_in(FIRST + 1, problem));
        }
        let mut points = Vec::with_capacity(heights);
        for k in 0..heights {
            let column = FIRST + WIDE.len() + k;
            if table.text(column).is_some_and(|text| !text.is_empty()) {
                let (x_m, z_m) = (x0_m + dx_m * k as f64, table.required_number(column)?);
                points.push(ProfilePoint { x_m, z_m, intensity: None });
            }
        }
        if all.add(Profile { stamp_ns, frame, points }).is_break() {
            return Ok(ControlFlow::Break(()));
        }
    }
    Ok(ControlFlow::Continue(()))
}

/// The columns of both forms, with the key that pairs their rows with the robot in the first.
fn shared(key: RowKey<'_>) -> [ColumnSpec<'static>; 2] {
    let mut shared = SHARED;
    shared[TIME] = key.spec();
    shared
}

/// Writes profiles in the long form; those without a point leave no row.
///
/// # Errors
/// Error of the writer.
pub fn write(mut out: impl Write, profiles: &[Profile]) -> std::io::Result<()> {
    let frames = profiles.iter().all(|profile| profile.frame.is_some());
    let intensity =
        profiles.iter().flat_map(|profile| &profile.points).all(|point| point.intensity.is_some());
    writeln!(
        out,
        "time_s,{}x_mm,z_mm{}",
        if frames { "frame," } else { "" },
        if intensity { ",intensity" } else { "" }
    )?;
    for profile in profiles {
        let time = stamp::format_seconds(profile.stamp_ns);
        let frame = profile.frame.filter(|_| frames).map_or(String::new(), |frame| format!("{frame},"));
        for point in &profile.points {
            write!(out, "{time},{frame}{},{}", point.x_m * MM_PER_M, point.z_m * MM_PER_M)?;
            match point.intensity.filter(|_| intensity) {
                Some(intensity) => writeln!(out, ",{intensity}")?,
                None => writeln!(out)?,
            }
        }
    }
    Ok(())
}
