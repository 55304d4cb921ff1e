//! CSV files of any program as ours: their separators, their decimal sign, their names, their clock.

use super::clock::{Clock, ClockReader, unit_of_steps};
use super::pose_cells;
use super::robot_layout::RobotLayout;
use crate::dialect::{Dialect, Separator, plain_csv_below, quoted};
use crate::error::{Error, Problem};
use crate::header_unit::{is_bare_time, is_in_grad, stem_and_unit, time_column};
use crate::log_problem::LogProblem;
use crate::nearest::nearest;
use crate::stamp::format_seconds;
use crate::table_start::is_value;
use std::path::Path;

/// Which column of the foreign file holds one of ours, for example `x_mm` ← `pos_x`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ColumnMapping {
    /// Our column, with its unit.
    pub ours: String,
    /// Their column.
    pub theirs: String,
}

/// How our name of a column of an external axis begins while its unit is not known.
pub(super) const OF_AXIS: &str = "axis ";

/// How the names of a foreign table become ours. A column without a new name keeps its name. An unknown name is left out.
pub struct Renaming<'a> {
    /// The user's names.
    pub map: &'a [ColumnMapping],
    /// The robot's maker, for columns that the user did not name.
    pub layout: Option<&'a RobotLayout>,
    /// Whether a name is one of ours.
    pub is_ours: &'a dyn Fn(&str) -> bool,
}

/// Properties that a file does not state.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TableForm {
    /// The separator of columns; recognised if not stated.
    pub separator: Option<Separator>,
    /// Lines at its beginning before the table.
    pub skipped_lines: usize,
    /// The names of its columns, in place of its own; `-` or `_` is not used.
    pub columns: Vec<String>,
    /// Rows per second and the stamp of the first one, s, in place of a column of time.
    pub rate: Option<Rate>,
}

/// Rows at a steady rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rate {
    /// Rows a second.
    pub hz: f64,
    /// Stamp of the first one, s.
    pub start_s: f64,
}

/// A foreign table with our names, and remarks on it.
#[derive(Clone, Debug)]
pub struct ForeignTable {
    /// CSV text with our header; rows keep their line numbers, but for `added_lines`.
    pub csv: Vec<u8>,
    /// How it was written.
    pub dialect: Dialect,
    /// Their header.
    pub header: Vec<String>,
    /// Columns with unknown names.
    pub left_out: Vec<String>,
    /// Most decimals of an angle in degrees, if there are angles.
    pub angle_decimals: Option<usize>,
    /// Origin of its times.
    pub clock: Clock,
    /// Lines of the text that the file does not have: one where the user named the columns.
    pub added_lines: u64,
    /// As of [`super::table_text::TableText`].
    pub row_lines: Vec<u64>,
    /// The recognised form of its times, in words.
    pub time_words: Option<String>,
    /// Meaning of its maker's names, in words.
    pub layout_words: Option<String>,
    /// The assumed unit of its header, in words.
    pub unit_words: Option<String>,
}

