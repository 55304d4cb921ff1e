//! Content of a recording, item by item.

use crate::import_error::ImportError;
use crate::read::place::Place;
use std::collections::BTreeMap;

/// A message and its kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BagMessage<'a> {
    /// Its topic.
    pub topic: &'a str,
    /// Name of its type.
    pub schema: &'a str,
    /// How it is encoded.
    pub encoding: &'a str,
    /// Its number, where messages have numbers.
    pub sequence: u32,
    /// When it was recorded, ns.
    pub log_time: u64,
    /// Its time of publication, ns; the time of recording if no other is known.
    pub publish_time: u64,
    /// Its bytes.
    pub bytes: &'a [u8],
    /// Place at which it can be read again.
    pub place: Place,
}

/// Item of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BagItem<'a> {
    /// A message.
    Message(BagMessage<'a>),
    /// A file inside the file.
    Attachment {
        /// Its name.
        name: &'a str,
        /// Its bytes.
        data: &'a [u8],
    },
    /// Words by keys.
    Metadata {
        /// Their topic.
        name: &'a str,
        /// The words.
        values: &'a BTreeMap<String, String>,
    },
    /// The profile of a file, told before its other items.
    Profile(&'a str),
}

/// Function called with every item.
pub(crate) type Visit<'a> = dyn FnMut(BagItem<'_>) -> Result<(), ImportError> + 'a;
