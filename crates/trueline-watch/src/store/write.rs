//! Reads and writes of each weld, inside one transaction.

use super::codec;
use super::schema::Store;
use super::store_error::StoreError;
use crate::detect::Scatter;
use crate::innovation::WeldStatistic;
use crate::reference::Part;
use rusqlite::{OptionalExtension, Transaction, TransactionBehavior, params};

/// A part and its learnt scatter.
#[derive(Clone, Debug)]
pub struct StoredPart {
    /// Its number.
    pub id: i64,
    /// Its seams.
    pub part: Part,
    /// How they scatter, once learnt.
    pub scatter: Option<Scatter>,
}

/// A weld as the detector looks back on it.
#[derive(Clone, Debug)]
pub struct StoredPiece {
    /// Its number.
    pub id: i64,
    /// Number of its part.
    pub part: i64,
    /// Its name.
    pub name: String,
    /// Its statistic.
    pub statistic: WeldStatistic,
}

/// A change that stands.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Standing {
    /// Its kind.
    pub kind: String,
    /// Whether it is within the tolerance.
    pub is_within: bool,
    /// Whether it is another one than that of the weld before.
    pub is_another: bool,
}

/// A weld that has been judged.
#[derive(Clone, Debug)]
pub struct NewWeld {
    /// Its name.
    pub name: String,
    /// SHA-256 of its content: the same weld is never counted twice.
    pub content: String,
    /// When, s since 1970 UTC.
    pub watched_s: i64,
    /// Number of its part.
    pub part: i64,
    /// Its statistic.
    pub statistic: WeldStatistic,
    /// For each column of θ the change and its standard deviation (SI) if nothing else changed.
    pub estimates: Vec<Option<[f64; 2]>>,
    /// log₁₀ probabilities by kind.
    pub p_log10: [f64; 4],
    /// Its report, a line of JSON.
    pub line: String,
    /// The standing change.
    pub alarm: Option<NewAlarm>,
}

/// State after a weld.
#[derive(Clone, Copy, Debug)]
pub struct NewAlarm {
    /// Its kind.
    pub kind: &'static str,
    /// The row of the first weld after the change; `None` is this weld.
    pub since: Option<i64>,
    /// log₁₀ probability.
    pub p_log10: f64,
    /// Whether it is within the tolerance.
    pub is_within: bool,
}

