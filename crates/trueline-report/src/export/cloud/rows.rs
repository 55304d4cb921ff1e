//! Files of a header in text and rows of numbers: the header is written again once the rows are counted.

use super::point::{CloudColumns, CloudPoint, CloudSink};
use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};

/// Bytes that are written at a time.
const BUFFER: usize = 1 << 20;

/// Writes rows and counts them.
struct Rows<'a> {
    out: BufWriter<&'a File>,
    count: u64,
    row: fn(&mut Vec<u8>, &CloudPoint, CloudColumns),
    columns: CloudColumns,
    bytes: Vec<u8>,
}

impl CloudSink for Rows<'_> {
    fn take(&mut self, points: &[CloudPoint]) -> io::Result<()> {
        self.bytes.clear();
        points.iter().for_each(|point| (self.row)(&mut self.bytes, point, self.columns));
        self.count += points.len() as u64;
        self.out.write_all(&self.bytes)
    }
}

/// How a file of rows is made.
#[derive(Clone, Copy)]
pub(super) struct Layout {
    /// Its header for a number of rows: as long for any.
    pub header: fn(u64, CloudColumns) -> String,
    /// Adds the bytes of a row.
    pub row: fn(&mut Vec<u8>, &CloudPoint, CloudColumns),
}

/// Writes such a file.
pub(super) fn write<E: From<io::Error>>(
    file: &File,
    layout: Layout,
    columns: CloudColumns,
    fill: &mut dyn FnMut(&mut dyn CloudSink) -> Result<(), E>,
) -> Result<(), E> {
    let mut out = BufWriter::with_capacity(BUFFER, file);
    let header = (layout.header)(0, columns);
    out.write_all(header.as_bytes())?;
    let mut rows = Rows { out, count: 0, row: layout.row, columns, bytes: Vec::new() };
    fill(&mut rows)?;
    let counted = (layout.header)(rows.count, columns);
    debug_assert_eq!(header.len(), counted.len(), "the header keeps its length");
    rows.out.seek(SeekFrom::Start(0))?;
    rows.out.write_all(counted.as_bytes())?;
    rows.out.flush()?;
    Ok(())
}

/// A number with leading blanks, and the rest of the largest number's width.
pub(super) fn padded(count: u64) -> (String, String) {
    let digits = count.to_string();
    let blanks = " ".repeat(WIDTH.saturating_sub(digits.len()));
    (digits, blanks)
}

/// Digits of the largest number of points.
const WIDTH: usize = 20;
