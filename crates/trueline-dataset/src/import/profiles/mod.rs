//! Profiles as the makers of sensors export them.
//!
//! | format | file | time |
//! |---|---|---|
//! | [`gocator`] | LMI Gocator 4 to 6, CSV with sections `Profile` or `RawProfile` | stamp of each profile, µs |
//! | [`keyence`] | Keyence LJ-V7000, TSV: X, then one column a profile, in 0.01 µm | none |
//! | [`rows`] | Keyence LJ-X8000, Wenglor and others: one row a profile, mm; GoPxL loggers: x, z in turn | column, or none |
//! | [`points`] | Micro-Epsilon scanCONTROL (ASC) and others: one row a point, mm | column, or none |
//! | [`ply`] | PLY, ascii or binary | property, or none |
//!
//! No axis is mirrored: the laser plane is a plane, and a mirrored x or z turns the estimated mount by half a turn with it.

pub mod gocator;
pub mod keyence;
mod leading_columns;
mod numbers;
pub mod ply;
pub mod points;
pub mod rows;
pub mod times;

use crate::error::{Error, Problem};
use crate::import::clock::Clock;
use crate::log_problem::LogProblem;
use crate::profile::{Profile, ProfilePoint};
use crate::stamp;
use std::fmt;
use std::path::Path;

/// A profile, possibly without a time.
#[derive(Clone, Debug, PartialEq)]
pub struct RawProfile {
    /// Stamp, ns, where the file has one.
    pub stamp_ns: Option<i64>,
    /// Frame counter, where the file has one.
    pub frame: Option<u64>,
    /// Its points.
    pub points: Vec<ProfilePoint>,
    /// Number of its values that are no point.
    pub left_out: usize,
}

impl RawProfile {
    fn of_points(points: Vec<ProfilePoint>) -> Self {
        Self { stamp_ns: None, frame: None, points, left_out: 0 }
    }
}

/// Content of a file of profiles.
#[derive(Clone, Debug, Default)]
pub struct Raw {
    /// Its profiles.
    pub profiles: Vec<RawProfile>,
    /// Remarks on recognised data.
    pub notes: Vec<String>,
    /// Origin of its stamps.
    pub clock: Clock,
}

impl From<Vec<RawProfile>> for Raw {
    fn from(profiles: Vec<RawProfile>) -> Self {
        Self { profiles, ..Self::default() }
    }
}

/// The format of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProfileFormat {
    /// Gocator's CSV.
    Gocator,
    /// A row a profile of x, z in turn, as users of GoPxL log it.
    GoPxl,
    /// Keyence LJ-V7000: a column a profile, integers of 0.01 µm.
    KeyenceLjV,
    /// Keyence LJ-X8000: a row a profile, mm.
    KeyenceLjX,
    /// Micro-Epsilon scanCONTROL: a row a point.
    ScanControl,
    /// Wenglor weCat3D: a row a profile, mm, 0 is no point.
    Wenglor,
    /// PLY.
    Ply,
    /// A row a profile.
    Rows,
    /// A row a point.
    Points,
}

impl ProfileFormat {
    /// All, with their names.
    pub const ALL: [(&'static str, Self); 9] = [
        ("gocator", Self::Gocator),
        ("gopxl", Self::GoPxl),
        ("keyence-lj-v", Self::KeyenceLjV),
        ("keyence-lj-x", Self::KeyenceLjX),
        ("scancontrol", Self::ScanControl),
        ("wenglor", Self::Wenglor),
        ("ply", Self::Ply),
        ("rows", Self::Rows),
        ("points", Self::Points),
    ];

    /// The format of a name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().find(|(known, _)| *known == name).map(|(_, format)| *format)
    }

    /// The format that the content shows beyond doubt; the others must be named.
    #[must_use]
    pub fn recognised(bytes: &[u8]) -> Option<Self> {
        if bytes.starts_with(b"ply") {
            return Some(Self::Ply);
        }
        let start = String::from_utf8_lossy(&bytes[..bytes.len().min(400)]).into_owned();
        start.lines().take(2).any(|line| line.contains("CSV Version")).then_some(Self::Gocator)
    }

