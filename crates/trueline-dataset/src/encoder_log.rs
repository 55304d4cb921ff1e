//! `encoder.csv`: counts of an encoder over the robot's time, `time_s,encoder`. Readings triggered by an encoder have its count
//! instead of a stamp: the column `encoder` of `features.csv`, `profiles.csv` or `stripes.csv`.
//!
//! The time of a reading is the moment at which its count was first reached. So the encoder may stand before and after the pass,
//! but must not turn back within it.

use crate::dialect::plain_csv;
use crate::error::{Error, Problem};
use crate::hash::sha256;
use crate::source_file;
use crate::stamp;
use crate::table::{ColumnSpec, Table, required};
use crate::unit::Quantity;
use std::collections::BTreeMap;
use std::path::Path;

/// Its name in a dataset folder.
pub(crate) const FILE: &str = "encoder.csv";
/// The column of counts.
pub(crate) const COLUMN: &str = "encoder";

const TIME: usize = 0;
const COUNT: usize = 1;
const COLUMNS: [ColumnSpec<'static>; 2] =
    [required("time", Quantity::Time), required(COLUMN, Quantity::Plain)];
/// Largest jitter of a standing encoder, counts.
const TREMBLES: f64 = 2.0;

/// An encoder's counts over time.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct EncoderLog {
    /// Stamp, ns, and count in the direction of the pass; both increase.
    reached: Vec<(i64, f64)>,
    /// 1 of an encoder that counts up, −1 of one that counts down.
    sign: f64,
}

impl EncoderLog {
    /// The log of a dataset folder, with its hash noted; `None` if it has none.
    ///
    /// # Errors
    /// A table that cannot be used, or an encoder that does not move or turns back.
    pub(crate) fn of(folder: &Path, inputs: &mut BTreeMap<String, String>) -> Result<Option<Self>, Error> {
        let file = folder.join(FILE);
        let Some(bytes) = source_file::bytes_if_there(&file)? else { return Ok(None) };
        inputs.insert(FILE.to_owned(), sha256(&bytes));
        let (csv, _) = plain_csv(&file, bytes, None)?;
        Self::read(&file, &csv).map(Some)
    }

    fn read(file: &Path, csv: &[u8]) -> Result<Self, Error> {
        let mut table = Table::open(file, csv, &COLUMNS)?;
        let mut rows: Vec<(i64, f64)> = Vec::new();
        while table.next_row()? {
            let (stamp_ns, count) = (table.stamp_ns(TIME)?, table.required_number(COUNT)?);
            if let Some((last_ns, _)) = rows.last().filter(|(last_ns, _)| stamp_ns <= *last_ns) {
                let (previous_s, this_s) = (stamp::seconds(*last_ns), stamp::seconds(stamp_ns));
                return Err(table.error_in(TIME, Problem::TimeRunsBackwards { previous_s, this_s }));
            }
            rows.push((stamp_ns, count));
        }
        let [Some((_, first)), Some((_, last))] = [rows.first(), rows.last()] else {
            return Err(Error::in_file(file, Problem::NoRows));
        };
        let sign = (last - first).signum();
        if last == first {
            return Err(Error::in_file(file, value("an encoder that moves", *first)));
        }
        let mut reached: Vec<(i64, f64)> = Vec::with_capacity(rows.len());
        for (row, (stamp_ns, count)) in rows.into_iter().enumerate() {
            let furthest = reached.last().map_or(f64::NEG_INFINITY, |(_, furthest)| *furthest);
            if sign * count < furthest - TREMBLES {
                return Err(turned_back(file, csv, row, count)?);
            }
            reached.push((stamp_ns, furthest.max(sign * count)));
        }
        Ok(Self { reached, sign })
    }

    /// The moment at which a count was first reached, ns; `None` beyond the log.
    pub(crate) fn stamp_ns(&self, count: f64) -> Option<i64> {
        let count = self.sign * count;
        let next = self.reached.partition_point(|(_, reached)| *reached < count);
        let (to_ns, to) = *self.reached.get(next)?;
        if to == count {
            return Some(to_ns);
        }
        let (from_ns, from) = *self.reached.get(next.checked_sub(1)?)?;
        let part = (count - from) / (to - from);
        Some(from_ns + ((to_ns - from_ns) as f64 * part).round() as i64)
    }

    /// Its range of counts, for messages.
    pub(crate) fn range(&self) -> String {
        let of = |at: Option<&(i64, f64)>| at.map_or(0.0, |(_, count)| self.sign * count);
        format!("a count from {} to {}", of(self.reached.first()), of(self.reached.last()))
    }
}

/// The error at the row where an encoder turns back.
fn turned_back(file: &Path, csv: &[u8], row: usize, count: f64) -> Result<Error, Error> {
    let mut table = Table::open(file, csv, &COLUMNS)?;
    for _ in 0..=row {
        table.next_row()?;
    }
    Ok(table.error_in(COUNT, value("counts in one direction, with each pass as a scan of its own", count)))
}

fn value(expected: &'static str, found: f64) -> Problem {
    Problem::Value { key: COLUMN, expected, found: found.to_string() }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    fn log(rows: &str) -> Result<EncoderLog, Error> {
        EncoderLog::read(Path::new(FILE), format!("time_s,encoder\n{rows}").as_bytes())
    }

    #[test]
    fn a_count_belongs_to_the_moment_when_it_was_first_reached() {
        // The encoder stands and jitters until 1 s, counts up to 100, and stands.
        let up = log("0,0\n0.5,1\n1,0\n2,100\n3,100\n").unwrap();
        assert_eq!(up.stamp_ns(50.5), Some(1_500_000_000));
        assert_eq!((up.stamp_ns(100.0), up.stamp_ns(0.0)), (Some(2_000_000_000), Some(0)));
        assert_eq!((up.stamp_ns(100.5), up.stamp_ns(-0.5)), (None, None));
        let down = log("0,100\n1,0\n").unwrap();
        assert_eq!((down.stamp_ns(75.0), down.stamp_ns(100.0)), (Some(250_000_000), Some(0)));
        assert_eq!(down.range(), "a count from 100 to 0");
    }

    #[test]
    fn an_encoder_that_turns_back_or_stands_is_refused_with_its_line() {
        let back = log("0,0\n1,50\n2,40\n3,100\n").unwrap_err();
        assert_eq!(back.line, Some(4), "{back}");
        assert!(log("0,5\n1,5\n").unwrap_err().to_string().contains("moves"));
        assert_eq!(log("0,0\n0,5\n").unwrap_err().line, Some(3));
    }
}
