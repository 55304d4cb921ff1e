//! What there is to show of a cell: read from its state, never written.

use serde_json::Value;
use std::path::Path;
use trueline_watch::Store;
use trueline_watch::store::{CalibrationRow, HistoryRow, ReceiverRow, StoreError};

/// Welds in a trend.
pub(super) const WELDS: usize = 300;

/// A cell as its state has it now.
#[derive(Clone, Debug)]
pub struct CellView {
    /// Its name: that of the state file.
    pub name: String,
    /// The calibration in use: that of the last weld.
    pub calibration: Option<CalibrationRow>,
    /// Its last welds in order of time.
    pub history: Vec<HistoryRow>,
    /// What was told of the last weld.
    pub last: Option<Value>,
    /// What was told of the last weld with an alarm, and when, s since 1970 UTC.
    pub last_alarm: Option<(Value, i64)>,
    /// The receivers of alarms.
    pub receivers: Vec<ReceiverRow>,
}

impl CellView {
    /// Reads a state file.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn read(state: &Path) -> Result<Self, StoreError> {
        let store = Store::open_to_read(state)?;
        let in_use = store.in_use()?;
        let calibration = store.calibrations()?.into_iter().find(|row| Some(row.id) == in_use);
        let mut view = Self {
            name: store.cell(),
            receivers: store.receivers()?,
            calibration,
            history: Vec::new(),
            last: None,
            last_alarm: None,
        };
        if let Some(id) = view.calibration.as_ref().map(|calibration| calibration.id) {
            view.history = store.history(id, WELDS)?;
            let parsed =
                |(line, at_s): (String, i64)| serde_json::from_str(&line).ok().map(|value| (value, at_s));
            view.last = store.last_line(id)?.and_then(parsed).map(|(line, _)| line);
            view.last_alarm = store.last_alarm_line(id)?.and_then(parsed);
        }
        Ok(view)
    }

    /// The alarm that stands.
    #[must_use]
    pub fn alarm(&self) -> Option<&Value> {
        self.last.as_ref().map(|line| &line["alarm"]).filter(|alarm| !alarm.is_null())
    }
}
