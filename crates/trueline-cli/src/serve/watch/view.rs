//! View of a cell: read from its state, never written.

use serde_json::Value;
use std::path::Path;
use trueline_watch::store::{CalibrationRow, HistoryRow, ReceiverRow, StoreError};
use trueline_watch::{State, Store};

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
    /// Report on the last weld.
    pub last: Option<Value>,
    /// Report on the last weld with an alarm, and its time, s since 1970 UTC.
    pub last_alarm: Option<(Value, i64)>,
    /// The receivers of alarms.
    pub receivers: Vec<ReceiverRow>,
    /// The number of the weld before which a repair was reported, if no weld has verified it since.
    pub repaired: Option<i64>,
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
            repaired: None,
        };
        if let Some(id) = view.calibration.as_ref().map(|calibration| calibration.id) {
            view.history = store.history(id, WELDS)?;
            let parsed =
                |(line, at_s): (String, i64)| serde_json::from_str(&line).ok().map(|value| (value, at_s));
            view.last = store.last_line(id)?.and_then(parsed).map(|(line, _)| line);
            view.repaired = store.reported_repair(id)?;
            view.last_alarm = store.last_alarm_line(id)?.and_then(parsed);
        }
        Ok(view)
    }

    /// The present state.
    #[must_use]
    pub fn state(&self) -> State {
        let last = self.history.last().filter(|_| self.repaired.is_none());
        last.map_or(State::Good, HistoryRow::state)
    }

    /// The change that stands, be it within the tolerance or not.
    #[must_use]
    pub fn change(&self) -> Option<&Value> {
        self.last.as_ref().filter(|_| self.state() != State::Good).map(change_of)
    }
}

/// The change in a line.
#[must_use]
pub(super) fn change_of(line: &Value) -> &Value {
    let within = &line["change_within_tolerance"];
    if within.is_null() { &line["alarm"] } else { within }
}
