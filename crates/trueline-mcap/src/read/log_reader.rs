//! Reads an MCAP file as far as it can be trusted: damage is reported, and reading continues behind it.
//!
//! The readers of the MCAP library either end at the first damage or return altered bytes as good ones. Here chunks are
//! copied whole and read separately, checksum first. If the framing is lost, the next plausible chunk is searched.

use crate::read::chunk::{self, ChunkHead, ChunkRecords, FRAME_BYTES, READ_BLOCK, RECORD_LIMIT};
use crate::read::damage::Damage;
use crate::read::inner_lengths;
use crate::read::place::RecordPlace;
use crate::read::summary;
use crate::wire::about::{ABOUT_RECORD, is_whole};
use crate::wire::topics::{PROFILE, known_channel};
use mcap::read::ChannelAccumulator;
use mcap::records::{Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{Channel, MAGIC, McapError};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;
use std::sync::Arc;

/// Item of a file.
#[derive(Clone, Debug, PartialEq)]
pub enum Item {
    /// A message.
    Message {
        /// Its topic and schema.
        channel: Arc<Channel<'static>>,
        /// Its number.
        sequence: u32,
        /// When it was recorded, ns.
        log_time: u64,
        /// When it was published, ns.
        publish_time: u64,
        /// Its bytes.
        data: Vec<u8>,
        /// Place at which it can be read again.
        place: RecordPlace,
    },
    /// A file inside the file.
    Attachment {
        /// Its name.
        name: String,
        /// Its bytes.
        data: Vec<u8>,
    },
    /// Words by keys.
    Metadata {
        /// Their topic.
        name: String,
        /// The words.
        values: BTreeMap<String, String>,
    },
}

/// Reads one file, item by item.
pub struct LogReader<R> {
    source: R,
    length: u64,
    records: LinearReader,
    /// Start of the next record.
    offset: u64,
    at_start: bool,
    data_ended: bool,
    /// Messages are in chunks and nowhere else.
    in_chunks: bool,
    done: bool,
    seen: ChannelAccumulator<'static>,
    from_summary: Option<ChannelAccumulator<'static>>,
    profile: Option<String>,
    item: Option<Item>,
    chunk: Option<OpenChunk>,
    orphans: BTreeMap<u16, usize>,
    damages: Vec<Damage>,
}

/// The chunk that is being read.
struct OpenChunk {
    records: ChunkRecords,
    head: ChunkHead,
    /// Its start.
    offset: u64,
    /// Bytes of its body.
    length: usize,
    /// Number of the next record.
    number: usize,
    /// Messages that could be read.
    kept: usize,
}

fn options() -> LinearReaderOptions {
    LinearReaderOptions::default()
        .with_emit_chunks(true)
        .with_skip_end_magic(true)
        .with_record_length_limit(RECORD_LIMIT)
}

impl<R: Read + Seek> LogReader<R> {
    /// Looks at a file.
    ///
    /// # Errors
    /// Error of the operating system. Any fault of the content is a [`Damage`].
    pub fn open(mut source: R) -> io::Result<Self> {
        let length = source.seek(SeekFrom::End(0))?;
        let from_summary = summary::topics(&mut source, length);
        source.seek(SeekFrom::Start(0))?;
        Ok(Self {
            source,
            length,
            records: LinearReader::new_with_options(options().with_validate_data_section_crc(true)),
            offset: MAGIC.len() as u64,
            at_start: true,
            data_ended: false,
            in_chunks: false,
            done: length == 0,
            seen: ChannelAccumulator::default(),
            from_summary,
            profile: None,
            item: None,
            chunk: None,
            orphans: BTreeMap::new(),
            damages: if length == 0 { vec![Damage::Empty] } else { Vec::new() },
        })
    }

    /// The profile that the header names, once it was read.
    #[must_use]
    pub fn profile(&self) -> Option<&str> {
        self.profile.as_deref()
    }

    /// Damage found so far; all of it after the last item.
    #[must_use]
    pub fn damages(&self) -> &[Damage] {
        &self.damages
    }

    /// The next item in the order of the file; `None` at the end.
    ///
    /// # Errors
    /// Error of the operating system, and a compression that this build lacks (`Unsupported`).
    pub fn next_item(&mut self) -> io::Result<Option<Item>> {
        loop {
            if let Some(item) = self.item.take() {
                return Ok(Some(item));
            }
            if let Some(open) = self.chunk.take() {
                self.step_in_chunk(open)?;
                continue;
            }
            if self.done {
                let orphans = std::mem::take(&mut self.orphans);
                let unknown =
                    orphans.into_iter().map(|(id, messages)| Damage::UnknownChannel { id, messages });
                self.damages.extend(unknown);
                return Ok(None);
            }
            self.step()?;
        }
    }

    fn step(&mut self) -> io::Result<()> {
        let offset = self.offset;
        let (opcode, body) = match self.records.next_event() {
            Some(Ok(LinearReadEvent::ReadRequest(wanted))) => {
                let got = self.source.read(self.records.insert(wanted.clamp(1, READ_BLOCK)))?;
                self.records.notify_read(got);
                return Ok(());
            }
            Some(Ok(LinearReadEvent::Record { opcode, data })) => (opcode, data.to_vec()),
            Some(Err(McapError::BadMagic)) if self.at_start => {
                self.damages.push(Damage::NotMcap);
                return self.resync(0, "the file does not begin as MCAP does");
            }
            Some(Err(McapError::BadDataCrc { .. })) => {
                // Every chunk has its own checksum: this one shows that something else was altered. The library would
                // say it again and again.
                self.damages.push(Damage::DataChecksum);
                self.data_ended = true;
                return self.restart(offset + FRAME_BYTES + 4);
            }
            Some(Err(error)) => return self.resync(offset, &error.to_string()),
            None => {
                self.done = true;
                if !self.ends_properly() {
                    let lost = self.length.saturating_sub(offset);
                    self.damages.push(Damage::Truncated { offset, lost });
                }
                return Ok(());
            }
        };
        self.offset += FRAME_BYTES + body.len() as u64;
        self.record(offset, opcode, &body)
    }

    fn ends_properly(&self) -> bool {
        self.data_ended && self.offset + MAGIC.len() as u64 == self.length
    }

    fn record(&mut self, offset: u64, opcode: u8, body: &[u8]) -> io::Result<()> {
        // A chunk with an altered opcode still has a consistent head, and its own checksum.
        let disguised = opcode != op::CHUNK
            && ChunkHead::read(body, body.len() as u64).is_some_and(|head| head.end == body.len());
        if disguised || !self.may_be_here(opcode, body) {
            self.damages
                .push(Damage::Record { offset, why: "it is of a kind that cannot be here".to_owned() });
            if disguised {
                self.restart(offset + FRAME_BYTES + body.len() as u64)?;
                return self.chunk(offset, body);
            }
            // A wrong footer ends the library's reader; behind any other record its length leads on.
            return if opcode == op::FOOTER { self.resync(offset, "a footer amid the file") } else { Ok(()) };
        }
        match opcode {
            op::DATA_END => self.data_ended = true,
            // The summary was read on its own.
            _ if self.data_ended => {}
            op::CHUNK => return self.chunk(offset, body),
            _ => {
                let accepted = chunk::parse(opcode, body)
                    .and_then(|record| self.accept(record, RecordPlace::Record { offset }));
                if let Err(error) = accepted {
                    self.damages.push(Damage::Record { offset, why: error.to_string() });
                }
                if inner_lengths::are_exceeded(opcode, body) {
                    return self.resync(offset, "a record is longer than the data in it");
                }
            }
        }
        Ok(())
    }

    fn may_be_here(&self, opcode: u8, body: &[u8]) -> bool {
        match opcode {
            // An index of a chunk that was altered can look like a message, which outside of chunks no checksum covers. A
            // writer of chunks writes nothing outside them.
            op::MESSAGE => !self.data_ended && !self.in_chunks,
            op::SCHEMA | op::CHANNEL => self.data_ended || !self.is_own(),
            op::FOOTER => {
                self.data_ended && body.len() == 20 && self.offset + MAGIC.len() as u64 >= self.length
            }
            op::CHUNK_INDEX
            | op::ATTACHMENT_INDEX
            | op::METADATA_INDEX
            | op::STATISTICS
            | op::SUMMARY_OFFSET => self.data_ended,
            op::DATA_END => !self.data_ended && body.len() == 4,
            op::HEADER | op::CHUNK | op::MESSAGE_INDEX | op::ATTACHMENT | op::METADATA => !self.data_ended,
            // Others may have records of their own; trueline has none.
            _ => opcode >= 0x80 && !self.is_own(),
        }
    }

    fn chunk(&mut self, offset: u64, body: &[u8]) -> io::Result<()> {
        self.in_chunks = true;
        let length = body.len() as u64;
        let Some(head) = ChunkHead::read(body, length) else {
            return self.resync(offset, "the head of a chunk does not add up");
        };
        let records = ChunkRecords::new(body.to_vec(), &head);
        self.chunk = Some(OpenChunk { records, head, offset, length: body.len(), number: 0, kept: 0 });
        Ok(())
    }

    fn step_in_chunk(&mut self, mut open: OpenChunk) -> io::Result<()> {
        let offset = open.offset;
        let fits = open.head.end == open.length;
        let beyond = "the length of a chunk does not fit its head";
        match open.records.next_record() {
            None if fits => {}
            // All of it was read; its length may lead over others.
            None => return self.resync(offset, beyond),
            Some(Ok(record)) => {
                let place = RecordPlace::Chunk { offset, number: open.number };
                if let Err(error) = self.accept(record, place) {
                    self.damages.push(Damage::Record { offset, why: error.to_string() });
                }
                open.number += 1;
                open.kept += usize::from(self.item.is_some());
                self.chunk = Some(open);
            }
            Some(Err(error @ McapError::UnsupportedCompression(_))) => {
                return Err(io::Error::new(io::ErrorKind::Unsupported, error));
            }
            Some(Err(error)) => {
                let length = open.length as u64 + FRAME_BYTES;
                self.damages.push(open.head.damage(offset, length, open.kept, &error));
                if !fits {
                    return self.resync(offset, beyond);
                }
            }
        }
        Ok(())
    }

    fn accept(&mut self, record: Record<'static>, place: RecordPlace) -> Result<(), McapError> {
        match record {
            Record::Header(header) => {
                self.in_chunks |= header.profile == PROFILE;
                self.profile = Some(header.profile);
            }
            Record::Schema { header, data } => self.seen.add_schema(header, data)?,
            Record::Channel(channel) => self.seen.add_channel(channel)?,
            Record::Message { header, data } => match self.channel(header.channel_id) {
                Some(channel) => {
                    self.item = Some(Item::Message {
                        channel,
                        sequence: header.sequence,
                        log_time: header.log_time,
                        publish_time: header.publish_time,
                        data: data.into_owned(),
                        place,
                    })
                }
                None => *self.orphans.entry(header.channel_id).or_default() += 1,
            },
            Record::Attachment { header, data, .. } => {
                self.item = Some(Item::Attachment { name: header.name, data: data.into_owned() });
            }
            Record::Metadata(record) => {
                if self.is_own() && !(record.name == ABOUT_RECORD && is_whole(&record.metadata)) {
                    self.damages.push(Damage::AboutChecksum);
                }
                self.item = Some(Item::Metadata { name: record.name, values: record.metadata });
            }
            _ => {}
        }
        Ok(())
    }

    fn is_own(&self) -> bool {
        self.profile() == Some(PROFILE)
    }

    fn channel(&self, id: u16) -> Option<Arc<Channel<'static>>> {
        self.seen
            .get(id)
            .or_else(|| if self.is_own() { known_channel(id) } else { None })
            .or_else(|| self.from_summary.as_ref()?.get(id))
    }

    /// Continues at the beginning of a record with a new reader: the library's behaviour after an error is undefined.
    fn restart(&mut self, offset: u64) -> io::Result<()> {
        self.source.seek(SeekFrom::Start(offset))?;
        self.offset = offset;
        self.records = LinearReader::new_with_options(options().with_skip_start_magic(true));
        self.at_start = false;
        Ok(())
    }

    /// Continues at the next plausible chunk behind `from`; without one the file ends here.
    fn resync(&mut self, from: u64, why: &str) -> io::Result<()> {
        if let Some(to) = next_chunk(&mut self.source, from + 1, self.length)? {
            self.damages.push(Damage::Skipped { from, to, why: why.to_owned() });
            return self.restart(to);
        }
        self.done = true;
        let (from, to) = (from.min(self.length), self.length);
        let was_finished = self.from_summary.is_some();
        self.damages.push(if was_finished {
            Damage::Skipped { from, to, why: why.to_owned() }
        } else {
            Damage::Truncated { offset: from, lost: to - from }
        });
        Ok(())
    }
}

