//! `encoder.csv`: counts of an encoder over the robot's time, `time_s,encoder`. Readings triggered by an encoder have its count
//! instead of a stamp: the column `encoder` of `features.csv`, `profiles.csv`, `stripes.csv` or `sightings.csv`.
//!
//! The time of a reading is the moment at which its count was first reached. So the encoder may stand before and after the pass,
//! but must not turn back within it. A counter of 16 or 32 bit may wrap.

use crate::dialect::plain_csv;
use crate::error::{Error, Problem};
use crate::hash::sha256;
use crate::source_file;
use crate::stamp;
use crate::table::{ColumnSpec, Table, required};
use crate::unit::Quantity;
use crate::wrapping_count::Wrap;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

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

/// `encoder.csv` of a folder. It is read once a table has counts.
#[derive(Debug)]
pub(crate) struct EncoderFile {
    file: PathBuf,
    /// The log and the file's hash.
    read: OnceLock<(EncoderLog, String)>,
}

impl EncoderFile {
    /// That of a folder; `None` if it has none.
    pub(crate) fn of(folder: &Path) -> Option<Self> {
        let file = folder.join(FILE);
        file.exists().then(|| Self { file, read: OnceLock::new() })
    }

    /// The counts.
    ///
    /// # Errors
    /// A table that cannot be used, or an encoder that does not move or turns back.
    pub(crate) fn log(&self) -> Result<&EncoderLog, Error> {
        if let Some((log, _)) = self.read.get() {
            return Ok(log);
        }
        let bytes = source_file::bytes_if_there(&self.file)?
            .ok_or_else(|| Error::in_file(&self.file, Problem::Missing))?;
        let hash = sha256(&bytes);
        let (csv, _) = plain_csv(&self.file, bytes, None)?;
        let log = EncoderLog::read(&self.file, &csv)?;
        Ok(&self.read.get_or_init(|| (log, hash)).0)
    }

    /// Notes its hash among the inputs if a table has counts; else returns the remark that it is ignored.
    pub(crate) fn noted(&self, inputs: &mut BTreeMap<String, String>) -> Option<String> {
        match self.read.get() {
            Some((_, hash)) => {
                inputs.insert(FILE.to_owned(), hash.clone());
                None
            }
            None => Some(format!("{} is ignored: no reading has a column {COLUMN}", self.file.display())),
        }
    }
}

/// An encoder's counts over time.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct EncoderLog {
    /// Stamp, ns, and count in the direction of the pass; both increase.
    reached: Vec<(i64, f64)>,
    /// 1 of an encoder that counts up, −1 of one that counts down.
    sign: f64,
    /// How its counter wraps; `None` if it did not within the log.
    wrap: Option<Wrap>,
}

impl EncoderLog {
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
        let wrap = Wrap::of(&mut rows);
        let [Some((_, first)), Some((_, last))] = [rows.first(), rows.last()] else {
            return Err(Error::in_file(file, Problem::NoRows));
        };
        if last == first {
            return Err(Error::in_file(file, value("an encoder that moves", *first)));
        }
        let sign = direction(&rows).unwrap_or((last - first).signum());
        let mut reached: Vec<(i64, f64)> = Vec::with_capacity(rows.len());
        for (row, (stamp_ns, count)) in rows.into_iter().enumerate() {
            let furthest = reached.last().map_or(f64::NEG_INFINITY, |(_, furthest)| *furthest);
            if sign * count < furthest - TREMBLES {
                return Err(turned_back(file, csv, row, count)?);
            }
            reached.push((stamp_ns, furthest.max(sign * count)));
        }
        Ok(Self { reached, sign, wrap })
    }

    /// The moments at which a count was first reached, rising, ns: none beyond the log, several of a counter that wraps.
    pub(crate) fn stamps_ns(&self, count: f64) -> Vec<i64> {
        let (Some(wrap), Some((_, from)), Some((_, to))) =
            (self.wrap, self.reached.first(), self.reached.last())
        else {
            return self.reached_ns(count).into_iter().collect();
        };
        let turns = wrap.turns(count, [self.sign * from, self.sign * to]);
        let mut stamps_ns: Vec<i64> = turns.filter_map(|count| self.reached_ns(count)).collect();
        stamps_ns.sort_unstable();
        stamps_ns
    }

    /// The moment at which a count that does not wrap was first reached, ns.
    fn reached_ns(&self, count: f64) -> Option<i64> {
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
        let wraps = if self.wrap.is_some() { ", and wraps" } else { "" };
        format!("a count from {} to {}{wraps}", of(self.reached.first()), of(self.reached.last()))
    }
}

