//! `poses.csv` of a dataset folder: one pose of the robot for each stop. Readings name their stop, or their picture is named there;
//! inside, stop number k has the stamp k + 1 s, which only pairs it with its readings.

use crate::dialect::{plain_file, quoted};
use crate::encoder_log::{self, EncoderFile, EncoderLog};
use crate::error::{Error, Problem};
use crate::hash::sha256;
use crate::picture_poses_csv::{self, PicturePose, is_same};
use crate::recording::RobotSample;
use crate::table::{ColumnSpec, Header, Table, required};
use crate::unit::Quantity;
use crate::{source_file, stamp};
use std::collections::BTreeSet;
use std::path::{Component, Path, PathBuf};

/// Its name in a dataset folder.
pub const FILE: &str = "poses.csv";

/// Stamps of stops are so far apart, ns.
const APART_NS: i64 = 1_000_000_000;

/// The stops of a dataset.
#[derive(Clone, Debug, PartialEq)]
pub struct StopPoses {
    file: PathBuf,
    /// The table's name for its stops: `stop` or `picture`.
    column: &'static str,
    poses: Vec<PicturePose>,
    /// SHA-256 of the file.
    pub sha256: String,
}

impl StopPoses {
    /// The stops of a dataset folder; `None` if it has no such file.
    ///
    /// # Errors
    /// A table that is broken or empty, or names a stop twice.
    pub fn of(dataset: &Path) -> Result<Option<Self>, Error> {
        let file = dataset.join(FILE);
        let Some(bytes) = source_file::bytes_if_there(&file)? else { return Ok(None) };
        let plain = plain_file(&file)?;
        Ok(Some(Self { sha256: sha256(&bytes), ..Self::of_table(&file, &plain)? }))
    }

    /// The stops of a table in plain CSV.
    ///
    /// # Errors
    /// As [`StopPoses::of`].
    pub(crate) fn of_table(file: &Path, plain: &[u8]) -> Result<Self, Error> {
        let poses = picture_poses_csv::read(file, plain)?;
        let column = picture_poses_csv::column(Header::read(file, plain)?.names());
        Ok(Self { column, poses, sha256: sha256(plain), file: file.to_owned() })
    }

    /// The robot: a pose at the stamp of each stop.
    #[must_use]
    pub fn robot(&self) -> Vec<RobotSample> {
        let sample = |(number, pose): (usize, &PicturePose)| RobotSample {
            stamp_ns: stamp_of(number),
            device_ns: None,
            base_from_tool: pose.base_from_tool,
        };
        self.poses.iter().enumerate().map(sample).collect()
    }

    /// Stamp and picture of each stop; pictures lie in the dataset's folder or in its `images`. `None` if stops are not
    /// pictures.
    ///
    /// # Errors
    /// A name that leads elsewhere, or to no picture.
    pub(crate) fn pictures(&self) -> Result<Option<Vec<(i64, PathBuf)>>, Error> {
        if self.column != picture_poses_csv::PICTURE_COLUMN {
            return Ok(None);
        }
        let folder = self.file.parent().unwrap_or_else(|| Path::new(""));
        let is_there = |pose: &PicturePose| {
            [folder.to_owned(), folder.join("images")].iter().any(|place| place.join(&pose.picture).is_file())
        };
        if folder.join("features.csv").exists() && !self.poses.iter().any(is_there) {
            // The seam is known without them.
            return Ok(None);
        }
        let frame = |(number, pose): (usize, &PicturePose)| {
            let name = Path::new(&pose.picture);
            let inside = name.components().all(|part| matches!(part, Component::Normal(_)));
            let mut places = [folder.join(name), folder.join("images").join(name)].into_iter();
            let path = places.find(|path| inside && path.is_file());
            let missing = || self.error(pose, "a picture beside this table, or in images/");
            Ok((stamp_of(number), path.ok_or_else(missing)?))
        };
        self.poses.iter().enumerate().map(frame).collect::<Result<_, Error>>().map(Some)
    }

    /// The lines of the table with stops without a reading.
    pub(crate) fn unread_lines(&self, stamps_ns: &BTreeSet<i64>) -> BTreeSet<u64> {
        let unread =
            self.poses.iter().enumerate().filter(|(number, _)| !stamps_ns.contains(&stamp_of(*number)));
        unread.map(|(_, pose)| pose.line).collect()
    }

