//! The permanent table: one row a weld, for charts and tables.

use super::codec;
use super::schema::{FIRST_WITH_REGIMES, Store};
use super::store_error::StoreError;
use crate::told::State;
use rusqlite::OptionalExtension;

/// Older files are read without being changed.
const FIRST_WITH_COUNTS: i64 = 3;

/// A stored calibration.
#[derive(Clone, Debug, PartialEq)]
pub struct CalibrationRow {
    /// Its number.
    pub id: i64,
    /// The name under which it came.
    pub name: String,
    /// When it came, s since 1970 UTC.
    pub added_s: i64,
    /// Its time offset, s.
    pub time_offset_s: f64,
    /// Welds watched with it.
    pub welds: usize,
}

/// A weld in the history.
#[derive(Clone, Debug, PartialEq)]
pub struct HistoryRow {
    /// Its number: welds are counted from 0 in the order in which the state stored them, across calibrations.
    pub number: i64,
    /// Its name.
    pub name: String,
    /// Number of the part.
    pub part: i64,
    /// When it was watched, s since 1970 UTC.
    pub watched_s: i64,
    /// Features that count.
    pub used: usize,
    /// Features that belong to no seam.
    pub outliers: usize,
    /// Noise factor: residuals divided by the expected noise.
    pub noise_factor: f64,
    /// For each column of θ the change and its standard deviation (SI) if nothing else changed. In newer rows the
    /// same follows if nothing of another kind changed. `None` if this weld does not show it.
    pub estimates: Vec<Option<[f64; 2]>>,
    /// log₁₀ probability of the most significant change of each kind, in the order of [`crate::Kind::ALL`].
    pub p_log10: Vec<f64>,
    /// Changes that welds like it would not show.
    pub blind_to: Vec<String>,
    /// The alarm that stood after it.
    pub alarm: Option<AlarmRow>,
}

/// An alarm.
#[derive(Clone, Debug, PartialEq)]
pub struct AlarmRow {
    /// Kind of change.
    pub kind: String,
    /// Number of the first weld after the change.
    pub since: i64,
    /// Probability without a change, log₁₀.
    pub p_log10: f64,
    /// Whether the change is within the tolerance.
    pub is_within: bool,
    /// The change and the remedy, in words; empty in older rows.
    pub text: Option<String>,
    /// Displacement of seam points, with its standard deviation, m.
    pub seam_error: Option<[f64; 2]>,
}

impl HistoryRow {
    /// State after it.
    #[must_use]
    pub fn state(&self) -> State {
        match &self.alarm {
            None => State::Good,
            Some(alarm) if alarm.is_within => State::WithinTolerance,
            Some(_) => State::Alarm,
        }
    }
}

impl Store {
    /// All calibrations, in the order in which they came.
    ///
    /// # Errors
    /// A database that cannot be read.
    pub fn calibrations(&self) -> Result<Vec<CalibrationRow>, StoreError> {
        let welds = if self.versions()?.1 < FIRST_WITH_COUNTS {
            "(SELECT count(*) FROM welds WHERE welds.calibration = calibrations.id)"
        } else {
            "welds"
        };
        let text = format!("SELECT id, name, added_s, time_offset_s, {welds} FROM calibrations ORDER BY id");
        let mut query = self.connection.prepare(&text).map_err(|e| self.failed(e))?;
        let rows = query.query_map([], |row| {
            Ok(CalibrationRow {
                id: row.get(0)?,
                name: row.get(1)?,
                added_s: row.get(2)?,
                time_offset_s: row.get(3)?,
                welds: row.get::<_, i64>(4)?.unsigned_abs() as usize,
            })
        });
        rows.and_then(Iterator::collect).map_err(|e| self.failed(e))
    }

    /// Number of the calibration in use: that of the last weld, or the last one received if there is no weld.
    ///
    /// # Errors
    /// A database that cannot be read.
    pub fn in_use(&self) -> Result<Option<i64>, StoreError> {
        let text = "SELECT coalesce((SELECT calibration FROM welds ORDER BY id DESC LIMIT 1), (SELECT max(id) FROM calibrations))";
        self.connection.query_row(text, [], |row| row.get(0)).map_err(|e| self.failed(e))
    }

