//! The file, its tables, and how older ones become newer.

use super::store_error::StoreError;
use rusqlite::{Connection, ErrorCode};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// The newest version of the tables.
pub const SCHEMA_VERSION: i64 = MIGRATIONS.len() as i64;

/// "true" in ASCII: the owner of the database.
const APPLICATION_ID: i64 = 0x7472_7565;

/// Steps from each version to the next; none of them is ever changed.
const MIGRATIONS: [&str; 5] = [VERSION_1, VERSION_2, VERSION_3, VERSION_4, VERSION_5];

const VERSION_1: &str = "
CREATE TABLE calibrations (
    id INTEGER PRIMARY KEY,
    sha256 TEXT NOT NULL UNIQUE,
    name TEXT NOT NULL,
    added_s INTEGER NOT NULL,
    time_offset_s REAL NOT NULL,
    shape_origin_a_m REAL NOT NULL,
    shape_origin_b_m REAL NOT NULL
) STRICT;
CREATE TABLE parts (
    id INTEGER PRIMARY KEY,
    calibration INTEGER NOT NULL REFERENCES calibrations (id),
    seams BLOB NOT NULL,
    scatter BLOB
) STRICT;
CREATE TABLE welds (
    id INTEGER PRIMARY KEY,
    calibration INTEGER NOT NULL REFERENCES calibrations (id),
    part INTEGER NOT NULL REFERENCES parts (id),
    content TEXT NOT NULL,
    name TEXT NOT NULL,
    watched_s INTEGER NOT NULL,
    used INTEGER NOT NULL,
    outliers INTEGER NOT NULL,
    noise_factor REAL NOT NULL,
    estimates BLOB NOT NULL,
    p_log10 BLOB NOT NULL,
    line TEXT NOT NULL,
    statistic BLOB,
    UNIQUE (calibration, content)
) STRICT;
CREATE INDEX welds_by_calibration ON welds (calibration, id);
CREATE INDEX welds_with_statistic ON welds (calibration, id) WHERE statistic IS NOT NULL;
CREATE TABLE alarms (
    weld INTEGER PRIMARY KEY REFERENCES welds (id),
    kind TEXT NOT NULL,
    since INTEGER NOT NULL REFERENCES welds (id),
    p_log10 REAL NOT NULL
) STRICT;
";

/// Alarm messages and receivers; alarms are deleted with their weld, and may name a deleted one.
const VERSION_2: &str = "
CREATE TABLE alarms_2 (
    weld INTEGER PRIMARY KEY REFERENCES welds (id) ON DELETE CASCADE,
    kind TEXT NOT NULL,
    since INTEGER NOT NULL,
    p_log10 REAL NOT NULL
) STRICT;
INSERT INTO alarms_2 SELECT weld, kind, since, p_log10 FROM alarms;
DROP TABLE alarms;
ALTER TABLE alarms_2 RENAME TO alarms;
CREATE TABLE messages (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    body TEXT NOT NULL
) STRICT;
CREATE TABLE receivers (
    id INTEGER PRIMARY KEY,
    address_sha256 TEXT NOT NULL UNIQUE,
    name TEXT NOT NULL,
    told_up_to INTEGER NOT NULL,
    tries INTEGER NOT NULL DEFAULT 0,
    next_try_s INTEGER NOT NULL DEFAULT 0,
    error TEXT
) STRICT;
";

/// The number of welds of a calibration, kept as they come and go: counting a million of them takes a second, and a page asks for it
/// every two.
const VERSION_3: &str = "
ALTER TABLE calibrations ADD COLUMN welds INTEGER NOT NULL DEFAULT 0;
UPDATE calibrations SET welds = (SELECT count(*) FROM welds WHERE welds.calibration = calibrations.id);
CREATE TRIGGER weld_comes AFTER INSERT ON welds BEGIN
    UPDATE calibrations SET welds = welds + 1 WHERE id = NEW.calibration;
END;
CREATE TRIGGER weld_goes AFTER DELETE ON welds BEGIN
    UPDATE calibrations SET welds = welds - 1 WHERE id = OLD.calibration;
END;
";

/// Cuts of welds at changes, and whether an alarm is of a change within its tolerance. Of the welds that are there already
/// the next one finds the regimes anew.
const VERSION_4: &str = "
CREATE TABLE regimes (
    id INTEGER PRIMARY KEY,
    calibration INTEGER NOT NULL REFERENCES calibrations (id),
    first INTEGER NOT NULL,
    inside_s REAL,
    kind TEXT,
    part INTEGER,
    raised INTEGER,
    claimed INTEGER NOT NULL DEFAULT 0
) STRICT;
CREATE INDEX regimes_by_calibration ON regimes (calibration, id);
ALTER TABLE alarms ADD COLUMN within_tolerance INTEGER NOT NULL DEFAULT 0;
";

/// Statistics may end with the pose of an axis under the part. Older programs report that as damage. The tables stay.
const VERSION_5: &str = "";

/// The first version with regimes: older files are read without being changed.
pub(super) const FIRST_WITH_REGIMES: i64 = 4;

/// How long one program waits for another.
const PATIENCE: Duration = Duration::from_secs(30);
/// Time between two tries where the library does not wait.
const AGAIN: Duration = Duration::from_millis(5);

