//! The summary at the end of a finished file: the topics again, should their first mention be damaged.

use crate::read::chunk::{FRAME_BYTES, RECORD_LIMIT, parse};
use mcap::MAGIC;
use mcap::read::ChannelAccumulator;
use mcap::records::{Record, op};
use std::io::{Read, Seek, SeekFrom};

/// Body of the last record: where the summary begins, where its offsets do, and its checksum.
const FOOTER_BYTES: u64 = 20;

/// The topics in the summary, if it exists and can be read.
pub(super) fn topics<R: Read + Seek>(source: &mut R, length: u64) -> Option<ChannelAccumulator<'static>> {
    let end = length.checked_sub(FRAME_BYTES + FOOTER_BYTES + MAGIC.len() as u64)?;
    let footer = bytes(source, end, length - end)?;
    if footer[0] != op::FOOTER || !footer.ends_with(MAGIC) {
        return None;
    }
    let start = u64::from_le_bytes(*footer.get(FRAME_BYTES as usize..)?.first_chunk()?);
    let mut topics = ChannelAccumulator::default();
    if start == 0 {
        return Some(topics);
    }
    let summary = bytes(source, start, end.checked_sub(start)?)?;
    let mut rest = summary.as_slice();
    while let Some((opcode, body, after)) = first_record(rest) {
        match parse(opcode, body).ok()? {
            Record::Schema { header, data } => topics.add_schema(header, data).ok()?,
            Record::Channel(channel) => topics.add_channel(channel).ok()?,
            _ => {}
        }
        rest = after;
    }
    rest.is_empty().then_some(topics)
}

/// Opcode and body of the first record, and the bytes after it.
fn first_record(bytes: &[u8]) -> Option<(u8, &[u8], &[u8])> {
    let (opcode, rest) = bytes.split_first()?;
    let (length, rest) = rest.split_first_chunk::<8>()?;
    let (body, rest) = rest.split_at_checked(usize::try_from(u64::from_le_bytes(*length)).ok()?)?;
    Some((*opcode, body, rest))
}

/// `count` bytes from a place in the file that has them.
fn bytes<R: Read + Seek>(source: &mut R, from: u64, count: u64) -> Option<Vec<u8>> {
    if count > RECORD_LIMIT as u64 {
        return None;
    }
    source.seek(SeekFrom::Start(from)).ok()?;
    let mut bytes = vec![0; count as usize];
    source.read_exact(&mut bytes).ok()?;
    Some(bytes)
}
