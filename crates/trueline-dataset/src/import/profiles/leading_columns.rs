//! Columns before the heights of a row: a counter, a time, an encoder.

use super::numbers::NumberTable;
use crate::error::Problem;
use crate::header_unit::{HeaderUnit, is_time_name, stem_and_unit};
use crate::import::clock::{Clock, ClockReader, unit_of_steps};
use crate::moment;

/// Fewest rows that show a counter.
const FEWEST_ROWS: usize = 3;

/// Names of columns that count profiles, in lower case.
const COUNTERS: [&str; 13] = [
    "no",
    "no.",
    "nr",
    "nr.",
    "number",
    "counter",
    "count",
    "profile",
    "profile no.",
    "frame",
    "frameindex",
    "trigger count",
    "index",
];
/// Names of columns that are neither a height nor a time nor a counter of profiles.
const OTHERS: [&str; 4] = ["encoder", "encoder count", "judgment", "judge"];

/// The columns before the heights, row by row.
#[derive(Default)]
pub(super) struct LeadingColumns {
    frames: Vec<Option<u64>>,
    times: Vec<String>,
    reader: Option<ClockReader>,
    /// Nanoseconds of a unit of `times`, where these are numbers.
    unit_ns: f64,
    notes: Vec<String>,
}

impl LeadingColumns {
    /// Takes the columns off a table: those with a name in words, and a first one of whole numbers that rise from row to
    /// row.
    pub(super) fn taken_off(table: &mut NumberTable) -> Self {
        let mut lead = Self::default();
        while let Some(kind) = lead.kind_of_first(table) {
            lead.take(kind, table);
        }
        lead
    }

    fn kind_of_first(&self, table: &NumberTable) -> Option<Kind> {
        let width = table.rows[0].1.len();
        if width < 3 {
            return None;
        }
        let named =
            table.header.as_ref().filter(|header| header.len() == width).map(|header| header[0].as_str());
        let first = || table.rows.iter().map(|(_, row)| row[0]);
        let first_word = table.words_of(0).next().unwrap_or_default();
        if self.times.is_empty() && ClockReader::of(first_word).is_some() {
            return Some(Kind::Clock);
        }
        // The times of day beside it go on after midnight.
        if moment::is_day(first_word) {
            return Some(Kind::Other);
        }
        if let Some(name) = named {
            let (stem, unit) = stem_and_unit(name);
            match unit {
                HeaderUnit::Known(unit) if is_time_name(&stem) && unit.ends_with('s') => {
                    return Some(Kind::Time(unit));
                }
                HeaderUnit::Absent if stem == "t" => return Some(Kind::Time("_s")),
                HeaderUnit::Absent if is_time_name(&stem) => {
                    let cells: Vec<&str> = table.words_of(0).take(50).collect();
                    return Some(unit_of_steps(&cells).map_or(Kind::Other, |(unit, _)| Kind::Time(unit)));
                }
                _ if COUNTERS.contains(&stem.as_str()) => return Some(Kind::Counter),
                _ if OTHERS.contains(&stem.as_str()) => return Some(Kind::Other),
                _ => {}
            }
        }
        let whole: Option<Vec<f64>> =
            first().map(|value| value.filter(|v| v.fract() == 0.0 && *v >= 0.0)).collect();
        let counts =
            whole.filter(|rows| rows.len() >= FEWEST_ROWS && rows.windows(2).all(|two| two[1] > two[0]));
        (counts.is_some() && self.frames.is_empty()).then_some(Kind::Counter)
    }

    fn take(&mut self, kind: Kind, table: &mut NumberTable) {
        let name = table
            .header
            .as_ref()
            .filter(|header| header.len() == table.rows[0].1.len())
            .map(|h| h[0].clone());
        let named = name.filter(|name| !name.is_empty()).map(|name| format!(" `{name}`")).unwrap_or_default();
        let values: Vec<Option<f64>> = table.rows.iter_mut().map(|(_, row)| row.remove(0)).collect();
        let said = match kind {
            Kind::Counter => {
                self.frames = values.iter().map(|value| value.map(|frame| frame as u64)).collect();
                let lost = lost(&self.frames);
                let lost =
                    if lost > 0 { format!("; {lost} profiles are missing in it") } else { String::new() };
                format!("the first column{named} counts the profiles and is not a height{lost}")
            }
            Kind::Clock => {
                self.times = table.words_of(0).map(str::to_owned).collect();
                self.reader = self.times.first().and_then(|cell| ClockReader::of(cell));
                format!("the first column{named} has clock times")
            }
            Kind::Time(unit) => {
                self.unit_ns = match unit {
                    "_ns" => 1.0,
                    "_us" => 1e3,
                    "_ms" => 1e6,
                    _ => 1e9,
                };
                self.times = table.words_of(0).map(str::to_owned).collect();
                format!("the first column{named} is the time, in {}", &unit[1..])
            }
            Kind::Other => format!("the first column{named} is not used"),
        };
        self.notes.push(said);
        if let Some(header) = &mut table.header
            && header.len() > table.rows[0].1.len()
        {
            header.remove(0);
        }
        table.words.iter_mut().filter(|words| !words.is_empty()).for_each(|words| drop(words.remove(0)));
    }

    /// The number of a row.
    pub(super) fn frame(&self, row: usize) -> Option<u64> {
        self.frames.get(row).copied().flatten()
    }

    /// The stamp of a row, ns.
    ///
    /// # Errors
    /// An invalid time.
    pub(super) fn stamp_ns(&mut self, row: usize) -> Result<Option<i64>, Problem> {
        let Some(cell) = self.times.get(row) else { return Ok(None) };
        match &mut self.reader {
            Some(reader) => reader.ns(cell).map(Some),
            None => {
                let digits = self.unit_ns.log10().round() as usize;
                let stamp_ns = crate::stamp::parse_nanoseconds(cell, digits);
                stamp_ns.map(Some).ok_or_else(|| crate::stamp::problem_of(cell))
            }
        }
    }

    pub(super) fn clock(&self) -> Clock {
        self.reader.as_ref().map_or(Clock::Seconds, ClockReader::clock)
    }

    pub(super) fn notes(self) -> Vec<String> {
        self.notes
    }
}

/// Kind of a column before the heights.
enum Kind {
    Counter,
    /// Clock times or dates.
    Clock,
    /// Numbers in a unit.
    Time(&'static str),
    Other,
}

/// How many numbers are left out between the first and the last.
fn lost(frames: &[Option<u64>]) -> u64 {
    let mut known = frames.iter().flatten();
    match (known.next(), known.next_back()) {
        // A counter that wraps or starts anew counts no losses.
        (Some(first), Some(last)) => {
            last.saturating_sub(*first).saturating_add(1).saturating_sub(frames.len() as u64)
        }
        _ => 0,
    }
}
