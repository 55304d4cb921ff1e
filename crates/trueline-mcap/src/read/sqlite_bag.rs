//! Data bases of rosbag2.

use crate::import_error::ImportError;
use crate::read::bag_files::ZSTD;
use crate::read::bag_item::{BagItem, BagMessage, Visit};
use crate::read::chunk::RECORD_LIMIT;
use crate::read::damage::Damage;
use crate::read::place::{Place, RecordPlace};
use rusqlite::{Connection, OpenFlags, Row};
use std::borrow::Cow;
use std::collections::HashMap;
use std::io::Read;
use std::path::Path;

struct Topic {
    name: String,
    schema: String,
    encoding: String,
}

/// Reads all messages in the order in which they were written.
pub(super) fn read(file: &Path, number: usize, visit: &mut Visit<'_>) -> Result<Vec<Damage>, ImportError> {
    let refused =
        |error: rusqlite::Error| ImportError::Database { file: file.to_owned(), why: error.to_string() };
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let base = Connection::open_with_flags(file, flags).map_err(refused)?;
    let topics = topics(&base).map_err(refused)?;
    // By their numbers, not by time: that needs no index, and the data before a damage are read.
    let mut query =
        base.prepare("SELECT topic_id, timestamp, data, id FROM messages ORDER BY id").map_err(refused)?;
    let mut rows = query.query([]).map_err(refused)?;
    let mut damages = Vec::new();
    let mut unknown: HashMap<i64, usize> = HashMap::new();
    let mut read = 0;
    loop {
        let row = match rows.next() {
            Ok(Some(row)) => row,
            Ok(None) => break,
            Err(error) => {
                damages.push(Damage::Database { read, why: error.to_string() });
                break;
            }
        };
        read += 1;
        match message(row) {
            Ok(message) => match topics.get(&message.topic) {
                Some(topic) => visit(topic.item(&message, number))?,
                None => *unknown.entry(message.topic).or_default() += 1,
            },
            Err(why) => damages.push(Damage::Row { number: read, why }),
        }
    }
    let unknown = unknown.into_iter().map(|(id, messages)| Damage::UnknownTopic { id, messages });
    damages.extend(unknown);
    Ok(damages)
}

impl Topic {
    fn item<'a>(&'a self, message: &'a Message<'_>, number: usize) -> BagItem<'a> {
        BagItem::Message(BagMessage {
            topic: &self.name,
            schema: &self.schema,
            encoding: &self.encoding,
            sequence: 0,
            log_time: message.time,
            publish_time: message.time,
            bytes: &message.bytes,
            place: Place { file: number, record: RecordPlace::Row { id: message.id } },
        })
    }
}

fn topics(base: &Connection) -> rusqlite::Result<HashMap<i64, Topic>> {
    let mut query = base.prepare("SELECT id, name, type, serialization_format FROM topics")?;
    let rows = query.query_map([], |row| {
        let topic = Topic { name: row.get(1)?, schema: row.get(2)?, encoding: row.get(3)? };
        Ok((row.get(0)?, topic))
    })?;
    rows.collect()
}

struct Message<'a> {
    id: i64,
    topic: i64,
    time: u64,
    bytes: Cow<'a, [u8]>,
}

fn message<'a>(row: &'a Row<'_>) -> Result<Message<'a>, String> {
    let words = |error: rusqlite::Error| error.to_string();
    let (topic, id) = (row.get(0).map_err(words)?, row.get(3).map_err(words)?);
    let time = u64::try_from(row.get::<_, i64>(1).map_err(words)?).map_err(|_| "a time before 1970")?;
    let bytes = row.get_ref(2).map_err(words)?.as_blob().map_err(|error| error.to_string())?;
    Ok(Message { id, topic, time, bytes: uncompressed(bytes)? })
}

/// The bytes of the message with an id.
pub(super) fn read_row(file: &Path, id: i64) -> Result<Vec<u8>, ImportError> {
    let refused = |why: String| ImportError::Database { file: file.to_owned(), why };
    let words = |error: rusqlite::Error| refused(error.to_string());
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let base = Connection::open_with_flags(file, flags).map_err(words)?;
    let bytes: Vec<u8> =
        base.query_row("SELECT data FROM messages WHERE id = ?1", [id], |row| row.get(0)).map_err(words)?;
    Ok(uncompressed(&bytes).map_err(refused)?.into_owned())
}

/// A message that was compressed on its own begins as no message of CDR does.
fn uncompressed(bytes: &[u8]) -> Result<Cow<'_, [u8]>, String> {
    if !bytes.starts_with(ZSTD) {
        return Ok(Cow::Borrowed(bytes));
    }
    let mut message = Vec::new();
    let decoder = zstd::Decoder::new(bytes).map_err(|error| error.to_string())?;
    let most = RECORD_LIMIT as u64;
    let read = decoder.take(most + 1).read_to_end(&mut message).map_err(|error| error.to_string())?;
    if read > RECORD_LIMIT {
        Err("it is larger than any message".to_owned())
    } else {
        Ok(Cow::Owned(message))
    }
}
