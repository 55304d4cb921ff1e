//! Gocator's CSV: sections that end with `End`. `Profile` has the x of each column in its header, `RawProfile` a row of X and a row
//! of Z for each profile (LMI, Gocator Line Profile Sensors, user manual, "CSV File Format").

use super::RawProfile;
use crate::dialect::decode;
use crate::error::{Error, Problem};
use crate::profile::ProfilePoint;
use crate::stamp::{parse_nanoseconds, problem_of};
use crate::unit::MM_PER_M;
use std::path::Path;

/// Decimal digits from microseconds to nanoseconds.
const MICROSECOND_DIGITS: usize = 3;

/// The header of the data of a section.
struct DataHeader {
    frame: usize,
    source: usize,
    time: usize,
    axis: usize,
    /// Positions of the columns after `axis`, mm, in a section `Profile`.
    x_mm: Option<Vec<f64>>,
}

/// Reads the profiles of the sections `Profile` and `RawProfile`.
///
/// # Errors
/// No such section, or rows of another form.
pub fn read(file: &Path, bytes: Vec<u8>) -> Result<Vec<RawProfile>, Error> {
    let (text, _) = decode(file, bytes)?;
    let mut profiles = Vec::new();
    let mut section = "";
    let mut others: Vec<&str> = Vec::new();
    let mut header: Option<DataHeader> = None;
    let mut pending_x: Option<PendingX> = None;
    for (index, line) in text.lines().enumerate() {
        let fields: Vec<&str> = line.trim_start_matches('\u{feff}').split(',').map(str::trim).collect();
        match fields[..] {
            ["End", ..] => (section, header) = ("", None),
            _ if section.is_empty() => {
                section = fields[0];
                others.extend(
                    Some(section).filter(|name| !matches!(*name, "" | "Info" | "Profile" | "RawProfile")),
                );
            }
            _ if !matches!(section, "Profile" | "RawProfile") => {}
            _ if fields[0] == "Frame" && fields.contains(&"Axis") => {
                header = Some(
                    DataHeader::of(&fields, section)
                        .map_err(|p| Error::at_line(file, index as u64 + 1, p))?,
                );
            }
            _ => {
                if let Some(header) = &header {
                    let added = header.row(&fields).and_then(|row| row.into_profile(header, &mut pending_x));
                    profiles.extend(added.map_err(|p| Error::at_line(file, index as u64 + 1, p))?);
                }
            }
        }
    }
    if profiles.is_empty() {
        return Err(without_profiles(file, &others));
    }
    Ok(profiles)
}

/// The error of a file without profiles, for example a surface: its rows have no time of their own.
fn without_profiles(file: &Path, sections: &[&str]) -> Error {
    const SURFACES: [&str; 4] = ["Part", "Surface", "SurfacePointCloud", "SurfaceSection"];
    match sections.iter().find(|name| SURFACES.contains(name)) {
        Some(name) => Error::unreadable(
            file,
            format!("a Gocator surface (section `{name}`): its rows have no time stamps"),
            "record in the mode Profile instead of Surface, and export the profiles: each has its stamp there",
        ),
        None if sections.is_empty() => Error::in_file(file, Problem::NoRows),
        None => Error::unreadable(
            file,
            format!("a Gocator file without profiles (it has the sections {})", sections.join(", ")),
            "export it in the mode Profile: the section is called Profile or RawProfile",
        ),
    }
}

/// The positions in a row of X, mm, and the frame that it is of.
type PendingX = (Option<u64>, Vec<Option<f64>>);

/// One row: an axis of one profile.
struct Row<'a> {
    frame: Option<u64>,
    stamp_ns: Option<i64>,
    axis: &'a str,
    mm: Vec<Option<f64>>,
}