    /// The assumption, in words.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Self::Gocator => "Gocator CSV: mm; stamps in µs; empty cells are no point",
            Self::GoPxl => "x0, z0, x1, z1, … a row: mm; timestamp in µs",
            Self::KeyenceLjV => {
                "Keyence LJ-V: X in the first column, one profile in each further one, 0.01 µm; -524288 … -524285 and less than -2147483640 are no point"
            }
            Self::KeyenceLjX => {
                "Keyence LJ-X: one row a profile, mm; -99.9999 and values below -999 mean no point"
            }
            Self::ScanControl => {
                "scanCONTROL: one row a point, x and z in mm; z = 0 is no point; a profile ends where x steps back"
            }
            Self::Wenglor => "Wenglor: one row a profile, mm; 0 is no point",
            Self::Ply => {
                "PLY: x along the stripe and z range in mm; one profile for each value of time, frame or y"
            }
            Self::Rows => "one row a profile, mm; empty cells are no point",
            Self::Points => {
                "one row a point, x and z in mm; a profile ends where its time or frame changes or x steps back"
            }
        }
    }
}

impl fmt::Display for ProfileFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(Self::ALL.iter().find(|(_, format)| format == self).map_or("", |(name, _)| name))
    }
}

/// Places of a row's columns along the stripe, if the file does not state them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EvenColumns {
    /// Position of the first, mm.
    pub first_mm: f64,
    /// Distance between two, mm.
    pub step_mm: f64,
}

/// When the profiles were taken, if the file does not tell.
#[derive(Clone, Debug, PartialEq)]
pub enum Timing {
    /// At a steady rate.
    Rate {
        /// Stamp of the first, ns.
        first_ns: i64,
        /// Profiles a second.
        hz: f64,
    },
    /// One stamp for each, ns; or one for every several, which follow each other at a rate.
    Stamps {
        /// Stamps, ns.
        stamps_ns: Vec<i64>,
        /// Profiles a second between two stamps, if there are more profiles than stamps.
        hz: Option<f64>,
    },
}

impl Timing {
    /// The stamp of each of `count` profiles, ns.
    ///
    /// # Errors
    /// Stamps that are neither one for each nor, with a rate, one for every several.
    fn stamps_ns(&self, count: usize) -> Result<Vec<i64>, LogProblem> {
        let after =
            |first_ns: i64, k: usize, hz: f64| first_ns.saturating_add((k as f64 / hz * 1e9).round() as i64);
        match self {
            Self::Rate { first_ns, hz } => Ok((0..count).map(|k| after(*first_ns, k, *hz)).collect()),
            Self::Stamps { stamps_ns, .. } if stamps_ns.len() == count => Ok(stamps_ns.clone()),
            Self::Stamps { stamps_ns, hz: Some(hz) }
                if !stamps_ns.is_empty() && count.is_multiple_of(stamps_ns.len()) =>
            {
                let each = count / stamps_ns.len();
                Ok(stamps_ns
                    .iter()
                    .flat_map(|first_ns| (0..each).map(|k| after(*first_ns, k, *hz)))
                    .collect())
            }
            Self::Stamps { stamps_ns, .. } => {
                Err(LogProblem::StampsDiffer { stamps: stamps_ns.len(), profiles: count })
            }
        }
    }
}

/// Reads profiles of a format.
///
/// # Errors
/// A file that is not in that format.
pub fn read(
    file: &Path,
    bytes: Vec<u8>,
    format: ProfileFormat,
    columns: Option<EvenColumns>,
) -> Result<Raw, Error> {
    if ProfileFormat::recognised(&bytes).is_some_and(|shown| shown != format) {
        expect_none(file, &bytes)?;
    }
    let raw = match format {
        ProfileFormat::Gocator => gocator::read(file, bytes)?.into(),
        ProfileFormat::KeyenceLjV => keyence::read_columns(file, bytes)?.into(),
        ProfileFormat::GoPxl => rows::read_pairs(file, bytes)?.into(),
        ProfileFormat::KeyenceLjX => rows::read(file, bytes, columns, is_lj_x_height)?,
        ProfileFormat::Wenglor => rows::read(file, bytes, columns, |mm| mm != 0.0)?,
        ProfileFormat::Rows => rows::read(file, bytes, columns, |_| true)?,
        ProfileFormat::ScanControl => points::read(file, bytes, |z_mm| z_mm != 0.0)?,
        ProfileFormat::Points => points::read(file, bytes, |_| true)?,
        ProfileFormat::Ply => ply::read(file, &bytes)?.into(),
    };
    if raw.profiles.is_empty() {
        return Err(Error::in_file(file, Problem::NoRows));
    }
    if raw.profiles.iter().all(|profile| profile.points.is_empty()) {
        return Err(Error::in_file(file, Problem::NoPoints { profiles: raw.profiles.len() }));
    }
    Ok(raw)
}