/// Reads a foreign table. A separator that the user names is used; else it is recognised.
///
/// Lines keep their numbers, so later errors point into the foreign file.
///
/// # Errors
/// A broken table, or a mapping that names a column the file does not have.
pub fn read(
    file: &Path,
    bytes: Vec<u8>,
    form: &TableForm,
    renaming: &Renaming<'_>,
) -> Result<ForeignTable, Error> {
    let (plain, dialect) = plain_csv_below(file, bytes, form.separator, form.skipped_lines)?;
    let has_names = begins_with_names(&plain);
    let plain = pose_cells::expanded(plain, dialect.lines_before, has_names);
    let (plain, added_lines) = with_columns(plain, &dialect, &form.columns, has_names);
    let broken = |error: csv::Error| Error::in_file(file, Problem::Csv(error.to_string()));
    let mut reader =
        csv::ReaderBuilder::new().flexible(true).trim(csv::Trim::All).from_reader(plain.as_slice());
    let header: Vec<String> = reader
        .headers()
        .map_err(broken)?
        .iter()
        .map(|n| n.trim_start_matches('\u{feff}').to_owned())
        .collect();
    let header_line = dialect.lines_before as u64 + 1;
    if !has_names && form.columns.is_empty() && header.iter().any(|name| !name.is_empty()) {
        return Err(Error::at_line(file, header_line, LogProblem::NoNames { columns: header.len() }.into()));
    }
    let records: Vec<csv::StringRecord> = reader.records().collect::<Result<_, _>>().map_err(broken)?;
    let rows_of = records.first().map_or(header.len(), csv::StringRecord::len);
    if !form.columns.is_empty() && rows_of != header.len() {
        let problem = LogProblem::NamesDiffer { named: header.len(), found: rows_of };
        return Err(Error::at_line(file, header_line, problem.into()));
    }
    // Names of a single maker need not be stated.
    let unmistakable = if renaming.is_robot() { RobotLayout::unmistakable(&header) } else { None };
    let renaming = &Renaming { layout: renaming.layout.or(unmistakable.as_ref()), ..*renaming };
    let mut names = renaming.names(file, header_line, &header)?;
    let mut time = TimeColumn::of(&header, &mut names, &records, form.rate);
    let place = Place { file, header_line, added_lines, width: header.len(), csv: &plain };
    let (csv, angle_decimals) = place.written(&records, &names, &mut time)?;
    let left_out = header.iter().zip(&names).filter(|(_, name)| name.is_none());
    let left_out = left_out.map(|(theirs, _)| theirs.clone()).filter(|name| !is_unused(name)).collect();
    let (clock, time_words) = (time.clock(), time.words());
    let layout_words = renaming.layout.map(|layout| layout.words.clone()).filter(|words| !words.is_empty());
    let in_grad = header.iter().zip(&names).any(|(theirs, name)| name.is_some() && is_in_grad(theirs));
    let unit_words = in_grad.then(|| "`Grad` is degrees, 360 to a full turn; gradians are `gon`".to_owned());
    Ok(ForeignTable {
        csv,
        dialect,
        header,
        left_out,
        angle_decimals,
        clock,
        added_lines,
        row_lines: Vec::new(),
        time_words,
        layout_words,
        unit_words,
    })
}

/// Whether the first line that is not empty has a name.
fn begins_with_names(csv: &[u8]) -> bool {
    let text = String::from_utf8_lossy(csv);
    let line = text.trim_start_matches('\u{feff}').lines().find(|line| !line.trim().is_empty());
    let mut reader = csv::ReaderBuilder::new();
    let mut reader = reader
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All)
        .from_reader(line.unwrap_or_default().as_bytes());
    let cells = reader.records().next().and_then(Result::ok).unwrap_or_default();
    cells.iter().any(|cell| !cell.is_empty() && !is_value(cell))
}

/// The table with the user's names in place of its own; and the number of added lines.
fn with_columns(csv: Vec<u8>, dialect: &Dialect, columns: &[String], has_names: bool) -> (Vec<u8>, u64) {
    if columns.is_empty() {
        return (csv, 0);
    }
    let text = String::from_utf8_lossy(&csv).into_owned();
    let text = text.trim_start_matches('\u{feff}');
    let names = columns.iter().map(|name| quoted(name).into_owned()).collect::<Vec<_>>().join(",") + "\n";
    let length: usize =
        text.split_inclusive('\n').take(dialect.lines_before + usize::from(has_names)).map(str::len).sum();
    let rows = &text[length..];
    (("\n".repeat(dialect.lines_before) + &names + rows).into_bytes(), u64::from(!has_names))
}

/// Whether the user marked a column as unused.
fn is_unused(name: &str) -> bool {
    matches!(name, "-" | "_")
}

/// Place of a table.
struct Place<'a> {
    file: &'a Path,
    header_line: u64,
    added_lines: u64,
    width: usize,
    csv: &'a [u8],
}

