//! Files of a header in text and rows of numbers: the header is written again once the rows are counted.

use super::point::{CloudColumns, CloudPoint, CloudSink};
use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};

/// Bytes that are written at a time.
const BUFFER: usize = 1 << 20;

/// Bytes of the longest row.
const LONGEST_ROW: usize = 64;

/// The bytes of a row.
pub(super) struct Row {
    bytes: [u8; LONGEST_ROW],
    length: usize,
}

impl Row {
    /// Adds the bytes of a number, little end first.
    #[inline]
    pub(super) fn put<const N: usize>(&mut self, bytes: [u8; N]) {
        if let Some(place) = self.bytes.get_mut(self.length..self.length + N) {
            place.copy_from_slice(&bytes);
            self.length += N;
        }
    }

    /// Adds the columns that a point may have, in single precision.
    pub(super) fn put_optional(&mut self, point: &CloudPoint, columns: CloudColumns) {
        if columns.intensity {
            self.put((point.intensity.unwrap_or(f64::NAN) as f32).to_le_bytes());
        }
        if columns.sigma {
            self.put((point.sigma_m.unwrap_or(f64::NAN) as f32).to_le_bytes());
        }
        if columns.frame {
            self.put((point.frame as u32).to_le_bytes());
        }
    }
}

/// Writes rows and counts them.
struct Rows<'a> {
    out: BufWriter<&'a File>,
    count: u64,
    row: fn(&mut Row, &CloudPoint, CloudColumns),
    columns: CloudColumns,
    bytes: Vec<u8>,
}

impl CloudSink for Rows<'_> {
    fn take(&mut self, points: &[CloudPoint]) -> io::Result<()> {
        self.bytes.clear();
        let mut row = Row { bytes: [0; LONGEST_ROW], length: 0 };
        for point in points {
            row.length = 0;
            (self.row)(&mut row, point, self.columns);
            self.bytes.extend_from_slice(&row.bytes[..row.length]);
        }
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
    pub row: fn(&mut Row, &CloudPoint, CloudColumns),
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
