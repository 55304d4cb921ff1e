//! Claimed sizes of a Parquet file's pages, before any of them is decoded.
//!
//! A page of a few bytes can claim two gigabytes, or two thousand million times one value; the library allocates the
//! claimed size. So the headers of all pages are read first: they say how large a page is when it is decompressed, and how
//! many values it has. The file's own list of columns need not be true about them.
//!
//! A header is a struct in Thrift's compact protocol, which the library does not expose. Fields 2 and 3 are its sizes, and
//! fields 5 and 8 the headers of data pages; their field 1 is the number of values \[ParquetFormat\].

use parquet::file::metadata::{ColumnChunkMetaData, ParquetMetaData};
use parquet::file::reader::ChunkReader;

/// Sum of the claims of a file's pages.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Claimed {
    /// Bytes of all pages when they are decompressed.
    pub bytes: u64,
    /// Values of the column that has most of them.
    pub rows: u64,
}

/// Deepest nesting of a header; the format's has three levels.
const MOST_LEVELS: usize = 8;

/// Bytes of a header, ...
const USUAL_HEADER: u64 = 1 << 12;
/// ... and of one with long statistics.
const LONGEST_HEADER: u64 = 1 << 20;

/// Sums over all columns; `None` where pages do not follow each other to the end of their column.
pub(crate) fn claimed(file: &impl ChunkReader, metadata: &ParquetMetaData) -> Option<Claimed> {
    let (mut bytes, mut rows_by_column) = (0_u64, Vec::new());
    for group in metadata.row_groups() {
        rows_by_column.resize(rows_by_column.len().max(group.num_columns()), 0_u64);
        for (column, rows) in group.columns().iter().zip(&mut rows_by_column) {
            let (mut at, end) = pages_of(column)?;
            if end > file.len() {
                return None;
            }
            while at < end {
                let header = |most: u64| {
                    let chunk = file.get_bytes(at, usize::try_from(most.min(end - at)).ok()?).ok()?;
                    let mut reader = Compact { left: &chunk };
                    Some((reader.page_header()?, (chunk.len() - reader.left.len()) as u64))
                };
                let (page, header) = header(USUAL_HEADER).or_else(|| header(LONGEST_HEADER))?;
                bytes = bytes.checked_add(page.uncompressed)?;
                *rows = rows.checked_add(page.values)?;
                at = at.checked_add(header)?.checked_add(page.compressed).filter(|next| *next <= end)?;
            }
        }
    }
    Some(Claimed { bytes, rows: rows_by_column.into_iter().max().unwrap_or(0) })
}

/// Begin and end of a column's pages. The library's own look-up of their range ends in a panic where a number of it is negative.
fn pages_of(column: &ColumnChunkMetaData) -> Option<(u64, u64)> {
    let start = column.dictionary_page_offset().unwrap_or(column.data_page_offset());
    let start = u64::try_from(start).ok()?;
    Some((start, start.checked_add(u64::try_from(column.compressed_size()).ok()?)?))
}

#[derive(Default)]
struct Page {
    uncompressed: u64,
    compressed: u64,
    values: u64,
}

/// A field's type in the compact protocol.
#[derive(Clone, Copy, PartialEq)]
struct Kind(u8);

impl Kind {
    const WHOLE: std::ops::RangeInclusive<u8> = 4..=6;
    const STRUCT: Self = Self(12);
}

/// Reads the compact protocol.
struct Compact<'a> {
    left: &'a [u8],
}

impl Compact<'_> {
    fn page_header(&mut self) -> Option<Page> {
        let mut page = Page::default();
        let mut number = 0;
        while let Some(kind) = self.field(&mut number)? {
            match number {
                2 => page.uncompressed = u64::try_from(self.whole(kind)?).ok()?,
                3 => page.compressed = u64::try_from(self.whole(kind)?).ok()?,
                5 | 8 if kind == Kind::STRUCT => page.values += self.values()?,
                _ => self.skip(kind, 0)?,
            }
        }
        Some(page)
    }

    /// Field 1 of a struct.
    fn values(&mut self) -> Option<u64> {
        let (mut number, mut values) = (0, 0);
        while let Some(kind) = self.field(&mut number)? {
            if number == 1 {
                values = u64::try_from(self.whole(kind)?).ok()?;
            } else {
                self.skip(kind, 0)?;
            }
        }
        Some(values)
    }

    /// The next field's type, and its number from the last one's; the inner `None` ends a struct.
    fn field(&mut self, number: &mut i64) -> Option<Option<Kind>> {
        let byte = self.byte()?;
        if byte == 0 {
            return Some(None);
        }
        let step = i64::from(byte >> 4);
        *number = if step == 0 { self.zigzag()? } else { *number + step };
        Some(Some(Kind(byte & 0x0f)))
    }

    fn whole(&mut self, kind: Kind) -> Option<i64> {
        Kind::WHOLE.contains(&kind.0).then(|| self.zigzag())?
    }

    fn skip(&mut self, kind: Kind, level: usize) -> Option<()> {
        if level > MOST_LEVELS {
            return None;
        }
        match kind.0 {
            1 | 2 => {}
            3 => self.pass(1)?,
            4..=6 => {
                self.varint()?;
            }
            7 => self.pass(8)?,
            8 => {
                let length = self.varint()?;
                self.pass(length)?;
            }
            9 | 10 => {
                let head = self.byte()?;
                let count = if head >> 4 == 15 { self.varint()? } else { u64::from(head >> 4) };
                for _ in 0..count {
                    // A list's truth values are a byte each.
                    if matches!(head & 0x0f, 1 | 2) {
                        self.pass(1)?
                    } else {
                        self.skip(Kind(head & 0x0f), level + 1)?
                    }
                }
            }
            12 => {
                let mut number = 0;
                while let Some(kind) = self.field(&mut number)? {
                    self.skip(kind, level + 1)?;
                }
            }
            _ => return None,
        }
        Some(())
    }

    fn byte(&mut self) -> Option<u8> {
        let (first, rest) = self.left.split_first()?;
        self.left = rest;
        Some(*first)
    }

    fn pass(&mut self, count: u64) -> Option<()> {
        self.left = self.left.get(usize::try_from(count).ok()?..)?;
        Some(())
    }

    fn varint(&mut self) -> Option<u64> {
        let mut value = 0_u64;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            value |= u64::from(byte & 0x7f) << shift;
            if byte & 0x80 == 0 {
                return Some(value);
            }
        }
        None
    }

    fn zigzag(&mut self) -> Option<i64> {
        let value = self.varint()?;
        Some((value >> 1).cast_signed() ^ -(value & 1).cast_signed())
    }
}
