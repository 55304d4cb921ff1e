//! Data bases of rosbag2.

use crate::bag::{BagItem, BagMessage, Visit};
use crate::bag_files::ZSTD;
use crate::chunk::RECORD_LIMIT;
use crate::damage::Damage;
use crate::import_error::ImportError;
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
pub fn read(file: &Path, visit: &mut Visit<'_>) -> Result<Vec<Damage>, ImportError> {
    let refused =
        |error: rusqlite::Error| ImportError::Database { file: file.to_owned(), why: error.to_string() };
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let base = Connection::open_with_flags(file, flags).map_err(refused)?;
    let topics = topics(&base).map_err(refused)?;
    // By their numbers, not by time: that needs no index, and what comes before damage is read.
    let mut query =
        base.prepare("SELECT topic_id, timestamp, data FROM messages ORDER BY id").map_err(refused)?;
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
            Ok((id, time, bytes)) => match topics.get(&id) {
                Some(topic) => visit(topic.item(time, &bytes))?,
                None => *unknown.entry(id).or_default() += 1,
            },
            Err(why) => damages.push(Damage::Row { number: read, why }),
        }
    }
    let unknown = unknown.into_iter().map(|(id, messages)| Damage::UnknownTopic { id, messages });
    damages.extend(unknown);
    Ok(damages)
}

impl Topic {
    fn item<'a>(&'a self, time: u64, bytes: &'a [u8]) -> BagItem<'a> {
        BagItem::Message(BagMessage {
            topic: &self.name,
            schema: &self.schema,
            encoding: &self.encoding,
            sequence: 0,
            log_time: time,
            publish_time: time,
            bytes,
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

type Message<'a> = (i64, u64, Cow<'a, [u8]>);

fn message<'a>(row: &'a Row<'_>) -> Result<Message<'a>, String> {
    let words = |error: rusqlite::Error| error.to_string();
    let id = row.get(0).map_err(words)?;
    let time = u64::try_from(row.get::<_, i64>(1).map_err(words)?).map_err(|_| "a time before 1970")?;
    let bytes = row.get_ref(2).map_err(words)?.as_blob().map_err(|error| error.to_string())?;
    Ok((id, time, uncompressed(bytes)?))
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
