//! A picture that stays in its place.

use crate::read::place::Place;

/// A picture that was found in a recording.
pub(super) struct StoredPicture {
    pub stamp_ns: i64,
    pub sequence: u32,
    pub place: Place,
    /// Its type in the list of types.
    pub message_type: usize,
}

/// How a picture's message is to be read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct MessageType {
    pub schema: String,
    pub encoding: String,
}

/// A picture with all data of its frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RecordedFrame {
    pub stamp_ns: i64,
    pub frame: u64,
    pub device_ns: Option<i64>,
    pub place: Place,
    pub message_type: usize,
}
