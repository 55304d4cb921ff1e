//! State that survives: one SQLite file for each cell.
//!
//! Calibrations, parts, welds with their statistics, alarms, messages about them. Every weld is one transaction. A
//! killed program leaves its finished welds, and two programs at once wait for each other. Statistics are kept for as
//! many welds as the detector uses. The numbers of a chart are kept forever, or as long as the user states
//! ([`Store::forget_before`]).

mod codec;
mod messages;
mod regimes;
mod rows;
mod schema;
mod store_error;
mod write;

pub use messages::{Message, ReceiverRow};
pub use regimes::{StoredFault, StoredRegime};
pub(crate) use rows::weld_number;
pub use rows::{AlarmRow, CalibrationRow, HistoryRow};
pub use schema::{SCHEMA_VERSION, Store};
pub use store_error::StoreError;
pub(crate) use write::Standing;
pub use write::{NewAlarm, NewWeld, StoredPart, StoredPiece};

/// Welds with their statistic kept, for each calibration: twice the longest window of good ones, and as many others.
pub(crate) const KEPT_STATISTICS: usize = 512;
