//! State that survives: one SQLite file for each cell.
//!
//! Calibrations, parts, welds with their statistics, alarms, messages about them. Every weld is one transaction; a program
//! that is killed leaves the welds that were finished, and two programs at once wait for each other. Statistics are kept of
//! as many welds as the detector looks back; what a chart needs of a weld is kept for good, or as long as is asked for
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

/// Welds of which the statistic is kept, for each calibration: twice the longest window of good ones, and as many others.
pub(crate) const KEPT_STATISTICS: usize = 512;
