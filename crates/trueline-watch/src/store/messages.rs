//! Alarm messages, stored with their weld until every receiver has accepted them.
//!
//! A message is written in the transaction of its weld, so neither exists without the other. Each receiver gets messages in
//! order and at least once: those after `told_up_to` are pending. A sender reserves the message for a while (`next_try_s`),
//! so two programs do not send it twice, and a killed sender loses nothing. Of a receiver's address, which may hold a
//! secret, only a hash is kept.

use super::schema::Store;
use super::store_error::StoreError;
use rusqlite::{OptionalExtension, params};
use sha2::{Digest, Sha256};

/// Older files are read without being changed.
const FIRST_WITH_RECEIVERS: i64 = 2;

/// A message that a receiver has not accepted yet.
#[derive(Clone, Debug, PartialEq)]
pub struct Message {
    /// Its number, which identifies repeated messages.
    pub id: i64,
    /// JSON.
    pub body: String,
    /// Number of earlier tries.
    pub tries: u32,
}

/// A receiver and its last accepted message.
#[derive(Clone, Debug, PartialEq)]
pub struct ReceiverRow {
    /// Its name: the host.
    pub name: String,
    /// Messages that it has not accepted yet.
    pub waiting: usize,
    /// Why the last try failed, if it did.
    pub error: Option<String>,
}

impl Store {
    /// Adds a message; to be called in the transaction of its weld.
    ///
    /// # Errors
    /// A database that cannot be written.
    pub fn add_message(&self, body: &str) -> Result<i64, StoreError> {
        let text = "INSERT INTO messages (body) VALUES (?1)";
        self.connection.execute(text, [body]).map_err(|e| self.failed(e))?;
        Ok(self.connection.last_insert_rowid())
    }

    /// The number of a receiver by its address. A new one gets messages from now on.
    ///
    /// # Errors
    /// A database that cannot be written.
    pub fn receiver(&self, address: &str, name: &str) -> Result<i64, StoreError> {
        let hash: String = Sha256::digest(address).iter().map(|byte| format!("{byte:02x}")).collect();
        let add = "INSERT INTO receivers (address_sha256, name, told_up_to) \
                   VALUES (?1, ?2, (SELECT coalesce(max(id), 0) FROM messages)) ON CONFLICT DO NOTHING";
        self.connection.execute(add, params![hash, name]).map_err(|e| self.failed(e))?;
        let find = "SELECT id FROM receivers WHERE address_sha256 = ?1";
        self.connection.query_row(find, [hash], |row| row.get(0)).map_err(|e| self.failed(e))
    }

    /// The next message for a receiver, if there is one and it is due; it is not due again before `again_s` (s since 1970 UTC).
    ///
    /// # Errors
    /// A database that cannot be written.
    pub fn take_message(
        &self,
        receiver: i64,
        now_s: i64,
        again_s: i64,
    ) -> Result<Option<Message>, StoreError> {
        let transaction = self.begin()?;
        let text = "SELECT messages.id, body, tries FROM receivers JOIN messages ON messages.id > told_up_to \
                    WHERE receivers.id = ?1 AND next_try_s <= ?2 ORDER BY messages.id LIMIT 1";
        let row =
            |row: &rusqlite::Row<'_>| Ok(Message { id: row.get(0)?, body: row.get(1)?, tries: row.get(2)? });
        let found = self.connection.query_row(text, [receiver, now_s], row).optional();
        let found = found.map_err(|e| self.failed(e))?;
        if found.is_some() {
            let text = "UPDATE receivers SET next_try_s = ?2, tries = tries + 1 WHERE id = ?1";
            self.connection.execute(text, [receiver, again_s]).map_err(|e| self.failed(e))?;
        }
        self.commit(transaction)?;
        Ok(found)
    }

    /// A receiver has accepted a message.
    ///
    /// # Errors
    /// A database that cannot be written.
    pub fn told(&self, receiver: i64, message: i64) -> Result<(), StoreError> {
        let text = "UPDATE receivers SET told_up_to = max(told_up_to, ?2), tries = 0, next_try_s = 0, error = NULL WHERE id = ?1";
        self.connection.execute(text, [receiver, message]).map(|_| ()).map_err(|e| self.failed(e))
    }

    /// A message could not be sent; it is due again at `again_s` (s since 1970 UTC).
    ///
    /// # Errors
    /// A database that cannot be written.
    pub fn not_told(&self, receiver: i64, again_s: i64, why: &str) -> Result<(), StoreError> {
        let text = "UPDATE receivers SET next_try_s = ?2, error = ?3 WHERE id = ?1";
        self.connection.execute(text, params![receiver, again_s, why]).map(|_| ()).map_err(|e| self.failed(e))
    }

    /// All receivers.
    ///
    /// # Errors
    /// A database that cannot be read.
    pub fn receivers(&self) -> Result<Vec<ReceiverRow>, StoreError> {
        if self.versions()?.1 < FIRST_WITH_RECEIVERS {
            return Ok(Vec::new());
        }
        let text = "SELECT name, (SELECT count(*) FROM messages WHERE messages.id > told_up_to), error FROM receivers ORDER BY id";
        let mut query = self.connection.prepare(text).map_err(|e| self.failed(e))?;
        let rows = query.query_map([], |row| {
            let waiting = row.get::<_, i64>(1)?.unsigned_abs() as usize;
            Ok(ReceiverRow { name: row.get(0)?, waiting, error: row.get(2)? })
        });
        rows.and_then(Iterator::collect).map_err(|e| self.failed(e))
    }
}
