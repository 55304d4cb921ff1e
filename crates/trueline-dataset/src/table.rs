//! CSV tables with named columns and units, read strictly.

use crate::error::{Error, Problem};
use crate::rows::{Rows, RowsError};
use crate::stamp;
use crate::unit::Quantity;
use std::path::Path;

/// No place, picture or brightness has a number as large as this in SI units; programs write such for "nothing measured".
pub(crate) const LARGEST: f64 = 1e12;

/// A column that a table may have.
#[derive(Clone, Copy, Debug)]
pub struct ColumnSpec<'a> {
    /// Name without unit.
    pub name: &'a str,
    /// Its quantity.
    pub quantity: Quantity,
    /// Whether the table is useless without it.
    pub required: bool,
}

/// A needed column.
#[must_use]
pub const fn required(name: &str, quantity: Quantity) -> ColumnSpec<'_> {
    ColumnSpec { name, quantity, required: true }
}

/// A column that may be left out.
#[must_use]
pub const fn optional(name: &str, quantity: Quantity) -> ColumnSpec<'_> {
    ColumnSpec { name, quantity, required: false }
}

#[derive(Clone, Debug)]
struct Found {
    index: usize,
    header: String,
    /// The size of its unit in SI.
    scale: f64,
    /// Decimal digits from its unit to a billionth of SI's.
    nano_digits: usize,
}

/// An open table; rows are read one at a time.
pub struct Table<'a> {
    file: &'a Path,
    rows: Rows<'a>,
    columns: Vec<Option<Found>>,
    /// How many columns the header has.
    width: usize,
}

/// A table after its header, before its columns are interpreted.
pub struct Header<'a> {
    file: &'a Path,
    rows: Rows<'a>,
    names: Vec<String>,
}

impl<'a> Header<'a> {
    /// Reads the header.
    ///
    /// # Errors
    /// An empty file, or one that is not text.
    pub fn read(file: &'a Path, bytes: &'a [u8]) -> Result<Self, Error> {
        let mut rows = Rows::new(bytes).map_err(|e| rows_error(file, e))?;
        let there = rows.advance().map_err(|e| rows_error(file, e))?;
        let names: Vec<String> = if there {
            (0..rows.len()).map(|k| rows.field(k).trim_start_matches('\u{feff}').trim().to_owned()).collect()
        } else {
            Vec::new()
        };
        if names.iter().all(String::is_empty) {
            return Err(Error::in_file(file, Problem::NoRows));
        }
        if names.iter().all(|name| name.parse::<f64>().is_ok()) {
            return Err(Error::at_line(file, rows.line(), Problem::NoHeader));
        }
        Ok(Self { file, rows, names })
    }

    /// The names of the columns.
    #[must_use]
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// An error of the header.
    #[must_use]
    pub fn error(&self, problem: Problem) -> Error {
        Error::at_line(self.file, self.rows.line(), problem)
    }

