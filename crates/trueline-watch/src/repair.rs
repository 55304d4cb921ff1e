//! A repair that somebody reports: the fault that stands is taken to be mended before a weld. Later welds verify it.

use crate::alarm_message;
use crate::parameters::Kind;
use crate::store::{Store, StoreError, StoredFault, StoredRegime, weld_number};

/// Result of a report.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Repair {
    /// The fault counts as mended before the weld of this number.
    Before(i64),
    /// No change stands.
    NothingStands,
}

/// Reason why a repair cannot be before a weld.
#[derive(Debug, thiserror::Error)]
pub enum RepairError {
    /// The state cannot be used.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// Unknown weld.
    #[error("--repaired {0}: no weld of this calibration has this number or name")]
    Unknown(String),
    /// The fault began there or later.
    #[error("--repaired {name}: the fault began at weld {since}, so its repair cannot be before weld {name}")]
    TooEarly {
        /// The weld that was named.
        name: String,
        /// Number of the first weld of the fault.
        since: i64,
    },
}

impl RepairError {
    /// Hint for the user.
    #[must_use]
    pub fn hint(&self) -> &'static str {
        match self {
            Self::Store(error) => error.hint(),
            Self::Unknown(_) | Self::TooEarly { .. } => {
                "name the first weld after the repair by its number or name, or use --repaired alone: from the next weld on"
            }
        }
    }
}

/// Whether a word names a weld that is kept: by its number, or by its name.
pub(crate) fn is_known(store: &Store, sha256: &str, weld: &str) -> Result<bool, StoreError> {
    let Some((id, _)) = store.calibration(sha256)? else { return Ok(false) };
    Ok(row(store, id, weld)?.is_some())
}

fn row(store: &Store, calibration: i64, weld: &str) -> Result<Option<i64>, StoreError> {
    let number = weld.parse::<i64>().ok().and_then(|number| number.checked_add(1));
    match number.filter(|row| (1..).contains(row)) {
        Some(row) if row <= store.next_row()? => Ok(Some(row)),
        _ => store.row_by_name(calibration, weld),
    }
}

/// Takes the fault that stands to be mended before a weld; `None` is the next one.
///
/// # Errors
/// A weld that is not known, or lies before the fault; a state that cannot be written.
pub(crate) fn claim(
    store: &Store,
    (sha256, name): (&str, &str),
    weld: Option<&str>,
    now_s: i64,
) -> Result<Repair, RepairError> {
    let transaction = store.begin()?;
    let Some((id, _)) = store.calibration(sha256)? else { return Ok(Repair::NothingStands) };
    let mut regimes = store.regimes(id, i64::MAX)?;
    if regimes.is_empty() {
        regimes.extend(of_alarm(store, id)?);
    }
    let Some((first, _)) = regimes.last().and_then(|regime| Some((regime.first, regime.fault.as_ref()?)))
    else {
        return Ok(Repair::NothingStands);
    };
    let row = match weld {
        Some(weld) => row(store, id, weld)?.ok_or_else(|| RepairError::Unknown(weld.to_owned()))?,
        None => store.next_row()?,
    };
    if row <= first {
        let name = weld.unwrap_or_default().to_owned();
        return Err(RepairError::TooEarly { name, since: weld_number(first) });
    }
    regimes.push(StoredRegime::good(row, true));
    store.keep_regimes(id, i64::MAX, &regimes)?;
    let body = alarm_message::repaired(&store.cell(), name, now_s, weld_number(row));
    store.add_message(&body.to_string())?;
    store.commit(transaction)?;
    Ok(Repair::Before(weld_number(row)))
}

/// The standing change in a state from before regimes were kept.
fn of_alarm(store: &Store, calibration: i64) -> Result<Option<StoredRegime>, StoreError> {
    let Some((kind, since, part)) = store.alarm_of_last_weld(calibration)? else { return Ok(None) };
    let kind = Kind::ALL.into_iter().find(|known| known.name() == kind);
    Ok(kind.map(|kind| StoredRegime {
        first: since,
        inside_s: None,
        fault: Some(StoredFault { kind, part, raised: since }),
        claimed: false,
    }))
}
