//! A recording as files: one, or several that follow one another, of whatever kind.

use crate::bag_files::{Part, Storage, parts};
use crate::damage::Damage;
use crate::import_error::ImportError;
use crate::log_reader::{Item, LogReader};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

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

/// Damage, and in which file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DamagedFile {
    /// The file.
    pub file: PathBuf,
    /// What is wrong with it.
    pub damage: Damage,
}

impl std::fmt::Display for DamagedFile {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.file.display(), self.damage)
    }
}

/// What is done with every item.
pub type Visit<'a> = dyn FnMut(BagItem<'_>) -> Result<(), ImportError> + 'a;

/// An opened recording; it can be read more than once.
pub struct Bag {
    parts: Vec<Part>,
    damages: Vec<DamagedFile>,
}

impl Bag {
    /// Opens an .mcap file, a folder of rosbag2 (with or without its metadata.yaml), a .db3 or .db3.zstd file. What a file
    /// is, its first bytes tell.
    ///
    /// # Errors
    /// Files that cannot be opened or are something else.
    pub fn open(path: &Path) -> Result<Self, ImportError> {
        let (parts, damages) = parts(path)?;
        Ok(Self { parts, damages })
    }

    /// Reads everything, file by file, in the order of the files; returns what is damaged.
    ///
    /// # Errors
    /// What `visit` says, and what the operating system says.
    pub fn read(&self, visit: &mut Visit<'_>) -> Result<Vec<DamagedFile>, ImportError> {
        let mut damages = self.damages.clone();
        for part in &self.parts {
            let found = match part.storage {
                Storage::Mcap => read_mcap(&part.path, visit)?,
                #[cfg(feature = "rosbag2")]
                Storage::Sqlite => crate::sqlite_bag::read(&part.path, visit)?,
            };
            let file = &part.name;
            damages.extend(found.into_iter().map(|damage| DamagedFile { file: file.clone(), damage }));
        }
        Ok(damages)
    }
}

fn read_mcap(file: &Path, visit: &mut Visit<'_>) -> Result<Vec<Damage>, ImportError> {
    let io = |error: std::io::Error| ImportError::io(file, &error);
    let mut reader = LogReader::open(BufReader::new(File::open(file).map_err(io)?)).map_err(io)?;
    let mut profile_told = false;
    while let Some(item) = reader.next_item().map_err(io)? {
        if let (false, Some(profile)) = (profile_told, reader.profile()) {
            visit(BagItem::Profile(profile))?;
            profile_told = true;
        }
        match &item {
            Item::Message { channel, sequence, log_time, publish_time, data } => {
                visit(BagItem::Message(BagMessage {
                    topic: &channel.topic,
                    schema: channel.schema.as_ref().map_or("", |schema| schema.name.as_str()),
                    encoding: &channel.message_encoding,
                    sequence: *sequence,
                    log_time: *log_time,
                    publish_time: *publish_time,
                    bytes: data,
                }))?;
            }
            Item::Attachment { name, data } => visit(BagItem::Attachment { name, data })?,
            Item::Metadata { name, values } => visit(BagItem::Metadata { name, values })?,
        }
    }
    Ok(reader.damages().to_vec())
}