impl Place<'_> {
    /// The rows under our names, and the most decimals of an angle in degrees.
    fn written(
        &self,
        records: &[csv::StringRecord],
        names: &[Option<String>],
        time: &mut TimeColumn,
    ) -> Result<(Vec<u8>, Option<usize>), Error> {
        let kept: Vec<(usize, &String)> =
            names.iter().enumerate().filter_map(|(k, name)| Some((k, name.as_ref()?))).collect();
        let mut out = "\n".repeat(self.header_line as usize - 1);
        let added = matches!(time, TimeColumn::Rate(_)).then_some("time_s");
        let header: Vec<&str> = added.into_iter().chain(kept.iter().map(|(_, name)| name.as_str())).collect();
        out += &(header.join(",") + "\n");
        let mut line = self.header_line;
        let mut angle_decimals = None;
        for (index, record) in records.iter().enumerate() {
            let at = record.position().map_or(0, |position| pose_cells::line_of_row(self.csv, position));
            let in_file = at.saturating_sub(self.added_lines);
            if record.len() != self.width {
                let problem = Problem::FieldCount { expected: self.width, found: record.len() };
                return Err(Error::at_line(self.file, in_file, problem));
            }
            // Empty lines keep the count.
            while line + 1 < at {
                out.push('\n');
                line += 1;
            }
            line += 1;
            if let TimeColumn::Rate(rate) = time {
                let ns = rate.start_s * 1e9 + index as f64 / rate.hz * 1e9;
                out.push_str(&format_seconds(ns.round() as i64));
                out.push_str(if kept.is_empty() { "" } else { "," });
            }
            for (place, (column, name)) in kept.iter().enumerate() {
                let field = &record[*column];
                if name.ends_with("_deg") {
                    let decimals = field.split_once('.').map_or(0, |(_, fraction)| fraction.len());
                    angle_decimals = angle_decimals.max(Some(decimals));
                }
                out.push_str(if place > 0 { "," } else { "" });
                match time.seconds(*column, field) {
                    None => out.push_str(&quoted(field)),
                    Some(Ok(seconds)) => out.push_str(&seconds),
                    Some(Err(problem)) => {
                        return Err(Error::at_line(self.file, in_file, problem).in_column(name));
                    }
                }
            }
            out.push('\n');
        }
        Ok((out.into_bytes(), angle_decimals))
    }
}

/// Rows used to find the unit of their times.
const LOOKED_AT: usize = 50;

/// The column with the time of a row.
enum TimeColumn {
    /// As its name states, or none.
    Named,
    /// Numbers with a unit found from their steps: the column's own name, and the recognised unit.
    Steps(String),
    /// Clock times or dates in this column.
    Clock(usize, ClockReader),
    /// None: the rows come at a rate.
    Rate(Rate),
}

impl TimeColumn {
    /// Finds the column, and gives it our name.
    fn of(
        header: &[String],
        names: &mut [Option<String>],
        records: &[csv::StringRecord],
        rate: Option<Rate>,
    ) -> Self {
        if let Some(rate) = rate {
            let times = names.iter_mut().filter(|name| name.as_deref().is_some_and(is_our_time));
            times.for_each(|name| *name = None);
            return Self::Rate(rate);
        }
        let named = names.iter().position(|name| name.as_deref().is_some_and(is_our_time));
        let bare = || (0..header.len()).filter(|&k| names[k].is_none() && is_bare_time(&header[k]));
        let cell = |column: usize| records.first().and_then(|row| row.get(column)).unwrap_or_default();
        // Besides a number of seconds, a clock time adds nothing.
        let column = match named {
            Some(column) => Some(column),
            None => bare().find(|&k| ClockReader::of(cell(k)).is_some()).or_else(|| bare().next()),
        };
        let Some(column) = column else { return Self::Named };
        if let Some(reader) = ClockReader::of(cell(column)) {
            names[column] = Some("time_s".to_owned());
            return Self::Clock(column, reader);
        }
        if named.is_some() {
            return Self::Named;
        }
        let first: Vec<&str> = records.iter().take(LOOKED_AT).filter_map(|row| row.get(column)).collect();
        let Some((unit, step_ms)) = unit_of_steps(&first) else { return Self::Named };
        names[column] = Some(format!("time{unit}"));
        let theirs = &header[column];
        let words =
            format!("`{theirs}` has no unit: read in {}, which gives steps of {step_ms:.3} ms", &unit[1..]);
        Self::Steps(words)
    }

    fn clock(&self) -> Clock {
        match self {
            Self::Clock(_, reader) => reader.clock(),
            _ => Clock::Seconds,
        }
    }