    /// Refuses a stop at which nothing was read.
    ///
    /// # Errors
    /// The first such stop.
    pub(crate) fn check_each_is_read(&self, stamps_ns: &BTreeSet<i64>) -> Result<(), Error> {
        let mut unread = self.poses.iter().enumerate();
        match unread.find(|(number, _)| !stamps_ns.contains(&stamp_of(*number))) {
            Some((_, pose)) => Err(self.error(pose, "a stop that has a reading")),
            None => Ok(()),
        }
    }

    /// Refuses a table that has not one row for each stop, by the stamps of its rows (rising, ns).
    ///
    /// # Errors
    /// The first stop without a row, or with two.
    pub(crate) fn check_each_has_one(
        &self,
        file: &Path,
        stamps_ns: impl Iterator<Item = i64>,
    ) -> Result<(), Error> {
        let mut count = vec![0_usize; self.poses.len()];
        for stamp_ns in stamps_ns {
            let number = usize::try_from(stamp_ns / APART_NS - 1).ok();
            if let Some(count) = number.and_then(|number| count.get_mut(number)) {
                *count += 1;
            }
        }
        match self.poses.iter().zip(count).find(|(_, count)| *count != 1) {
            Some((pose, count)) => {
                let found = format!("{count} rows of stop {}", pose.picture);
                let expected = "one row for each stop of poses.csv";
                Err(Error::in_file(file, Problem::Value { key: self.column, expected, found }))
            }
            None => Ok(()),
        }
    }

    fn error(&self, pose: &PicturePose, expected: &'static str) -> Error {
        let problem = Problem::Value { key: self.column, expected, found: pose.picture.clone() };
        Error::at_line(&self.file, pose.line, problem).in_column(self.column)
    }

    /// The stamp of a stop.
    fn stamp_ns(&self, name: &str) -> Option<i64> {
        let is_it = |pose: &PicturePose| is_same(&pose.picture, name);
        self.poses.iter().position(is_it).map(stamp_of)
    }

    /// A table with the stops' stamps, rewritten with their names.
    pub(crate) fn named(&self, csv: &[u8]) -> Vec<u8> {
        let text = String::from_utf8_lossy(csv);
        let mut out = String::new();
        for (row, line) in text.lines().enumerate() {
            let (first, rest) = line.split_once(',').unwrap_or((line, ""));
            let stamp_ns = stamp::parse_nanoseconds(first, 9);
            let number = stamp_ns.and_then(|ns| usize::try_from(ns / APART_NS - 1).ok());
            let name = match number.and_then(|number| self.poses.get(number)) {
                Some(pose) if row > 0 => quoted(&pose.picture).into_owned(),
                _ => self.column.to_owned(),
            };
            out += &format!("{name},{rest}\n");
        }
        out.into_bytes()
    }
}

fn stamp_of(number: usize) -> i64 {
    (number as i64 + 1) * APART_NS
}

/// Pairs the readings of a dataset with its robot, besides stamps.
#[derive(Clone, Copy, Default)]
pub(crate) struct Pairing<'a> {
    /// The stops of a robot that stood at each reading.
    pub stops: Option<&'a StopPoses>,
    /// The encoder that triggered them.
    pub encoder: Option<&'a EncoderFile>,
}

impl<'a> From<Option<&'a StopPoses>> for Pairing<'a> {
    fn from(stops: Option<&'a StopPoses>) -> Self {
        Self { stops, encoder: None }
    }
}

/// Key that pairs the rows of a table with the robot.
#[derive(Clone, Copy)]
pub(crate) enum RowKey<'a> {
    /// Their stamp.
    Stamp,
    /// The count of an encoder, which was first reached at their stamp.
    Encoder(&'a EncoderLog),
    /// The name of their stop, in this column.
    Stop { stops: &'a StopPoses, column: &'static str },
}