/// The direction of most steps: a counter that is set back is behind its beginning, and still counts up. `None` if no direction has more steps.
fn direction(rows: &[(i64, f64)]) -> Option<f64> {
    let steps = rows.iter().zip(&rows[1..]).map(|((_, from), (_, to))| to - from);
    let votes: f64 = steps.filter(|step| step.abs() > TREMBLES).map(f64::signum).sum();
    (votes != 0.0).then(|| votes.signum())
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
        assert_eq!(up.reached_ns(50.5), Some(1_500_000_000));
        assert_eq!((up.reached_ns(100.0), up.reached_ns(0.0)), (Some(2_000_000_000), Some(0)));
        assert_eq!((up.reached_ns(100.5), up.reached_ns(-0.5)), (None, None));
        let down = log("0,100\n1,0\n").unwrap();
        assert_eq!((down.reached_ns(75.0), down.reached_ns(100.0)), (Some(250_000_000), Some(0)));
        assert_eq!(down.range(), "a count from 100 to 0");
    }

    /// Every half second 20 000 counts, by a counter that wraps after `modulus` counts from `least`.
    fn wrapped(first: f64, step: f64, (least, modulus): (f64, f64)) -> (EncoderLog, impl Fn(f64) -> f64) {
        let shown = move |count: f64| least + (count - least).rem_euclid(modulus);
        let row = |k: i32| format!("{},{}\n", 0.5 * f64::from(k), shown(first + step * f64::from(k)));
        (log(&(0..12).map(row).collect::<String>()).unwrap(), shown)
    }

    #[test]
    fn a_counter_that_wraps_goes_on() {
        let bits = f64::from(1 << 16);
        for (first, step, range) in [
            (60_000.0, 20_000.0, (0.0, bits)),
            (1_000.0, -20_000.0, (0.0, bits)),
            (30_000.0, 20_000.0, (-bits / 2.0, bits)),
            (-30_000.0, -20_000.0, (-bits / 2.0, bits)),
            (4_294_960_000.0, 20_000.0, (0.0, bits * bits)),
        ] {
            let (log, shown) = wrapped(first, step, range);
            // Readings 4000 counts apart. A counter of 16 bit shows each count three or four times.
            for k in 0..=55 {
                let stamps_ns = log.stamps_ns(shown(first + 0.2 * step * f64::from(k)));
                assert!(stamps_ns.contains(&(i64::from(k) * 100_000_000)), "{first} {step}: {k}");
                assert_eq!(stamps_ns.len() > 1, range.1 == bits, "{first} {step}: {k}");
                assert!(stamps_ns.is_sorted());
            }
        }
    }

    #[test]
    fn a_counter_that_is_set_back_does_not_wrap() {
        // It counts 100 a row, and 40 000 are missing to the end of 16 bit.
        let set_back = log("0,25300\n1,25400\n2,25500\n3,0\n4,100\n").unwrap_err();
        assert_eq!(set_back.line, Some(5), "{set_back}");
        // The whole of 16 bit is passed, and half of the next is missing.
        assert!(log("0,65300\n1,65400\n2,30000\n3,30100\n").is_err());
    }

    #[test]
    fn an_encoder_that_turns_back_or_stands_is_refused_with_its_line() {
        let back = log("0,0\n1,50\n2,40\n3,100\n").unwrap_err();
        assert_eq!(back.line, Some(4), "{back}");
        assert!(log("0,5\n1,5\n").unwrap_err().to_string().contains("moves"));
        assert_eq!(log("0,0\n0,5\n").unwrap_err().line, Some(3));
    }
}