impl Store {
    /// Starts a transaction; other programs wait until it is committed or dropped.
    ///
    /// # Errors
    /// A database that another program holds for half a minute, or that cannot be written.
    pub fn begin(&self) -> Result<Transaction<'_>, StoreError> {
        Transaction::new_unchecked(&self.connection, TransactionBehavior::Immediate)
            .map_err(|e| self.failed(e))
    }

    /// Ends it: from here on it survives.
    ///
    /// # Errors
    /// A disk that is full or gone.
    pub fn commit(&self, transaction: Transaction<'_>) -> Result<(), StoreError> {
        transaction.commit().map_err(|e| self.failed(e))
    }

    /// Origin of the laser plane's shape for a calibration, and its number, if known.
    ///
    /// # Errors
    /// A database that cannot be read.
    pub fn calibration(&self, sha256: &str) -> Result<Option<(i64, [f64; 2])>, StoreError> {
        let text = "SELECT id, shape_origin_a_m, shape_origin_b_m FROM calibrations WHERE sha256 = ?1";
        let row = |row: &rusqlite::Row<'_>| Ok((row.get(0)?, [row.get(1)?, row.get(2)?]));
        self.connection.query_row(text, [sha256], row).optional().map_err(|e| self.failed(e))
    }

    /// Adds a calibration if it is new; returns its number and the origin of its shape, from the first program.
    ///
    /// # Errors
    /// A database that cannot be written.
    pub(crate) fn add_calibration(
        &self,
        (sha256, name): (&str, &str),
        added_s: i64,
        time_offset_s: f64,
        shape_origin_m: [f64; 2],
    ) -> Result<(i64, [f64; 2]), StoreError> {
        let [a, b] = shape_origin_m;
        let text = "INSERT INTO calibrations (sha256, name, added_s, time_offset_s, shape_origin_a_m, shape_origin_b_m) \
                    VALUES (?1, ?2, ?3, ?4, ?5, ?6) ON CONFLICT DO NOTHING";
        self.connection
            .execute(text, params![sha256, name, added_s, time_offset_s, a, b])
            .map_err(|e| self.failed(e))?;
        let found = self.calibration(sha256)?;
        found.ok_or_else(|| self.failed(rusqlite::Error::QueryReturnedNoRows))
    }

    /// The row that the next weld will take; to be called in its transaction.
    ///
    /// # Errors
    /// A database that cannot be read.
    pub(crate) fn next_row(&self) -> Result<i64, StoreError> {
        let text = "SELECT coalesce(max(id), 0) + 1 FROM welds";
        self.connection.query_row(text, [], |row| row.get(0)).map_err(|e| self.failed(e))
    }

    /// The row of a weld and its earlier report, if it was watched.
    ///
    /// # Errors
    /// A database that cannot be read.
    pub(crate) fn line_of(
        &self,
        calibration: i64,
        content: &str,
    ) -> Result<Option<(i64, String)>, StoreError> {
        let text = "SELECT id, line FROM welds WHERE calibration = ?1 AND content = ?2";
        self.connection
            .query_row(text, params![calibration, content], |row| Ok((row.get(0)?, row.get(1)?)))
            .optional()
            .map_err(|e| self.failed(e))
    }

    /// The number and the name of the calibration of the last weld.
    ///
    /// # Errors
    /// A database that cannot be read.
    pub(crate) fn calibration_of_last_weld(&self) -> Result<Option<(i64, String)>, StoreError> {
        let text = "SELECT calibrations.id, calibrations.name FROM welds JOIN calibrations ON calibrations.id = calibration \
                    ORDER BY welds.id DESC LIMIT 1";
        let row = |row: &rusqlite::Row<'_>| Ok((row.get(0)?, row.get(1)?));
        self.connection.query_row(text, [], row).optional().map_err(|e| self.failed(e))
    }

    /// All parts of a calibration.
    ///
    /// # Errors
    /// A database that cannot be read, or damaged rows.
    pub fn parts(&self, calibration: i64) -> Result<Vec<StoredPart>, StoreError> {
        let text = "SELECT id, seams, scatter FROM parts WHERE calibration = ?1 ORDER BY id";
        let mut query = self.connection.prepare(text).map_err(|e| self.failed(e))?;
        let mut rows = query.query([calibration]).map_err(|e| self.failed(e))?;
        let mut parts = Vec::new();
        while let Some(row) = rows.next().map_err(|e| self.failed(e))? {
            let read = || -> rusqlite::Result<(i64, Vec<u8>, Option<Vec<u8>>)> {
                Ok((row.get(0)?, row.get(1)?, row.get(2)?))
            };
            let (id, seams, scatter) = read().map_err(|e| self.failed(e))?;
            let part = codec::part(&seams).ok_or_else(|| self.damaged("seams", id))?;
            let scatter = scatter
                .map(|bytes| codec::scatter(&bytes).ok_or_else(|| self.damaged("scatter", id)))
                .transpose()?;
            parts.push(StoredPart { id, part, scatter });
        }
        Ok(parts)
    }

    /// Adds a part.
    ///
    /// # Errors
    /// A database that cannot be written.
    pub(crate) fn add_part(&self, calibration: i64, part: &Part) -> Result<i64, StoreError> {
        let text = "INSERT INTO parts (calibration, seams) VALUES (?1, ?2)";
        self.connection
            .execute(text, params![calibration, codec::part_bytes(part)])
            .map_err(|e| self.failed(e))?;
        Ok(self.connection.last_insert_rowid())
    }

    /// Keeps the learnt scatter of a part.
    ///
    /// # Errors
    /// A database that cannot be written.
    pub(crate) fn keep_scatter(&self, part: i64, scatter: &Scatter) -> Result<(), StoreError> {
        let text = "UPDATE parts SET scatter = ?2 WHERE id = ?1";
        let bytes = codec::scatter_bytes(scatter);
        self.connection.execute(text, params![part, bytes]).map(|_| ()).map_err(|e| self.failed(e))
    }

    /// The welds of a calibration that the detector looks back on, in order of time.
    ///
    /// # Errors
    /// A database that cannot be read, or damaged rows.
    pub fn pieces(&self, calibration: i64) -> Result<Vec<StoredPiece>, StoreError> {
        let text = "SELECT id, part, name, statistic FROM welds \
                    WHERE calibration = ?1 AND statistic IS NOT NULL ORDER BY id";
        let mut query = self.connection.prepare(text).map_err(|e| self.failed(e))?;
        let mut rows = query.query([calibration]).map_err(|e| self.failed(e))?;
        let mut pieces = Vec::new();
        while let Some(row) = rows.next().map_err(|e| self.failed(e))? {
            let read = || -> rusqlite::Result<(i64, i64, String, Vec<u8>)> {
                Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?))
            };
            let (id, part, name, bytes) = read().map_err(|e| self.failed(e))?;
            let statistic = codec::statistic(&bytes).ok_or_else(|| self.damaged("statistic", id))?;
            pieces.push(StoredPiece { id, part, name, statistic });
        }
        Ok(pieces)
    }

    /// The change that stood after the last weld.
    ///
    /// # Errors
    /// A database that cannot be read.
    pub(crate) fn standing(&self, calibration: i64) -> Result<Option<Standing>, StoreError> {
        let text = "SELECT kind, within_tolerance FROM alarms WHERE weld = (SELECT max(id) FROM welds WHERE calibration = ?1)";
        let row = |row: &rusqlite::Row<'_>| {
            Ok(Standing { kind: row.get(0)?, is_within: row.get(1)?, is_another: false })
        };
        self.connection.query_row(text, [calibration], row).optional().map_err(|e| self.failed(e))
    }

    /// Forgets the oldest welds and their alarms if they were watched before a time (s since 1970 UTC). It
    /// forgets at most a hundred, so that no weld waits, and none that the detector uses. How many.
    ///
    /// # Errors
    /// A database that cannot be written.
    pub fn forget_before(&self, watched_s: i64) -> Result<usize, StoreError> {
        let text = "DELETE FROM welds WHERE id IN (SELECT id FROM (SELECT id, watched_s FROM welds \
                    WHERE statistic IS NULL ORDER BY id LIMIT 100) WHERE watched_s < ?1)";
        self.connection.execute(text, [watched_s]).map_err(|e| self.failed(e))
    }

    /// Adds a judged weld with its alarm.
    ///
    /// # Errors
    /// A database that cannot be written.
    pub(crate) fn add_weld(&self, calibration: i64, weld: &NewWeld) -> Result<i64, StoreError> {
        let text = "INSERT INTO welds (calibration, part, content, name, watched_s, used, outliers, noise_factor, \
                    estimates, p_log10, line, statistic) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12)";
        let statistic = &weld.statistic;
        let p_log10 = weld.p_log10.map(|p| Some([p, 0.0]));
        let values = params![
            calibration,
            weld.part,
            weld.content,
            weld.name,
            weld.watched_s,
            statistic.used as i64,
            statistic.outliers as i64,
            statistic.noise_factor,
            codec::pairs_bytes(&weld.estimates),
            codec::pairs_bytes(&p_log10),
            weld.line,
            codec::statistic_bytes(statistic),
        ];
        self.connection.execute(text, values).map_err(|e| self.failed(e))?;
        let id = self.connection.last_insert_rowid();
        if let Some(NewAlarm { kind, since, p_log10, is_within }) = weld.alarm {
            let text = "INSERT INTO alarms (weld, kind, since, p_log10, within_tolerance) VALUES (?1, ?2, ?3, ?4, ?5)";
            self.connection
                .execute(text, params![id, kind, since.unwrap_or(id), p_log10, is_within])
                .map_err(|e| self.failed(e))?;
        }
        Ok(id)
    }
}
