//! One recording being written: entries in, MCAP out.

use crate::wire::about::{ABOUT_RECORD, About, SENSOR_ATTACHMENT};
use crate::wire::encode::{Outgoing, messages};
use crate::wire::topics::{self, ENCODING, PROFILE, TOPICS};
use crate::write::entry::Entry;
use crate::write::listener::Heard;
use crate::write::sink::{SharedSink, Sink};
use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, McapError, WriteOptions};
use std::collections::BTreeMap;
use std::time::{SystemTime, UNIX_EPOCH};

/// A chunk is closed at this size, bytes before compression. A program's end loses the data of the open chunk.
const CHUNK_BYTES: u64 = 256 * 1024;

/// Writes a recording to a sink.
pub struct LogWriter<S: Sink> {
    writer: mcap::Writer<SharedSink<S>>,
    sink: SharedSink<S>,
    heard: Heard,
}

impl<S: Sink> LogWriter<S> {
    /// Writes the part before the first entry and hands it to the operating system.
    ///
    /// # Errors
    /// Error of the sink.
    pub fn new(sink: S, about: &About) -> Result<Self, McapError> {
        let sink = SharedSink::new(sink);
        let writer = options().create(sink.other_owner())?;
        let mut log = Self { writer, sink, heard: Heard::default() };
        log.write_about(about)?;
        for topic in TOPICS.iter() {
            log.writer.add_schema_with_id(topic.id, &topic.schema, ENCODING, &topic.descriptors)?;
            log.writer.add_channel_with_id(topic.id, topic.id, topic.name, ENCODING, &BTreeMap::new())?;
        }
        log.writer.flush()?;
        log.sink.sync()?;
        Ok(log)
    }

    /// The same, heard by a listener as well.
    pub(crate) fn heard(self, heard: Heard) -> Self {
        Self { heard, ..self }
    }

    /// Adds an entry; it is with the operating system after the next [`LogWriter::flush`].
    ///
    /// # Errors
    /// Error of the sink.
    pub fn write(&mut self, entry: Entry) -> Result<(), McapError> {
        self.heard.entry(&entry);
        for Outgoing { topic, sequence, log_ns, publish_ns, bytes } in messages(entry) {
            self.heard.message(topics::name(topic), log_ns, &bytes);
            // The bits are kept: a stamp before 1970 is a mistake somewhere else, and must be seen as it was.
            let header = MessageHeader {
                channel_id: topic,
                sequence,
                log_time: log_ns as u64,
                publish_time: publish_ns as u64,
            };
            self.writer.write_to_known_channel(&header, &bytes)?;
        }
        Ok(())
    }

    /// Hands everything to the operating system.
    ///
    /// # Errors
    /// Error of the sink.
    pub fn flush(&mut self) -> Result<(), McapError> {
        self.writer.flush()
    }

    /// Makes everything that was flushed survive a loss of power.
    ///
    /// # Errors
    /// Error of the sink.
    pub fn sync(&mut self) -> Result<(), McapError> {
        Ok(self.sink.sync()?)
    }

    /// Bytes written.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.sink.bytes()
    }

    /// Writes the index and ends the recording; returns its bytes.
    ///
    /// # Errors
    /// Error of the sink.
    pub fn finish(mut self) -> Result<u64, McapError> {
        self.writer.finish()?;
        self.sink.sync()?;
        Ok(self.sink.bytes())
    }

    /// Ends without an index: after a failure nothing more is to be written.
    pub fn abandon(self) {
        self.writer.into_inner();
    }

    fn write_about(&mut self, about: &About) -> Result<(), McapError> {
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let now_ns = u64::try_from(now.as_nanos()).unwrap_or(u64::MAX);
        let record = Metadata { name: ABOUT_RECORD.to_owned(), metadata: about.record() };
        self.writer.write_metadata(&record)?;
        if let Some(text) = &about.sensor_toml {
            self.writer.attach(&Attachment {
                log_time: now_ns,
                create_time: now_ns,
                name: SENSOR_ATTACHMENT.to_owned(),
                media_type: "application/toml".to_owned(),
                data: text.as_bytes().into(),
            })?;
        }
        Ok(())
    }
}

fn options() -> WriteOptions {
    packed(WriteOptions::new())
        .profile(PROFILE)
        .library(concat!("trueline ", env!("CARGO_PKG_VERSION")))
        .chunk_size(Some(CHUNK_BYTES))
        // A chunk reaches the file only when it is complete: everything in the file can be read.
        .disable_seeking(true)
        // Readers rely on it: without a checksum, altered bytes look like good ones.
        .calculate_chunk_crcs(true)
}

#[cfg(feature = "compression")]
fn packed(options: WriteOptions) -> WriteOptions {
    let zstd = options.compression(Some(mcap::Compression::Zstd)).compression_level(1);
    // Else every recording starts as many threads as there are processors.
    zstd.compression_threads(0)
}

#[cfg(not(feature = "compression"))]
fn packed(options: WriteOptions) -> WriteOptions {
    options.compression(None)
}

/// The whole message: the error of the MCAP library omits that of the operating system.
pub fn words(error: &McapError) -> String {
    match error {
        McapError::Io(error) => error.to_string(),
        other => other.to_string(),
    }
}
