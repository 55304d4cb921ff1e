//! One chunk: nothing of it is returned before its checksum was compared.

use crate::read::damage::Damage;
use mcap::records::{Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{McapError, parse_record};
use std::io::Read;

/// Larger records, compressed or not, are taken as damaged: a bad length must not ask for all memory.
pub const RECORD_LIMIT: usize = 256 << 20;
/// Opcode and length before every record, bytes.
pub const FRAME_BYTES: u64 = 9;
/// Read at once, bytes.
pub const READ_BLOCK: usize = 1 << 20;

/// What a chunk says about itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ChunkHead {
    /// Earliest log time, ns.
    pub start_ns: u64,
    /// Latest log time, ns.
    pub end_ns: u64,
    /// Bytes of the record up to the end of what is compressed.
    pub end: usize,
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
        let head = 40 + name_bytes as u64;
        let is_known = matches!(name, b"" | b"lz4" | b"zstd");
        let is_small = uncompressed <= RECORD_LIMIT as u64 && compressed <= RECORD_LIMIT as u64;
        let fits =
            is_small && head + compressed <= length && (!name.is_empty() || compressed == uncompressed);
        let plausible = is_known && fits && start_ns <= end_ns;
        plausible.then_some(Self { start_ns, end_ns, end: (head + compressed) as usize })
    }

    /// What is reported of a chunk that cannot be read to its end.
    #[must_use]
    pub fn damage(&self, offset: u64, length: u64, kept: usize, why: &McapError) -> Damage {
        let (start_ns, end_ns, why) = (self.start_ns, self.end_ns, why.to_string());
        Damage::Chunk { offset, length, start_ns, end_ns, kept, why }
    }
}

/// The records of a chunk, and what ended them if it was not the end. With a checksum in the chunk it is all or nothing.
#[must_use]
pub fn records(body: &[u8], head: &ChunkHead) -> (Vec<Record<'static>>, Option<McapError>) {
    // Padding is cut off: an uncompressed record must not run into it.
    let body = body.get(..head.end).unwrap_or(body);
    let mut frame = [op::CHUNK; FRAME_BYTES as usize];
    frame[1..].copy_from_slice(&(body.len() as u64).to_le_bytes());
    let mut source = frame.chain(body);
    let mut reader = LinearReader::new_with_options(
        LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_skip_end_magic(true)
            .with_prevalidate_chunk_crcs(true)
            .with_record_length_limit(RECORD_LIMIT),
    );
    let mut records = Vec::new();
    while let Some(event) = reader.next_event() {
        match event {
            Ok(LinearReadEvent::ReadRequest(wanted)) => {
                let got = source.read(reader.insert(wanted.clamp(1, READ_BLOCK))).unwrap_or(0);
                reader.notify_read(got);
            }
            Ok(LinearReadEvent::Record { opcode, data }) => match parse(opcode, data) {
                Ok(record) => records.push(record),
                Err(error) => return (records, Some(error)),
            },
            Err(error) => return (records, Some(error)),
        }
    }
    (records, None)
}

/// [`parse_record`], which panics on an attachment that is shorter than it says (mcap 0.26.0).
///
/// # Errors
/// A record that makes no sense.
pub fn parse(opcode: u8, body: &[u8]) -> Result<Record<'static>, McapError> {
    if opcode == op::ATTACHMENT && !attachment_is_whole(body) {
        return Err(McapError::UnexpectedEof);
    }
    Ok(parse_record(opcode, body)?.into_owned())
}

fn attachment_is_whole(body: &[u8]) -> bool {
    let after_text = |at: usize| -> Option<usize> {
        let bytes = u32::from_le_bytes(body.get(at..at + 4)?.try_into().ok()?);
        (at + 4).checked_add(bytes as usize)
    };
    let end = || -> Option<u64> {
        let at = after_text(after_text(16)?)?;
        let bytes = u64::from_le_bytes(body.get(at..at.checked_add(8)?)?.try_into().ok()?);
        (at as u64 + 8).checked_add(bytes)?.checked_add(4)
    };
    end().is_some_and(|end| end <= body.len() as u64)
}
