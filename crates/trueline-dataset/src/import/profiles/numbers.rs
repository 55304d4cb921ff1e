//! Text tables of numbers whose header, if any, is words or the positions of the columns.

use crate::dialect::plain_csv;
use crate::error::{Error, Problem};
use std::path::Path;

/// The lines of a table: header lines as words, then rows of numbers; an empty field or one that is no number is no value.
pub(super) struct NumberTable {
    /// The last line before the first row of numbers that has as many fields, if any.
    pub header: Option<Vec<String>>,
    /// Rows with their line numbers.
    pub rows: Vec<(u64, Vec<Option<f64>>)>,
}

/// Reads a table; everything before the first row of numbers is header.
///
/// # Errors
/// Broken text, or no row of numbers.
pub(super) fn read(file: &Path, bytes: Vec<u8>) -> Result<NumberTable, Error> {
    let (csv, _) = plain_csv(file, bytes, None)?;
    let text = String::from_utf8(csv)
        .map_err(|_| Error::in_file(file, Problem::Csv("it is not text".to_owned())))?;
    let mut header: Option<Vec<String>> = None;
    let mut rows: Vec<(u64, Vec<Option<f64>>)> = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let fields: Vec<&str> = line.trim_start_matches('\u{feff}').split(',').map(str::trim).collect();
        if fields.iter().all(|field| field.is_empty()) {
            continue;
        }
        let numbers: Vec<Option<f64>> =
            fields.iter().map(|field| field.parse().ok().filter(|value: &f64| value.is_finite())).collect();
        let is_row = numbers[0].is_some()
            && (!rows.is_empty() || numbers.iter().flatten().count() * 2 >= numbers.len());
        if is_row {
            rows.push((index as u64 + 1, numbers));
        } else if rows.is_empty() {
            header = Some(fields.iter().map(|&field| field.to_owned()).collect());
        } else {
            let text = fields[0].to_owned();
            return Err(Error::at_line(file, index as u64 + 1, Problem::NotANumber { text }));
        }
    }
    if rows.is_empty() {
        return Err(Error::in_file(file, Problem::NoRows));
    }
    Ok(NumberTable { header, rows })
}
