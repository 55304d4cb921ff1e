//! What is found in a recording, item by item.

use crate::import_error::ImportError;
use crate::read::place::Place;
use std::collections::BTreeMap;

/// A message and what it is.
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
    /// When it was published, ns; when it was recorded where that is all that is known.
    pub publish_time: u64,
    /// Its bytes.
    pub bytes: &'a [u8],
    /// Where it can be read again.
    pub place: Place,
}

/// What a recording holds.
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
        /// What they are about.
        name: &'a str,
        /// The words.
        values: &'a BTreeMap<String, String>,
    },
    /// The profile of a file, told before its other items.
    Profile(&'a str),
}

/// What is done with every item.
pub(crate) type Visit<'a> = dyn FnMut(BagItem<'_>) -> Result<(), ImportError> + 'a;