    /// Finds each column of `specs`.
    ///
    /// # Errors
    /// Unknown, duplicate, missing or unit-less columns.
    pub fn find(self, specs: &[ColumnSpec<'_>]) -> Result<Table<'a>, Error> {
        let mut columns: Vec<Option<Found>> = vec![None; specs.len()];
        for (index, name) in self.names.iter().enumerate() {
            let (spec, scale) = identify(name, specs).map_err(|p| self.error(p).in_column(name))?;
            if columns[spec].is_some() {
                return Err(self.error(Problem::DuplicateColumn).in_column(name));
            }
            let nano_digits = (9.0 + scale.log10()).round() as usize;
            columns[spec] = Some(Found { index, header: name.to_owned(), scale, nano_digits });
        }
        for (spec, column) in specs.iter().zip(&columns) {
            if spec.required && column.is_none() {
                let name = format!("{}{}", spec.name, spec.quantity.usual_suffix());
                let found = self.names.join(", ");
                return Err(self.error(Problem::MissingColumn { name, found }));
            }
        }
        Ok(Table { file: self.file, rows: self.rows, columns, width: self.names.len() })
    }
}

impl<'a> Table<'a> {
    /// Reads the header and finds each column of `specs` in it.
    ///
    /// # Errors
    /// Unknown, duplicate, missing or unit-less columns.
    pub fn open(file: &'a Path, bytes: &'a [u8], specs: &[ColumnSpec<'_>]) -> Result<Self, Error> {
        Header::read(file, bytes)?.find(specs)
    }

    /// Capacity for the following rows, so that their results are not moved while they grow.
    pub(crate) fn room<T>(&self) -> Vec<T> {
        Vec::with_capacity(self.rows.most_left())
    }

    /// Whether an optional column is there.
    #[must_use]
    pub fn has(&self, column: usize) -> bool {
        self.columns[column].is_some()
    }

    /// Reads the next row; `false` at the end.
    ///
    /// # Errors
    /// A row that is not text or has too few or too many fields.
    pub(crate) fn next_row(&mut self) -> Result<bool, Error> {
        if !self.rows.advance().map_err(|e| rows_error(self.file, e))? {
            return Ok(false);
        }
        if self.rows.len() != self.width {
            let problem = Problem::FieldCount { expected: self.width, found: self.rows.len() };
            return Err(self.error(problem));
        }
        Ok(true)
    }

    /// Line of the current row, from 1.
    #[must_use]
    pub fn line(&self) -> u64 {
        self.rows.line()
    }

    /// An error at the current row.
    #[must_use]
    pub fn error(&self, problem: Problem) -> Error {
        Error::at_line(self.file, self.line(), problem)
    }

    /// An error at the current row in a column.
    #[must_use]
    pub(crate) fn error_in(&self, column: usize, problem: Problem) -> Error {
        let header = self.columns[column].as_ref().map_or("", |found| found.header.as_str());
        self.error(problem).in_column(header)
    }

    /// A field as in the file, or `None` if the column does not exist.
    #[must_use]
    pub fn text(&self, column: usize) -> Option<&str> {
        self.field(column).map(|(text, _)| text)
    }

    fn field(&self, column: usize) -> Option<(&str, &Found)> {
        let found = self.columns[column].as_ref()?;
        Some((self.rows.field(found.index), found))
    }

    /// A number in SI, or `None` if the column is not there.
    ///
    /// # Errors
    /// A field that is not a finite number, or larger than any measured value.
    pub fn number(&self, column: usize) -> Result<Option<f64>, Error> {
        let Some((text, &Found { scale, .. })) = self.field(column) else {
            return Ok(None);
        };
        let value: f64 =
            text.parse().map_err(|_| self.error_in(column, Problem::NotANumber { text: text.to_owned() }))?;
        if !value.is_finite() {
            return Err(self.error_in(column, Problem::NotFinite { text: text.to_owned() }));
        }
        if (value * scale).abs() > LARGEST {
            return Err(self.error_in(column, Problem::NotMeasured { text: text.to_owned() }));
        }
        Ok(Some(value * scale))
    }

    /// A number in a column that is required.
    ///
    /// # Errors
    /// As [`Table::number`].
    pub(crate) fn required_number(&self, column: usize) -> Result<f64, Error> {
        self.number(column)?.ok_or_else(|| self.error(Problem::NotANumber { text: String::new() }))
    }

    /// A standard deviation in SI: above zero.
    ///
    /// # Errors
    /// As [`Table::number`], and for zero or less.
    pub fn sigma(&self, column: usize) -> Result<Option<f64>, Error> {
        let value = self.number(column)?;
        match value {
            Some(v) if v <= 0.0 => {
                let text = self.text(column).unwrap_or_default().to_owned();
                Err(self.error_in(column, Problem::NotPositive { text }))
            }
            _ => Ok(value),
        }
    }

    /// A stamp in nanoseconds.
    ///
    /// # Errors
    /// A field that is not a finite decimal number.
    pub fn stamp_ns(&self, column: usize) -> Result<i64, Error> {
        let (text, digits) = self.field(column).map_or(("", 9), |(text, found)| (text, found.nano_digits));
        stamp::parse_nanoseconds(text, digits).ok_or_else(|| self.error_in(column, stamp::problem_of(text)))
    }

    /// The same, or `None` if the column is not there.
    ///
    /// # Errors
    /// As [`Table::stamp_ns`].
    pub(crate) fn optional_stamp_ns(&self, column: usize) -> Result<Option<i64>, Error> {
        self.text(column).map(|_| self.stamp_ns(column)).transpose()
    }

    /// A whole number from 0, or `None` if the column is not there.
    ///
    /// # Errors
    /// Anything else.
    pub fn count(&self, column: usize) -> Result<Option<u64>, Error> {
        let Some((text, _)) = self.field(column) else {
            return Ok(None);
        };
        let parsed = without_zero_fraction(text).parse::<u64>();
        parsed.map(Some).map_err(|_| self.error_in(column, Problem::NotACount { text: text.to_owned() }))
    }
}

/// Other programs write whole numbers as `3.0` if some are missing.
fn without_zero_fraction(text: &str) -> &str {
    match text.split_once('.') {
        Some((whole, fraction)) if fraction.bytes().all(|digit| digit == b'0') => whole,
        _ => text,
    }
}

/// Whether a header is one of these columns, with a unit that it can have.
#[must_use]
pub(crate) fn is_one_of(header: &str, specs: &[ColumnSpec<'_>]) -> bool {
    identify(header, specs).is_ok()
}

/// Which column a header names, and the size of its unit.
pub(crate) fn identify(header: &str, specs: &[ColumnSpec<'_>]) -> Result<(usize, f64), Problem> {
    for (index, spec) in specs.iter().enumerate() {
        if let Some(suffix) = header.strip_prefix(spec.name)
            && let Some((_, scale)) = spec.quantity.suffixes().iter().find(|(s, _)| *s == suffix)
        {
            return Ok((index, *scale));
        }
    }
    if let Some(spec) = specs.iter().find(|spec| spec.name == header) {
        return Err(Problem::NoUnit { example: format!("{}{}", spec.name, spec.quantity.usual_suffix()) });
    }
    let known: Vec<String> =
        specs.iter().map(|s| format!("{}{}", s.name, s.quantity.usual_suffix())).collect();
    Err(Problem::UnknownColumn { meant: meant(header, specs, &known), known: known.join(", ") })
}

/// The known column that a header without its unit, or with other letters, is most likely to mean.
fn meant(header: &str, specs: &[ColumnSpec<'_>], known: &[String]) -> Option<String> {
    let lower = header.trim().to_ascii_lowercase();
    let name = if lower == "t" { "time" } else { lower.as_str() };
    let index = specs.iter().zip(known).position(|(spec, known)| {
        spec.name.trim_end_matches('_') == name || known.eq_ignore_ascii_case(&lower)
    })?;
    known.get(index).cloned()
}

fn rows_error(file: &Path, error: RowsError) -> Error {
    match error {
        RowsError::NotUtf8 => Error::in_file(file, Problem::NotUtf8),
        RowsError::Csv { line, error } => {
            Error { file: file.to_owned(), line, column: None, problem: Problem::Csv(error.to_string()) }
        }
    }
}
