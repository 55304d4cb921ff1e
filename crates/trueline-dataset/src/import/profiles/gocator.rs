//! Gocator's CSV: sections that end with `End`. `Profile` has the x of each column in its header, `RawProfile` a row of X and a row
//! of Z for each profile (LMI, Gocator Line Profile Sensors, user manual, "CSV File Format").

use super::RawProfile;
use crate::dialect::decode;
use crate::error::{Error, Problem};
use crate::profile::ProfilePoint;
use crate::stamp::parse_nanoseconds;
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
/// No such section, or rows that are none of it.
pub fn read(file: &Path, bytes: Vec<u8>) -> Result<Vec<RawProfile>, Error> {
    let (text, _) = decode(file, bytes)?;
    let mut profiles = Vec::new();
    let mut section = "";
    let mut header: Option<DataHeader> = None;
    let mut pending_x: Option<Vec<Option<f64>>> = None;
    for (index, line) in text.lines().enumerate() {
        let fields: Vec<&str> = line.trim_start_matches('\u{feff}').split(',').map(str::trim).collect();
        match fields[..] {
            ["End", ..] => (section, header) = ("", None),
            _ if section.is_empty() => section = fields[0],
            _ if !matches!(section, "Profile" | "RawProfile") => {}
            _ if fields[0] == "Frame" && fields.contains(&"Axis") => {
                header = Some(
                    DataHeader::of(&fields, section)
                        .map_err(|p| Error::at_line(file, index as u64 + 1, p))?,
                );
            }
            _ => {
                if let Some(header) = &header {
                    let row = header.row(&fields).map_err(|p| Error::at_line(file, index as u64 + 1, p))?;
                    row.into_profile(header, &mut pending_x, &mut profiles);
                }
            }
        }
    }
    Ok(profiles)
}

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
        let x_mm = fields[axis + 1..].iter().filter(|field| !field.is_empty()).map(|field| number(field));
        let x_mm = if section == "Profile" { Some(x_mm.collect::<Result<_, _>>()?) } else { None };
        Ok(Self { frame: place("Frame")?, source: place("Source")?, time: place("Time")?, axis, x_mm })
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
            stamp_ns: parse_nanoseconds(fields[self.time], MICROSECOND_DIGITS),
            axis: fields[self.axis],
            mm: values
                .map(|field| if field.is_empty() { Ok(None) } else { number(field).map(Some) })
                .collect::<Result<_, _>>()?,
        })
    }
}

impl Row<'_> {
    /// A row of Z closes a profile; one of X waits for it; intensity is not needed.
    fn into_profile(
        self,
        header: &DataHeader,
        pending_x: &mut Option<Vec<Option<f64>>>,
        profiles: &mut Vec<RawProfile>,
    ) {
        match self.axis {
            "X" => *pending_x = Some(self.mm),
            "Z" => {
                let x_mm: Vec<Option<f64>> = match &header.x_mm {
                    Some(x_mm) => x_mm.iter().copied().map(Some).collect(),
                    None => pending_x.take().unwrap_or_default(),
                };
                let both = x_mm.iter().zip(&self.mm).filter_map(|(x, z)| Some(((*x)?, (*z)?)));
                let points =
                    both.map(|(x, z)| ProfilePoint { x_m: x / MM_PER_M, z_m: z / MM_PER_M, intensity: None });
                profiles.push(RawProfile {
                    stamp_ns: self.stamp_ns,
                    frame: self.frame,
                    points: points.collect(),
                });
            }
            _ => {}
        }
    }
}

fn number(field: &str) -> Result<f64, Problem> {
    let value: f64 = field.parse().map_err(|_| Problem::NotANumber { text: field.to_owned() })?;
    if value.is_finite() { Ok(value) } else { Err(Problem::NotFinite { text: field.to_owned() }) }
}
