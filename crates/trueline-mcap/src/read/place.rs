//! Place of a message, to read it again without the rest of the file.

/// A message's place in a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// The file of the recording.
    pub file: usize,
    /// Place in that file.
    pub record: RecordPlace,
}

/// A message's place in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RecordPlace {
    /// In a chunk of an MCAP file.
    Chunk {
        /// Start of the chunk, bytes from the start of the file.
        offset: u64,
        /// Which of the chunk's records it is, from 0.
        number: usize,
    },
    /// Outside of chunks in an MCAP file.
    Record {
        /// Its start, bytes from the start of the file.
        offset: u64,
    },
    /// In a data base.
    Row {
        /// Its id.
        id: i64,
    },
}