/// The bytes of the message in the record at `offset`; of the record of that number in a chunk.
pub(crate) fn message_at(file: &Path, offset: u64, number: Option<usize>) -> io::Result<Vec<u8>> {
    let changed = || io::Error::new(io::ErrorKind::InvalidData, "the file has changed since it was opened");
    let mut source = File::open(file)?;
    source.seek(SeekFrom::Start(offset))?;
    let mut frame = [0; FRAME_BYTES as usize];
    source.read_exact(&mut frame)?;
    let [opcode, length @ ..] = frame;
    let length = usize::try_from(u64::from_le_bytes(length)).map_err(|_| changed())?;
    if length > RECORD_LIMIT {
        return Err(changed());
    }
    let mut body = vec![0; length];
    source.read_exact(&mut body)?;
    let record = match number {
        Some(number) => {
            let head = ChunkHead::read(&body, length as u64).ok_or_else(changed)?;
            let mut records = ChunkRecords::new(body, &head);
            std::iter::from_fn(|| records.next_record()?.ok()).nth(number)
        }
        None => chunk::parse(opcode, &body).ok(),
    };
    match record {
        Some(Record::Message { data, .. }) => Ok(data.into_owned()),
        _ => Err(changed()),
    }
}

/// Start of the next chunk with a head that agrees with its length.
fn next_chunk<R: Read + Seek>(source: &mut R, from: u64, length: u64) -> io::Result<Option<u64>> {
    /// Longest head of a chunk with its frame, rounded up.
    const HEAD: usize = 64;
    let mut at = from;
    let mut block = Vec::new();
    while at < length {
        block.clear();
        source.seek(SeekFrom::Start(at))?;
        source.by_ref().take((READ_BLOCK + HEAD) as u64).read_to_end(&mut block)?;
        for (k, rest) in block.iter().enumerate().take(READ_BLOCK).map(|(k, _)| (k, &block[k..])) {
            let position = at + k as u64;
            let [op::CHUNK, tail @ ..] = rest else { continue };
            let Some((bytes, body)) = tail.split_first_chunk::<8>() else { continue };
            let record = u64::from_le_bytes(*bytes);
            let fits = record <= RECORD_LIMIT as u64 && position + FRAME_BYTES + record <= length;
            if fits && ChunkHead::read(body, record).is_some_and(|head| head.end as u64 == record) {
                return Ok(Some(position));
            }
        }
        at += READ_BLOCK as u64;
    }
    Ok(None)
}
