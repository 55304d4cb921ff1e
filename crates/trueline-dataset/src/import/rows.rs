//! Text files of numbers separated by blanks, as research programs write them.

use crate::error::{Error, Problem};
use crate::folder::utf8;
use crate::source_file;
use std::path::{Path, PathBuf};

/// A text file of numbers, row by row; blank lines and lines that begin with `#` are skipped.
pub struct Rows {
    file: PathBuf,
    text: String,
}

/// One row: its line and its fields.
pub struct Row<'a> {
    /// Line in the file, from 1.
    pub line: u64,
    /// The fields as text.
    pub fields: Vec<&'a str>,
}

impl Rows {
    /// Reads a file.
    ///
    /// # Errors
    /// A missing or unreadable file.
    pub fn open(file: &Path) -> Result<Self, Error> {
        let bytes = source_file::named(source_file::bytes(file))?;
        source_file::expect_lines(file, &bytes)?;
        Ok(Self { file: file.to_owned(), text: utf8(file, bytes)? })
    }

    /// The rows.
    pub fn iter(&self) -> impl Iterator<Item = Row<'_>> {
        self.text.lines().enumerate().filter_map(|(index, text)| {
            let text = text.trim();
            (!text.is_empty() && !text.starts_with('#'))
                .then(|| Row { line: index as u64 + 1, fields: text.split_whitespace().collect() })
        })
    }

    /// An error at a row.
    #[must_use]
    pub fn error(&self, row: &Row<'_>, problem: Problem) -> Error {
        Error::at_line(&self.file, row.line, problem)
    }

    /// An error of the whole file.
    #[must_use]
    pub(crate) fn file_error(&self, problem: Problem) -> Error {
        Error::in_file(&self.file, problem)
    }

    /// The fields from `first` on as `N` finite numbers.
    ///
    /// # Errors
    /// Too few fields, or one that is not a finite number.
    pub fn numbers<const N: usize>(&self, row: &Row<'_>, first: usize) -> Result<[f64; N], Error> {
        let mut numbers = [0.0; N];
        for (k, number) in numbers.iter_mut().enumerate() {
            let text = *row.fields.get(first + k).unwrap_or(&"");
            let value: f64 =
                text.parse().map_err(|_| self.error(row, Problem::NotANumber { text: text.to_owned() }))?;
            if !value.is_finite() {
                return Err(self.error(row, Problem::NotFinite { text: text.to_owned() }));
            }
            *number = value;
        }
        Ok(numbers)
    }

    /// Fails unless the row has one of the allowed numbers of fields.
    ///
    /// # Errors
    /// [`Problem::ForeignRow`].
    pub(crate) fn expect_fields(
        &self,
        row: &Row<'_>,
        format: &'static str,
        allowed: &[usize],
    ) -> Result<(), Error> {
        if allowed.contains(&row.fields.len()) {
            return Ok(());
        }
        let expected = allowed.iter().map(ToString::to_string).collect::<Vec<_>>().join(" or ");
        Err(self.error(row, Problem::ForeignRow { format, expected, found: row.fields.len() }))
    }
}

/// Fails at the first index where stamps fall.
///
/// # Errors
/// [`Problem::TimeRunsBackwards`].
pub(crate) fn check_order(
    rows: &Rows,
    row: &Row<'_>,
    previous_ns: Option<i64>,
    this_ns: i64,
) -> Result<(), Error> {
    match previous_ns {
        Some(previous_ns) if this_ns < previous_ns => {
            let (previous_s, this_s) = (crate::stamp::seconds(previous_ns), crate::stamp::seconds(this_ns));
            Err(rows.error(row, Problem::TimeRunsBackwards { previous_s, this_s }))
        }
        _ => Ok(()),
    }
}
