//! Size of a workbook in memory, found before it is read: a few kB can claim a rectangle of 10¹⁰ cells.

use calamine::{Reader, Sheets};
use quick_xml::events::{BytesStart, Event};
use std::io::{BufRead, BufReader, Cursor, Read, Seek};
use zip::ZipArchive;

/// Compressed data may grow to this, bytes, …
const FREE_BYTES: u64 = 64 << 20;
/// … or this many times the file. Text of numbers shrinks to a third or a tenth.
const GROWTH: u64 = 50;
/// A rectangle of this many cells is accepted with any content, …
const FREE_CELLS: u64 = 1 << 20;
/// … a larger one if one in this many of its cells is filled.
const SPARSE: u64 = 64;

/// Why a workbook is not read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum Fault {
    /// A compound file: the whole of every sheet is built before anything can be asked.
    #[error("it has the form of Excel before 2007; save it as .xlsx")]
    Old,
    /// No ZIP.
    #[error("it is damaged")]
    Damaged,
    /// More bytes than such a file can hold.
    #[error("it grows too much when it is decompressed")]
    Grows,
    /// Cells far apart.
    #[error("its cells lie far apart: {cells} of them in {rows} rows and {columns} columns")]
    Sparse {
        /// Filled cells.
        cells: u64,
        /// Rows of the rectangle about them.
        rows: u64,
        /// Its columns.
        columns: u64,
    },
}

/// Refuses data that grow too much when decompressed, and sheets of LibreOffice with cells far apart.
///
/// # Errors
/// [`Fault`].
pub(super) fn expect_bounded(bytes: &[u8]) -> Result<(), Fault> {
    if !bytes.starts_with(b"PK") {
        return Err(Fault::Old);
    }
    let mut budget = FREE_BYTES.max(GROWTH * bytes.len() as u64);
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(|_| Fault::Damaged)?;
    for index in 0..archive.len() {
        let entry = archive.by_index(index).map_err(|_| Fault::Damaged)?;
        let is_content = entry.name().is_ok_and(|name| name == "content.xml");
        // An entry may state a wrong size, so the bytes are counted.
        let mut counted = Counted { inner: BufReader::new(entry).take(budget), read: 0 };
        if is_content {
            extent_of_ods(&mut BufReader::new(&mut counted))?.expect_dense()?;
        }
        std::io::copy(&mut counted, &mut std::io::sink()).map_err(|_| Fault::Damaged)?;
        budget = budget.checked_sub(counted.read).filter(|left| *left > 0).ok_or(Fault::Grows)?;
    }
    Ok(())
}

/// Refuses a first sheet of Excel with cells far apart, which would be built as one rectangle.
///
/// # Errors
/// [`Fault::Sparse`]; the reader of the sheet reports other faults.
pub(super) fn expect_dense<R: Read + Seek>(workbook: &mut Sheets<R>) -> Result<(), Fault> {
    let Some(name) = workbook.sheet_names().first().cloned() else { return Ok(()) };
    let mut extent = Extent::default();
    match workbook {
        Sheets::Xlsx(book) => {
            let Ok(mut cells) = book.worksheet_cells_reader(&name) else { return Ok(()) };
            while let Ok(Some(cell)) = cells.next_cell() {
                extent.add(cell.get_position());
            }
        }
        Sheets::Xlsb(book) => {
            let Ok(mut cells) = book.worksheet_cells_reader(&name) else { return Ok(()) };
            while let Ok(Some(cell)) = cells.next_cell() {
                extent.add(cell.get_position());
            }
        }
        Sheets::Ods(_) | Sheets::Xls(_) => {}
    }
    extent.expect_dense()
}

/// The rectangle from the first cell of the sheet to the last that is filled.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Extent {
    cells: u64,
    rows: u64,
    columns: u64,
}

impl Extent {
    fn add(&mut self, (row, column): (u32, u32)) {
        self.cells += 1;
        self.rows = self.rows.max(u64::from(row) + 1);
        self.columns = self.columns.max(u64::from(column) + 1);
    }

    fn expect_dense(self) -> Result<(), Fault> {
        let Self { cells, rows, columns } = self;
        let is_dense = rows.saturating_mul(columns) <= FREE_CELLS.max(SPARSE.saturating_mul(cells));
        if is_dense { Ok(()) } else { Err(Fault::Sparse { cells, rows, columns }) }
    }
}

/// Sheets of LibreOffice say how often a cell or a row is repeated. All sheets are read: each counts.
fn extent_of_ods(xml: &mut impl BufRead) -> Result<Extent, Fault> {
    let mut reader = quick_xml::Reader::from_reader(xml);
    let mut extent = Extent::default();
    let (mut rows, mut columns) = (0_u64, 0_u64);
    let mut buffer = Vec::new();
    loop {
        buffer.clear();
        match reader.read_event_into(&mut buffer).map_err(|_| Fault::Damaged)? {
            Event::Start(tag) | Event::Empty(tag) => match tag.name().as_ref() {
                "table:table" => (rows, columns) = (0, 0),
                "table:table-row" => {
                    rows = rows.saturating_add(repeats(&tag, "table:number-rows-repeated"));
                    columns = 0;
                }
                "table:table-cell" | "table:covered-table-cell" => {
                    columns = columns.saturating_add(repeats(&tag, "table:number-columns-repeated"));
                    let is_filled = tag.attributes().flatten().any(|attribute| {
                        attribute.key.as_ref() == "office:value-type"
                            || attribute.key.as_ref() == "table:formula"
                    });
                    if is_filled {
                        extent.cells += 1;
                        extent.rows = extent.rows.max(rows);
                        extent.columns = extent.columns.max(columns);
                    }
                }
                _ => {}
            },
            Event::Eof => return Ok(extent),
            _ => {}
        }
    }
}

fn repeats(tag: &BytesStart<'_>, name: &str) -> u64 {
    let value = tag.attributes().flatten().find(|attribute| attribute.key.as_ref() == name);
    // The reader of the sheet refuses text in place of a number.
    value.and_then(|value| value.value.parse().ok()).unwrap_or(1)
}

/// Counts the bytes read.
struct Counted<R> {
    inner: R,
    read: u64,
}

impl<R: Read> Read for Counted<R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let read = self.inner.read(buffer)?;
        self.read += read as u64;
        Ok(read)
    }
}