    fn words(&self) -> Option<String> {
        match self {
            Self::Named => None,
            Self::Steps(words) => Some(words.clone()),
            Self::Clock(_, reader) => Some(match reader.clock() {
                Clock::Midnight => "times of day, as seconds since midnight".to_owned(),
                Clock::DateUtc => "dates, as seconds since 1970 in UTC".to_owned(),
                _ => "dates without a time zone, as seconds since 1970".to_owned(),
            }),
            Self::Rate(Rate { hz, start_s }) => {
                Some(format!("{hz} rows per second from {start_s} s on, by your statement"))
            }
        }
    }

    /// A cell in seconds, if it is of this column and no number.
    fn seconds(&mut self, column: usize, cell: &str) -> Option<Result<String, Problem>> {
        match self {
            Self::Clock(own, reader) if *own == column => Some(reader.seconds(cell)),
            _ => None,
        }
    }
}

/// Whether our name is that of the time of a row.
fn is_our_time(name: &str) -> bool {
    matches!(name, "time_s" | "time_ms" | "time_us" | "time_ns")
}

impl Renaming<'_> {
    /// Whether the table is a robot's log without a stated maker.
    fn is_robot(&self) -> bool {
        let is_of_axis = |item: &ColumnMapping| item.ours.starts_with(OF_AXIS);
        self.layout.is_none() && (self.is_ours)("qw") && self.map.iter().all(is_of_axis)
    }

    /// Our name of each column, or none.
    fn names(&self, file: &Path, line: u64, header: &[String]) -> Result<Vec<Option<String>>, Error> {
        for item in self.map {
            let meant = header.iter().filter(|theirs| item.means(theirs, header)).count();
            if meant != 1 {
                let problem = LogProblem::MappedColumnMissing {
                    ours: item.ours.clone(),
                    theirs: item.theirs.clone(),
                    reversed: (self.is_ours)(&item.theirs) && header.contains(&item.ours),
                    meant: nearest(&item.theirs, header.iter().map(String::as_str)),
                    found: header.join(", "),
                };
                return Err(Error::at_line(file, line, problem.into()));
            }
        }
        let ours = |theirs: &String| {
            self.ours_in(theirs, header)
                .map_err(|problem| Error::at_line(file, line, problem).in_column(theirs))
        };
        header.iter().map(ours).collect()
    }

    /// Priority of one of their columns: a name from the user counts more than an accidental match with ours.
    #[must_use]
    pub fn weight(&self, theirs: &str) -> usize {
        let named = self.map.iter().any(|item| item.theirs == theirs);
        // A column in an unknown unit is wanted as well: it is refused when it is read.
        if named { 100 } else { usize::from(!matches!(self.ours_in(theirs, &[]), Ok(None))) }
    }

    /// Our name of a column of theirs, or none.
    ///
    /// # Errors
    /// A column with an unknown unit in its header.
    fn ours_in(&self, theirs: &str, header: &[String]) -> Result<Option<String>, Problem> {
        let by_layout = |name: &str| self.layout.map_or(Ok(None), |layout| layout.ours(name));
        if is_unused(theirs) {
            return Ok(None);
        }
        if let Some(item) = self.map.iter().find(|item| item.means(theirs, header)) {
            // A user may state the meaning of a column for a robot, for example `e1_deg`: the layout translates it.
            let name = item.ours.clone();
            if name.starts_with(OF_AXIS) {
                return Ok(Some(name));
            }
            return Ok(Some(if (self.is_ours)(&name) { name } else { by_layout(&name)?.unwrap_or(name) }));
        }
        if let Some(name) = by_layout(theirs)? {
            return Ok(Some(name));
        }
        Ok(if (self.is_ours)(theirs) { Some(theirs.to_owned()) } else { time_column(theirs) })
    }
}

impl ColumnMapping {
    /// Whether a column is meant: by its whole name or, if none has that name, by its name without unit, `Zeit` of `Zeit
    /// [s]`.
    pub(super) fn means(&self, theirs: &str, header: &[String]) -> bool {
        if theirs == self.theirs {
            return true;
        }
        let stem = stem_and_unit(theirs).0;
        !header.contains(&self.theirs)
            && (stem == self.theirs.to_lowercase() || stem == stem_and_unit(&self.theirs).0)
    }
}