    /// The last welds of a calibration in order of time, at most a given number.
    ///
    /// # Errors
    /// A database that cannot be read, or damaged rows.
    pub fn history(&self, calibration: i64, most: usize) -> Result<Vec<HistoryRow>, StoreError> {
        let is_within = if self.versions()?.1 < FIRST_WITH_REGIMES { "0" } else { "within_tolerance" };
        let of_change = |key: &str| {
            format!(
                "coalesce(json_extract(line, '$.alarm.{key}'), json_extract(line, '$.change_within_tolerance.{key}'))"
            )
        };
        let [words, error, sigma] = ["text", "seam_error_mm", "seam_error_sigma_mm"].map(of_change);
        let text = format!(
            "SELECT welds.id, name, part, watched_s, used, outliers, noise_factor, estimates, welds.p_log10, \
             kind, since, alarms.p_log10, json_extract(line, '$.blind_to'), {is_within}, {words}, {error}, {sigma} \
             FROM welds LEFT JOIN alarms ON alarms.weld = welds.id WHERE calibration = ?1 ORDER BY welds.id DESC LIMIT ?2"
        );
        let mut query = self.connection.prepare(&text).map_err(|e| self.failed(e))?;
        let limit = i64::try_from(most).unwrap_or(i64::MAX);
        let mut rows = query.query((calibration, limit)).map_err(|e| self.failed(e))?;
        let mut history = Vec::new();
        while let Some(row) = rows.next().map_err(|e| self.failed(e))? {
            let read = read_row(row).map_err(|e| self.failed(e))?;
            let (mut entry, estimates, p_log10) = read;
            entry.estimates =
                codec::pairs(&estimates).ok_or_else(|| self.damaged("estimates", entry.number))?;
            entry.p_log10 = codec::pairs(&p_log10)
                .ok_or_else(|| self.damaged("probabilities", entry.number))?
                .into_iter()
                .map(|pair| pair.map_or(0.0, |[value, _]| value))
                .collect();
            history.push(entry);
        }
        history.reverse();
        Ok(history)
    }

    /// The name of a weld by its number; `None` if it is not kept.
    ///
    /// # Errors
    /// A database that cannot be read.
    pub fn name(&self, number: i64) -> Result<Option<String>, StoreError> {
        let found =
            self.connection.query_row("SELECT name FROM welds WHERE id = ?1", [number + 1], |row| row.get(0));
        found.optional().map_err(|e| self.failed(e))
    }

    /// Report on the last weld of a calibration, a line of JSON, and its time, s since 1970 UTC.
    ///
    /// # Errors
    /// A database that cannot be read.
    pub fn last_line(&self, calibration: i64) -> Result<Option<(String, i64)>, StoreError> {
        self.line(
            "SELECT line, watched_s FROM welds WHERE calibration = ?1 ORDER BY id DESC LIMIT 1",
            calibration,
        )
    }

    /// The same of the last weld with an alarm.
    ///
    /// # Errors
    /// A database that cannot be read.
    pub fn last_alarm_line(&self, calibration: i64) -> Result<Option<(String, i64)>, StoreError> {
        let text = "SELECT line, watched_s FROM alarms CROSS JOIN welds ON welds.id = alarms.weld \
                    WHERE calibration = ?1 ORDER BY alarms.weld DESC LIMIT 1";
        self.line(text, calibration)
    }

    fn line(&self, text: &str, calibration: i64) -> Result<Option<(String, i64)>, StoreError> {
        let row = |row: &rusqlite::Row<'_>| Ok((row.get(0)?, row.get(1)?));
        self.connection.query_row(text, [calibration], row).optional().map_err(|e| self.failed(e))
    }
}

/// The number of a weld by that of its row, which counts from 1.
#[must_use]
pub(crate) const fn weld_number(row: i64) -> i64 {
    row - 1
}

fn pair_m(value_mm: Option<f64>, sigma_mm: Option<f64>) -> Option<[f64; 2]> {
    Some([value_mm? * 1e-3, sigma_mm? * 1e-3])
}

type Read = (HistoryRow, Vec<u8>, Vec<u8>);

fn read_row(row: &rusqlite::Row<'_>) -> rusqlite::Result<Read> {
    let count = |column: usize| row.get::<_, i64>(column).map(|n| n.unsigned_abs() as usize);
    let alarm = match row.get::<_, Option<String>>(9)? {
        Some(kind) => Some(AlarmRow {
            kind,
            since: weld_number(row.get(10)?),
            p_log10: row.get(11)?,
            is_within: row.get(13)?,
            text: row.get(14)?,
            seam_error: pair_m(row.get(15)?, row.get(16)?),
        }),
        None => None,
    };
    let blind_to: Option<String> = row.get(12)?;
    let entry = HistoryRow {
        number: weld_number(row.get(0)?),
        name: row.get(1)?,
        part: row.get(2)?,
        watched_s: row.get(3)?,
        used: count(4)?,
        outliers: count(5)?,
        noise_factor: row.get(6)?,
        estimates: Vec::new(),
        p_log10: Vec::new(),
        blind_to: blind_to.and_then(|text| serde_json::from_str(&text).ok()).unwrap_or_default(),
        alarm,
    };
    Ok((entry, row.get(7)?, row.get(8)?))
}
