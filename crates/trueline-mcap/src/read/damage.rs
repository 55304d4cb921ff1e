//! Fault of a recording, and the data missing because of it.

use std::fmt;
use std::path::PathBuf;

/// Something in a file that cannot be read. Everything else was read.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Damage {
    /// The file has no bytes.
    Empty,
    /// The file does not begin as MCAP does.
    NotMcap,
    /// A chunk with altered bytes.
    Chunk {
        /// Its start, bytes from the start of the file.
        offset: u64,
        /// Its length, bytes.
        length: u64,
        /// Earliest log time in it by its own account, ns.
        start_ns: u64,
        /// Latest log time in it by its own account, ns.
        end_ns: u64,
        /// Messages of it that could be read.
        kept: usize,
        /// The inconsistency.
        why: String,
    },
    /// A record outside of chunks, or inside a good one, that makes no sense.
    Record {
        /// Its start, or that of its chunk, bytes from the start of the file.
        offset: u64,
        /// The inconsistency.
        why: String,
    },
    /// Bytes that are not records.
    Skipped {
        /// Their start, bytes from the start of the file.
        from: u64,
        /// Start of the following records.
        to: u64,
        /// The inconsistency.
        why: String,
    },
    /// The file was not finished: its writer was stopped, or it was cut off.
    Truncated {
        /// End of the last whole record, bytes from the start of the file.
        offset: u64,
        /// Bytes after it.
        lost: u64,
    },
    /// Something was altered outside of chunks.
    DataChecksum,
    /// The recording's statements about itself were altered.
    AboutChecksum,
    /// Messages without a channel that states their kind.
    UnknownChannel {
        /// The number of their topic.
        id: u16,
        /// Their number.
        messages: usize,
    },
    /// A data base that cannot be read to its end.
    Database {
        /// Messages read before.
        read: usize,
        /// Error of SQLite.
        why: String,
    },
    /// A message of a data base that cannot be read.
    Row {
        /// Which message of the data base it is, from 1.
        number: usize,
        /// The inconsistency.
        why: String,
    },
    /// Messages of a data base without a topic that states their kind.
    UnknownTopic {
        /// The number of their topic.
        id: i64,
        /// Their number.
        messages: usize,
    },
    /// A compressed file that cannot be read to its end.
    Compressed {
        /// The inconsistency.
        why: String,
    },
    /// A file that the recording's own list names is not there.
    MissingPart,
    /// A file that the recording's own list does not name; it was not read.
    UnlistedPart,
}

impl fmt::Display for Damage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty => write!(f, "the file is empty"),
            Self::NotMcap => write!(f, "the file does not begin as MCAP does"),
            Self::Chunk { offset, length, start_ns, end_ns, kept, why } => {
                let span_s = end_ns.saturating_sub(*start_ns) as f64 * 1e-9;
                write!(f, "a chunk of {length} bytes at byte {offset} is damaged ({why}): ")?;
                write!(f, "{span_s:.3} s of messages are missing, {kept} could be read")
            }
            Self::Record { offset, why } => write!(f, "a record at byte {offset} is damaged ({why})"),
            Self::Skipped { from, to, why } => {
                write!(f, "bytes {from} to {to} are not records ({why})")
            }
            Self::Truncated { offset, lost } => {
                write!(f, "the recording was not finished; it can be read up to byte {offset}")?;
                if *lost > 0 { write!(f, ", the {lost} bytes after it are lost") } else { Ok(()) }
            }
            Self::DataChecksum => write!(f, "the checksum of the file does not fit"),
            Self::AboutChecksum => write!(f, "the summary of the recording was altered"),
            Self::UnknownChannel { id, messages } => {
                write!(f, "{messages} messages of topic number {id}, which nothing describes")
            }
            Self::Database { read, why } => {
                write!(f, "the data base cannot be read behind message {read} ({why})")
            }
            Self::Row { number, why } => write!(f, "message {number} of the data base is damaged ({why})"),
            Self::UnknownTopic { id, messages } => {
                write!(f, "{messages} messages of topic number {id}, which nothing describes")
            }
            Self::Compressed { why } => write!(f, "the compressed file cannot be read to its end ({why})"),
            Self::UnlistedPart => write!(f, "was not read, because metadata.yaml does not name it"),
            Self::MissingPart => write!(f, "the file is missing, though metadata.yaml names it"),
        }
    }
}

/// Damage, and in which file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DamagedFile {
    /// The file.
    pub file: PathBuf,
    /// The fault.
    pub damage: Damage,
}

impl fmt::Display for DamagedFile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.file.display(), self.damage)
    }
}
