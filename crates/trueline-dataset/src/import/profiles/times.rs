//! A list of stamps, one a line, in seconds.

use crate::error::Error;
use crate::import::rows::Rows;
use crate::stamp::{parse_nanoseconds, problem_of};
use std::path::Path;

/// Reads the stamps, ns; blank lines and lines that begin with `#` are skipped.
///
/// # Errors
/// A line that is not one number.
pub fn read(file: &Path) -> Result<Vec<i64>, Error> {
    let rows = Rows::open(file)?;
    let stamp = |row| {
        rows.expect_fields(&row, "a list of times (one a line, s)", &[1])?;
        let text = row.fields[0];
        parse_nanoseconds(text, 9).ok_or_else(|| rows.error(&row, problem_of(text)))
    };
    rows.iter().map(stamp).collect()
}