impl<'a> RowKey<'a> {
    /// The key of a table, by its header.
    ///
    /// # Errors
    /// Rows that name stops without poses, and rows that name none where only stops have poses; counts of an encoder without its log.
    pub(crate) fn of(header: &Header<'_>, pairing: impl Into<Pairing<'a>>) -> Result<Self, Error> {
        let Pairing { stops, encoder } = pairing.into();
        if header.names().iter().any(|name| name == encoder_log::COLUMN) {
            let expected = "encoder.csv beside robot.csv, with time_s,encoder, and no poses.csv";
            let found = "no such pair".to_owned();
            let problem = Problem::Value { key: encoder_log::COLUMN, expected, found };
            let file = encoder.filter(|_| stops.is_none());
            let file = file.ok_or_else(|| header.error(problem).in_column(encoder_log::COLUMN))?;
            return file.log().map(Self::Encoder);
        }
        let named = picture_poses_csv::COLUMNS_OF_NAMES
            .into_iter()
            .find(|column| header.names().iter().any(|name| name == column));
        match (stops, named) {
            (None, None) => Ok(Self::Stamp),
            (Some(stops), Some(column)) => Ok(Self::Stop { stops, column }),
            (None, Some(column)) => {
                let expected = "poses.csv beside this table, with a pose for each stop";
                let problem = Problem::Value { key: column, expected, found: "no such file".to_owned() };
                Err(header.error(problem).in_column(column))
            }
            (Some(stops), None) => {
                let expected = "a column that names the stop of each row, for poses.csv has the poses";
                let found = header.names().join(", ");
                Err(header.error(Problem::Value { key: stops.column, expected, found }))
            }
        }
    }

    /// Whether it does not fall from one row to the next.
    pub(crate) fn rises(self) -> bool {
        matches!(self, Self::Stamp | Self::Encoder(_))
    }

    /// The column that it is in.
    pub(crate) fn spec(self) -> ColumnSpec<'static> {
        match self {
            Self::Stamp => required("time", Quantity::Time),
            Self::Encoder(_) => required(encoder_log::COLUMN, Quantity::Plain),
            Self::Stop { column, .. } => required(column, Quantity::Text),
        }
    }

    /// The stamp of a table's row; stamps do not fall from one row to the next, and stops come in any order.
    pub(crate) fn stamp_ns(
        self,
        table: &Table<'_>,
        column: usize,
        last_ns: Option<i64>,
    ) -> Result<i64, Error> {
        if let Self::Stop { stops, column: key } = self {
            let name = table.text(column).unwrap_or_default();
            let unknown = || {
                let expected = "a stop of poses.csv";
                table.error_in(column, Problem::Value { key, expected, found: name.to_owned() })
            };
            return stops.stamp_ns(name).ok_or_else(unknown);
        }
        if let Self::Encoder(log) = self {
            return counted_ns(log, table, column, last_ns);
        }
        let stamp_ns = table.stamp_ns(column)?;
        match last_ns {
            Some(last_ns) if stamp_ns < last_ns => {
                let (previous_s, this_s) = (stamp::seconds(last_ns), stamp::seconds(stamp_ns));
                Err(table.error_in(column, Problem::TimeRunsBackwards { previous_s, this_s }))
            }
            _ => Ok(stamp_ns),
        }
    }
}

/// The stamp of a row with an encoder's count, ns; it does not fall from one row to the next.
fn counted_ns(
    log: &EncoderLog,
    table: &Table<'_>,
    column: usize,
    last_ns: Option<i64>,
) -> Result<i64, Error> {
    let count = table.required_number(column)?;
    let stamps_ns = log.stamps_ns(count);
    let error = |expected: &'static str, found: String| {
        Err(table.error_in(column, Problem::Value { key: encoder_log::COLUMN, expected, found }))
    };
    match (&stamps_ns[..], last_ns) {
        ([], _) => error("a count within encoder.csv", format!("{count}; encoder.csv has {}", log.range())),
        ([stamp_ns], None) => Ok(*stamp_ns),
        (several, None) => error(
            "a first count that encoder.csv has once: leave out its rows before and after the scan",
            format!("{count}, which the counter shows {} times", several.len()),
        ),
        (all, Some(last_ns)) => match all.iter().find(|stamp_ns| **stamp_ns >= last_ns) {
            Some(stamp_ns) => Ok(*stamp_ns),
            None => error(
                "counts in the order in which encoder.csv has them",
                format!("{count}, which encoder.csv has before the count of the row above"),
            ),
        },
    }
}
