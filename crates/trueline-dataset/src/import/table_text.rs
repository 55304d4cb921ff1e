//! A table of another program as the text of a CSV, with the lines that its rows were read from.

/// A table as text.
#[derive(Debug)]
pub struct TableText {
    /// The text.
    pub bytes: Vec<u8>,
    /// The source line of each row below the names, if it differs from the line of the text.
    pub row_lines: Vec<u64>,
}

impl From<Vec<u8>> for TableText {
    fn from(bytes: Vec<u8>) -> Self {
        Self { bytes, row_lines: Vec::new() }
    }
}

/// The line of a file from which a line of its text was read.
pub(super) fn file_line(row_lines: &[u64], line: u64) -> u64 {
    let row = usize::try_from(line).unwrap_or(usize::MAX).checked_sub(2);
    row.and_then(|row| row_lines.get(row)).copied().unwrap_or(line)
}
