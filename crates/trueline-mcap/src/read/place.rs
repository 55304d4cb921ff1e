//! Where a message is, so that it can be read again without reading everything.

/// A message's place in a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Which file of the recording.
    pub file: usize,
    /// Where in that file.
    pub record: RecordPlace,
}

/// A message's place in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RecordPlace {
    /// In a chunk of an MCAP file.
    Chunk {
        /// Where the chunk begins, bytes from the start of the file.
        offset: u64,
        /// Which of the chunk's records it is, from 0.
        number: usize,
    },
    /// Outside of chunks in an MCAP file.
    Record {
        /// Where it begins, bytes from the start of the file.
        offset: u64,
    },
    /// In a data base.
    Row {
        /// Its id.
        id: i64,
    },
}