impl DataHeader {
    fn of(fields: &[&str], section: &str) -> Result<Self, Problem> {
        let place = |name: &str| {
            fields.iter().position(|field| *field == name).ok_or_else(|| Problem::MissingColumn {
                name: name.to_owned(),
                found: fields[..fields.len().min(12)].join(", "),
            })
        };
        let axis = place("Axis")?;
        // Empty cells at the end belong to longer rows; one in between would shift the columns after it.
        let columns = fields.iter().rposition(|field| !field.is_empty()).map_or(0, |last| last + 1);
        let x_mm = fields[(axis + 1).min(columns)..columns].iter().map(|field| number(field));
        let x_mm = if section == "Profile" { Some(x_mm.collect::<Result<_, _>>()?) } else { None };
        Ok(Self { frame: place("Frame")?, source: place("Source")?, time: place("Time")?, axis, x_mm })
    }

    /// The stamp in a field; an empty one has none.
    fn stamp_ns(text: &str) -> Result<Option<i64>, Problem> {
        let stamp_ns = parse_nanoseconds(text, MICROSECOND_DIGITS);
        if stamp_ns.is_none() && !text.is_empty() { Err(problem_of(text)) } else { Ok(stamp_ns) }
    }

    fn row<'a>(&self, fields: &[&'a str]) -> Result<Row<'a>, Problem> {
        if fields.len() <= self.axis {
            return Err(Problem::FieldCount { expected: self.axis + 2, found: fields.len() });
        }
        if fields[self.source] != "0" {
            let found = fields[self.source].to_owned();
            return Err(Problem::Value { key: "Source", expected: "0: the profiles of one sensor", found });
        }
        let values = fields[self.axis + 1..].iter();
        Ok(Row {
            frame: fields[self.frame].parse().ok(),
            stamp_ns: Self::stamp_ns(fields[self.time])?,
            axis: fields[self.axis],
            mm: values
                .map(|field| if field.is_empty() { Ok(None) } else { number(field).map(Some) })
                .collect::<Result<_, _>>()?,
        })
    }
}

impl Row<'_> {
    /// A row of Z closes a profile, which is returned; one of X waits for it; intensity is not needed.
    fn into_profile(
        self,
        header: &DataHeader,
        pending_x: &mut Option<PendingX>,
    ) -> Result<Option<RawProfile>, Problem> {
        match self.axis {
            "X" => *pending_x = Some((self.frame, self.mm)),
            "Z" => {
                let x_mm: Vec<Option<f64>> = match &header.x_mm {
                    Some(x_mm) => x_mm.iter().copied().map(Some).collect(),
                    None => self.positions(pending_x.take())?,
                };
                let last = self.mm.iter().rposition(Option::is_some).map_or(0, |last| last + 1);
                if last > x_mm.len() {
                    let (expected, found) = (header.axis + 1 + x_mm.len(), header.axis + 1 + last);
                    return Err(Problem::FieldCount { expected, found });
                }
                let both = x_mm.iter().zip(&self.mm).filter_map(|(x, z)| Some(((*x)?, (*z)?)));
                let points: Vec<ProfilePoint> = both
                    .map(|(x, z)| ProfilePoint { x_m: x / MM_PER_M, z_m: z / MM_PER_M, intensity: None })
                    .collect();
                let left_out = x_mm.len() - points.len();
                return Ok(Some(RawProfile { stamp_ns: self.stamp_ns, frame: self.frame, points, left_out }));
            }
            _ => {}
        }
        Ok(None)
    }

    /// The positions of the row of X before, which must be of the same frame.
    fn positions(&self, pending_x: Option<PendingX>) -> Result<Vec<Option<f64>>, Problem> {
        pending_x.filter(|(frame, _)| *frame == self.frame).map(|(_, x_mm)| x_mm).ok_or_else(|| {
            Problem::Unreadable {
                what: "a row Z of a RawProfile without the row X of its frame before it".to_owned(),
                hint: "each profile is a row X and then a row Z: export it again, or leave this row out",
            }
        })
    }
}

fn number(field: &str) -> Result<f64, Problem> {
    let value: f64 = field.parse().map_err(|_| Problem::NotANumber { text: field.to_owned() })?;
    if value.is_finite() { Ok(value) } else { Err(Problem::NotFinite { text: field.to_owned() }) }
}