/// Error for profiles, and for a surface, in place of a table or of profiles in another format.
///
/// # Errors
/// A file of Gocator, or PLY.
pub(crate) fn expect_none(file: &Path, bytes: &[u8]) -> Result<(), Error> {
    let Some(format) = ProfileFormat::recognised(bytes) else { return Ok(()) };
    if format == ProfileFormat::Gocator {
        gocator::read(file, bytes.to_vec())?;
    }
    let what = match format {
        ProfileFormat::Gocator => "a file of profiles by Gocator",
        _ => "a file of profiles or points in PLY",
    };
    let hint = "give it as --profiles FILE, without --profile-format: its format is recognised";
    Err(Error::unreadable(file, what, hint))
}

/// Whether a value is a height, mm: none is −99.9999, −9999.9999 or −99999.9999. The largest of these sensors sees half a metre to either side.
fn is_lj_x_height(mm: f64) -> bool {
    // Four decimals are written; heights around the first of these numbers are as good as any.
    const HALF_A_DECIMAL_MM: f64 = 0.5e-4;
    (mm + 99.9999).abs() >= HALF_A_DECIMAL_MM && mm > -999.0
}

/// Part of the values of a file that is no point, in words, if any.
#[must_use]
pub fn left_out_words(profiles: &[RawProfile]) -> Option<String> {
    let left_out: usize = profiles.iter().map(|profile| profile.left_out).sum();
    let points: usize = profiles.iter().map(|profile| profile.points.len()).sum();
    let empty = profiles.iter().filter(|profile| profile.points.is_empty()).count();
    let share = 100.0 * left_out as f64 / (left_out + points).max(1) as f64;
    let words = format!("{left_out} of {} values ({share:.1} %) are not points", left_out + points);
    (left_out > 0).then(|| if empty > 0 { format!("{words}; {empty} profiles have none") } else { words })
}

/// Gives each profile its stamp: the file's own, or the timing's.
///
/// # Errors
/// No stamps at all, stamps that run backwards, or not one for each profile.
pub fn stamped(file: &Path, raw: Vec<RawProfile>, timing: Option<&Timing>) -> Result<Vec<Profile>, Error> {
    let given = timing.map(|timing| timing.stamps_ns(raw.len())).transpose();
    let given = given.map_err(|problem| Error::in_file(file, problem.into()))?;
    let mut profiles: Vec<Profile> = Vec::with_capacity(raw.len());
    for (index, profile) in raw.into_iter().enumerate() {
        let stamp_ns = given.as_ref().map_or(profile.stamp_ns, |stamps_ns| Some(stamps_ns[index]));
        let stamp_ns = stamp_ns.ok_or_else(|| Error::in_file(file, Problem::NoProfileTimes))?;
        if !stamp::is_in_range(stamp_ns) {
            let text = format!("{} s", stamp::seconds(stamp_ns));
            return Err(Error::in_file(file, Problem::NotAStamp { text }));
        }
        if let Some(last) = profiles.last()
            && stamp_ns < last.stamp_ns
        {
            let (previous_s, this_s) = (stamp::seconds(last.stamp_ns), stamp::seconds(stamp_ns));
            return Err(Error::in_file(file, Problem::TimeRunsBackwards { previous_s, this_s }));
        }
        profiles.push(Profile {
            stamp_ns,
            frame: profile.frame.or(Some(index as u64)),
            points: profile.points,
        });
    }
    Ok(profiles)
}