/// The state of a cell.
#[derive(Debug)]
pub struct Store {
    pub(super) connection: Connection,
    pub(super) file: PathBuf,
}

/// SQLite opens any path, and waits for a writer into a pipe.
fn expect_file(file: &Path) -> Result<(), StoreError> {
    if file.is_file() { Ok(()) } else { Err(StoreError::NoFile { file: file.to_owned() }) }
}

impl Store {
    /// Opens a state file, or makes a new one, and brings it up to date.
    ///
    /// # Errors
    /// A file that cannot be opened or written, of another program, or of a newer version.
    pub fn open(file: &Path) -> Result<Self, StoreError> {
        let failed = |source| StoreError::Database { file: file.to_owned(), source };
        if file.exists() {
            expect_file(file)?;
        }
        let connection = Connection::open(file).map_err(failed)?;
        let mut store = Self { connection, file: file.to_owned() };
        store.connection.busy_timeout(PATIENCE).map_err(failed)?;
        store.migrate()?;
        Ok(store)
    }

    /// Opens a state file to read it only.
    ///
    /// # Errors
    /// A file that is not there, or not one of this program and version.
    pub fn open_to_read(file: &Path) -> Result<Self, StoreError> {
        let failed = |source| StoreError::Database { file: file.to_owned(), source };
        if !file.exists() {
            return Err(StoreError::Missing { file: file.to_owned() });
        }
        expect_file(file)?;
        let flags = rusqlite::OpenFlags::SQLITE_OPEN_READ_ONLY;
        let connection = Connection::open_with_flags(file, flags).map_err(failed)?;
        connection.busy_timeout(PATIENCE).map_err(failed)?;
        let store = Self { connection, file: file.to_owned() };
        let (application, version) = store.versions()?;
        if application != APPLICATION_ID || version < 1 {
            return Err(StoreError::Foreign { file: file.to_owned() });
        }
        store.refuse_newer(version)?;
        Ok(store)
    }

    /// The name of the cell: that of the file, without its ending.
    #[must_use]
    pub fn cell(&self) -> String {
        self.file.file_stem().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
    }

    pub(super) fn versions(&self) -> Result<(i64, i64), StoreError> {
        let pragma = |name: &str| self.connection.pragma_query_value(None, name, |row| row.get::<_, i64>(0));
        let both = pragma("application_id").and_then(|id| Ok((id, pragma("user_version")?)));
        both.map_err(|source| self.failed(source))
    }

    fn refuse_newer(&self, found: i64) -> Result<(), StoreError> {
        if found > SCHEMA_VERSION {
            return Err(StoreError::Newer { file: self.file.clone(), found, known: SCHEMA_VERSION });
        }
        Ok(())
    }

    fn migrate(&mut self) -> Result<(), StoreError> {
        let file = self.file.clone();
        let failed = |source| StoreError::Database { file: file.clone(), source };
        // Readers never wait for a writer; a weld is on the disk before it is reported.
        let settings = "PRAGMA synchronous = FULL; PRAGMA foreign_keys = ON;";
        let (application, _) = self.versions()?;
        if application != 0 && application != APPLICATION_ID {
            return Err(StoreError::Foreign { file: file.clone() });
        }
        self.write_ahead().map_err(failed)?;
        self.connection.execute_batch(settings).map_err(failed)?;
        let behavior = rusqlite::TransactionBehavior::Immediate;
        // Other programs' changes are visible only inside the transaction.
        let transaction = rusqlite::Transaction::new_unchecked(&self.connection, behavior).map_err(failed)?;
        let (application, version) = self.versions()?;
        let tables: i64 = transaction
            .query_row("SELECT count(*) FROM sqlite_schema", [], |row| row.get(0))
            .map_err(failed)?;
        if application == 0 && tables > 0 {
            return Err(StoreError::Foreign { file: file.clone() });
        }
        self.refuse_newer(version)?;
        for (k, step) in MIGRATIONS.iter().enumerate().skip(usize::try_from(version).unwrap_or(0)) {
            transaction.execute_batch(step).map_err(failed)?;
            transaction.pragma_update(None, "user_version", k as i64 + 1).map_err(failed)?;
        }
        transaction.pragma_update(None, "application_id", APPLICATION_ID).map_err(failed)?;
        transaction.commit().map_err(failed)
    }

    /// Sets the journal. Of two programs that do so for one new file at once the library refuses one, however long it may wait
    /// otherwise.
    fn write_ahead(&self) -> rusqlite::Result<()> {
        let begin = Instant::now();
        loop {
            let set = self.connection.execute_batch("PRAGMA journal_mode = WAL;");
            match set.as_ref().err().and_then(rusqlite::Error::sqlite_error_code) {
                Some(ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked) if begin.elapsed() < PATIENCE => {
                    std::thread::sleep(AGAIN);
                }
                _ => return set,
            }
        }
    }

    pub(super) fn failed(&self, source: rusqlite::Error) -> StoreError {
        StoreError::Database { file: self.file.clone(), source }
    }

    pub(super) fn damaged(&self, what: &'static str, row: i64) -> StoreError {
        StoreError::Damaged { file: self.file.clone(), what, row }
    }
}
