//! A recording as files: one, or several in sequence, of any kind.

use crate::import_error::ImportError;
use crate::read::bag_files::{Part, Storage, parts};
use crate::read::bag_item::{BagItem, BagMessage, Visit};
use crate::read::damage::{Damage, DamagedFile};
use crate::read::log_reader::{Item, LogReader, message_at};
use crate::read::place::{Place, RecordPlace};
use mcap::McapError;
use std::fs::File;
use std::io::{self, BufReader};
use std::path::Path;

/// An opened recording; it can be read more than once.
pub struct Bag {
    parts: Vec<Part>,
    damages: Vec<DamagedFile>,
}

impl Bag {
    /// Opens an .mcap file, a folder of rosbag2 (with or without its metadata.yaml), a .db3 or .db3.zstd file. The first
    /// bytes of a file state its kind.
    ///
    /// # Errors
    /// Files that cannot be opened or are something else.
    pub fn open(path: &Path) -> Result<Self, ImportError> {
        let (parts, damages) = parts(path)?;
        Ok(Self { parts, damages })
    }

    /// Reads everything, file by file, in the order of the files; returns the damage.
    ///
    /// # Errors
    /// Error of `visit` or of the operating system.
    pub fn read(&self, visit: &mut Visit<'_>) -> Result<Vec<DamagedFile>, ImportError> {
        let mut damages = self.damages.clone();
        for (number, part) in self.parts.iter().enumerate() {
            let found = match part.storage {
                Storage::Mcap => read_mcap(&part.path, number, visit)?,
                #[cfg(feature = "rosbag2")]
                Storage::Sqlite => crate::read::sqlite_bag::read(&part.path, number, visit)?,
            };
            let file = &part.name;
            damages.extend(found.into_iter().map(|damage| DamagedFile { file: file.clone(), damage }));
        }
        Ok(damages)
    }

    /// The bytes of one message again.
    ///
    /// # Errors
    /// A file that has changed or cannot be read any more.
    pub(crate) fn read_again(&self, place: Place) -> Result<Vec<u8>, ImportError> {
        let part = &self.parts[place.file];
        let io = |error: io::Error| ImportError::io(&part.name, &error);
        match place.record {
            RecordPlace::Chunk { offset, number } => message_at(&part.path, offset, Some(number)).map_err(io),
            RecordPlace::Record { offset } => message_at(&part.path, offset, None).map_err(io),
            #[cfg(feature = "rosbag2")]
            RecordPlace::Row { id } => crate::read::sqlite_bag::read_row(&part.path, id),
            #[cfg(not(feature = "rosbag2"))]
            RecordPlace::Row { .. } => Err(ImportError::WithoutRosbag2 { file: part.name.clone() }),
        }
    }

    /// The files under the user's names.
    pub fn files(&self) -> impl Iterator<Item = &Path> {
        self.parts.iter().map(|part| part.name.as_path())
    }
}

fn read_mcap(file: &Path, number: usize, visit: &mut Visit<'_>) -> Result<Vec<Damage>, ImportError> {
    let io = |error: io::Error| refusal(file, &error);
    let mut reader = LogReader::open(BufReader::new(File::open(file).map_err(io)?)).map_err(io)?;
    let mut profile_told = false;
    while let Some(item) = reader.next_item().map_err(io)? {
        if let (false, Some(profile)) = (profile_told, reader.profile()) {
            visit(BagItem::Profile(profile))?;
            profile_told = true;
        }
        match &item {
            Item::Message { channel, sequence, log_time, publish_time, data, place } => {
                visit(BagItem::Message(BagMessage {
                    topic: &channel.topic,
                    schema: channel.schema.as_ref().map_or("", |schema| schema.name.as_str()),
                    encoding: &channel.message_encoding,
                    sequence: *sequence,
                    log_time: *log_time,
                    publish_time: *publish_time,
                    bytes: data,
                    place: Place { file: number, record: *place },
                }))?;
            }
            Item::Attachment { name, data } => visit(BagItem::Attachment { name, data })?,
            Item::Metadata { name, values } => visit(BagItem::Metadata { name, values })?,
        }
    }
    Ok(reader.damages().to_vec())
}

/// Reason that a file cannot be read to its end: the operating system, or a compression that this build lacks.
fn refusal(file: &Path, error: &io::Error) -> ImportError {
    match error.get_ref().and_then(|inner| inner.downcast_ref()) {
        Some(McapError::UnsupportedCompression(by)) => {
            ImportError::WithoutCompression { file: file.to_owned(), by: by.clone() }
        }
        _ => ImportError::io(file, error),
    }
}

#[cfg(test)]
mod tests {
    use super::{ImportError, refusal};
    use mcap::McapError;
    use std::io;
    use std::path::Path;

    #[test]
    fn a_compression_that_this_build_lacks_is_told_from_an_error_of_the_system() {
        let file = Path::new("scan.mcap");
        let lacking = McapError::UnsupportedCompression("zstd".to_owned());
        let lacking = refusal(file, &io::Error::new(io::ErrorKind::Unsupported, lacking));
        assert_eq!(
            lacking.to_string(),
            "scan.mcap: is compressed by zstd, and this program was built without that"
        );
        assert!(lacking.hint().contains("`compression`"));
        let of_system = refusal(file, &io::Error::from(io::ErrorKind::Unsupported));
        assert!(matches!(of_system, ImportError::Io { .. }));
    }
}
