//! One chunk: nothing of it is returned before its checksum was compared.

use crate::read::damage::Damage;
use crate::read::inner_lengths;
use mcap::records::{Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{McapError, parse_record};
use std::io::{Cursor, Read};

/// Larger records, compressed or not, count as damaged: a bad length must not ask for all memory.
pub(crate) const RECORD_LIMIT: usize = 256 << 20;
/// A chunk may always be this large when it is decompressed, bytes. Dark pictures shrink to nearly nothing.
const SMALL: u64 = 64 << 20;
/// Above that the ratio to its compressed size is limited: a small file must not fill the memory.
const MOST_EXPANSION: u64 = 256;
/// Opcode and length before every record, bytes.
pub(crate) const FRAME_BYTES: u64 = 9;
/// Read at once, bytes.
pub(crate) const READ_BLOCK: usize = 1 << 20;

/// Statements of a chunk about itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ChunkHead {
    /// Earliest log time, ns.
    pub start_ns: u64,
    /// Latest log time, ns.
    pub end_ns: u64,
    /// Bytes of the record up to the end of the compressed part.
    pub end: usize,
    /// Bytes of it when it is decompressed.
    pub uncompressed: usize,
}

impl ChunkHead {
    /// The head at the beginning of a chunk's body of `length` bytes, if it is plausible.
    #[must_use]
    pub fn read(body: &[u8], length: u64) -> Option<Self> {
        let u64_at = |at: usize| Some(u64::from_le_bytes(body.get(at..at + 8)?.try_into().ok()?));
        let (start_ns, end_ns, uncompressed) = (u64_at(0)?, u64_at(8)?, u64_at(16)?);
        let name_bytes = u32::from_le_bytes(body.get(28..32)?.try_into().ok()?) as usize;
        if name_bytes > 4 {
            return None;
        }
        let name = body.get(32..32 + name_bytes)?;
        let compressed = u64_at(32 + name_bytes)?;
        let end = compressed.checked_add(40 + name_bytes as u64)?;
        let is_known = matches!(name, b"" | b"lz4" | b"zstd");
        let is_small = uncompressed <= SMALL.max(compressed.saturating_mul(MOST_EXPANSION))
            && uncompressed.max(compressed) <= RECORD_LIMIT as u64;
        let fits = end <= length && (!name.is_empty() || compressed == uncompressed);
        let plausible = is_known && is_small && fits && start_ns <= end_ns;
        plausible.then_some(Self { start_ns, end_ns, end: end as usize, uncompressed: uncompressed as usize })
    }

    /// Report on a chunk that cannot be read to its end.
    #[must_use]
    pub fn damage(&self, offset: u64, length: u64, kept: usize, why: &McapError) -> Damage {
        let (start_ns, end_ns, why) = (self.start_ns, self.end_ns, why.to_string());
        Damage::Chunk { offset, length, start_ns, end_ns, kept, why }
    }
}

/// The records of a chunk, one after the other: its messages may be far more than its bytes.
pub struct ChunkRecords {
    source: Cursor<Vec<u8>>,
    reader: LinearReader,
}

impl ChunkRecords {
    /// Of the body of a chunk with that head. With a checksum in the chunk it is all or nothing.
    #[must_use]
    pub fn new(mut body: Vec<u8>, head: &ChunkHead) -> Self {
        // Padding is cut off: an uncompressed record must not run into it.
        body.truncate(head.end);
        let limit = head.uncompressed.max(body.len());
        let mut reader = LinearReader::new_with_options(
            LinearReaderOptions::default()
                .with_skip_start_magic(true)
                .with_skip_end_magic(true)
                .with_prevalidate_chunk_crcs(true)
                .with_record_length_limit(limit),
        );
        let frame = reader.insert(FRAME_BYTES as usize);
        frame[0] = op::CHUNK;
        frame[1..].copy_from_slice(&(body.len() as u64).to_le_bytes());
        reader.notify_read(FRAME_BYTES as usize);
        Self { source: Cursor::new(body), reader }
    }

    /// The next record, or the error that ended them; do not call it after that.
    pub(crate) fn next_record(&mut self) -> Option<Result<Record<'static>, McapError>> {
        loop {
            match self.reader.next_event()? {
                Ok(LinearReadEvent::ReadRequest(wanted)) => {
                    let got = self.source.read(self.reader.insert(wanted.clamp(1, READ_BLOCK))).unwrap_or(0);
                    self.reader.notify_read(got);
                }
                Ok(LinearReadEvent::Record { opcode, data }) => return Some(parse(opcode, data)),
                Err(error) => return Some(Err(error)),
            }
        }
    }
}

/// [`parse_record`] for a record with inner lengths that fit. It allocates memory by them, and panics on an attachment
/// that is shorter than stated (mcap 0.26.0).
///
/// # Errors
/// A record that makes no sense.
pub fn parse(opcode: u8, body: &[u8]) -> Result<Record<'static>, McapError> {
    if !inner_lengths::fit(opcode, body) {
        return Err(McapError::UnexpectedEof);
    }
    Ok(parse_record(opcode, body)?.into_owned())
}
