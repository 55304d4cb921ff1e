//! Cuts of a calibration's welds at changes.

use super::rows::weld_number;
use super::schema::{FIRST_WITH_REGIMES, Store};
use super::store_error::StoreError;
use crate::parameters::Kind;
use rusqlite::{OptionalExtension, params};

/// Welds between two changes.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredRegime {
    /// The row of its first weld; that of the next weld if there is none yet.
    pub first: i64,
    /// When it begins inside of that weld, s after its first robot sample.
    pub inside_s: Option<f64>,
    /// Difference from the calibration.
    pub fault: Option<StoredFault>,
    /// Whether its start was reported by a user, not by a weld.
    pub claimed: bool,
}

/// Difference from the calibration.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredFault {
    /// Its kind.
    pub kind: Kind,
    /// The number of its part.
    pub part: i64,
    /// The row of the weld at which it was found.
    pub raised: i64,
}

impl StoredRegime {
    /// Welds at the calibration.
    #[must_use]
    pub fn good(first: i64, claimed: bool) -> Self {
        Self { first, inside_s: None, fault: None, claimed }
    }
}

impl Store {
    /// The regimes of a calibration in order of time: from the one to which a weld belongs on.
    ///
    /// # Errors
    /// A database that cannot be read.
    pub fn regimes(&self, calibration: i64, weld: i64) -> Result<Vec<StoredRegime>, StoreError> {
        if self.versions()?.1 < FIRST_WITH_REGIMES {
            return Ok(Vec::new());
        }
        let text = "SELECT first, inside_s, kind, part, raised, claimed FROM regimes WHERE calibration = ?1 AND id >= \
                    coalesce((SELECT max(id) FROM regimes WHERE calibration = ?1 AND first <= ?2), 0) ORDER BY id";
        let mut query = self.connection.prepare(text).map_err(|e| self.failed(e))?;
        let rows = query.query_map([calibration, weld], |row| {
            let kind: Option<String> = row.get(2)?;
            let kind = Kind::ALL.into_iter().find(|known| kind.as_deref() == Some(known.name()));
            let fault = match (kind, row.get(3)?, row.get(4)?) {
                (Some(kind), Some(part), Some(raised)) => Some(StoredFault { kind, part, raised }),
                _ => None,
            };
            Ok(StoredRegime { first: row.get(0)?, inside_s: row.get(1)?, fault, claimed: row.get(5)? })
        });
        rows.and_then(Iterator::collect).map_err(|e| self.failed(e))
    }

    /// Replaces the regimes from a weld on.
    ///
    /// # Errors
    /// A database that cannot be written.
    pub(crate) fn keep_regimes(
        &self,
        calibration: i64,
        weld: i64,
        regimes: &[StoredRegime],
    ) -> Result<(), StoreError> {
        let failed = |e| self.failed(e);
        let from = "SELECT max(id) FROM regimes WHERE calibration = ?1 AND first <= ?2";
        let from: Option<Option<i64>> = self
            .connection
            .query_row(from, [calibration, weld], |row| row.get(0))
            .optional()
            .map_err(failed)?;
        let text = "DELETE FROM regimes WHERE calibration = ?1 AND id >= ?2";
        self.connection.execute(text, [calibration, from.flatten().unwrap_or(0)]).map_err(failed)?;
        let text = "INSERT INTO regimes (calibration, first, inside_s, kind, part, raised, claimed) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)";
        let mut insert = self.connection.prepare(text).map_err(failed)?;
        for regime in regimes {
            let fault = regime.fault.as_ref();
            let values = params![
                calibration,
                regime.first,
                regime.inside_s,
                fault.map(|fault| fault.kind.name()),
                fault.map(|fault| fault.part),
                fault.map(|fault| fault.raised),
                regime.claimed,
            ];
            insert.execute(values).map_err(failed)?;
        }
        Ok(())
    }

    /// Number of the weld before which a repair was reported, if no later weld has verified it.
    ///
    /// # Errors
    /// A database that cannot be read.
    pub fn reported_repair(&self, calibration: i64) -> Result<Option<i64>, StoreError> {
        let last = self.regimes(calibration, i64::MAX)?.pop();
        let Some(claimed) = last.filter(|regime| regime.claimed) else { return Ok(None) };
        let stood = self.alarm_of_last_weld(calibration)?;
        Ok(stood.map(|_| weld_number(claimed.first)))
    }

    /// Kind, row of the first weld and part of the change that stood after the last weld.
    ///
    /// # Errors
    /// A database that cannot be read.
    pub(crate) fn alarm_of_last_weld(
        &self,
        calibration: i64,
    ) -> Result<Option<(String, i64, i64)>, StoreError> {
        let text = "SELECT kind, since, part FROM alarms JOIN welds ON welds.id = weld \
                    WHERE weld = (SELECT max(id) FROM welds WHERE calibration = ?1)";
        let row = |row: &rusqlite::Row<'_>| Ok((row.get(0)?, row.get(1)?, row.get(2)?));
        self.connection.query_row(text, [calibration], row).optional().map_err(|e| self.failed(e))
    }

    /// The row of the last weld of a name.
    ///
    /// # Errors
    /// A database that cannot be read.
    pub(crate) fn row_by_name(&self, calibration: i64, name: &str) -> Result<Option<i64>, StoreError> {
        let text = "SELECT max(id) FROM welds WHERE calibration = ?1 AND name = ?2";
        self.connection
            .query_row(text, params![calibration, name], |row| row.get(0))
            .map_err(|e| self.failed(e))
    }

    /// Drops the statistics of welds that are not needed any more.
    ///
    /// # Errors
    /// A database that cannot be written.
    pub(crate) fn drop_statistics(&self, welds: &[i64]) -> Result<(), StoreError> {
        let text = "UPDATE welds SET statistic = NULL WHERE id = ?1";
        let mut update = self.connection.prepare(text).map_err(|e| self.failed(e))?;
        welds.iter().try_for_each(|weld| update.execute([weld]).map(|_| ())).map_err(|e| self.failed(e))
    }
}
