//! Joint calibration of a laser vision sensor's time offset, its hand-eye transform and the line it scans.
//!
//! ```text
//! Recording ─observations─▶ Observations ─problem─▶ LineProblem ─solve─▶ Solution ─conclude─▶ Calibration
//! ```
//!
//! One call does it all ([`calibrate()`]); the steps are public and pure, one file each. Nothing here
//! prints, reads files or starts threads. Source: \[Yang2025\], corrected where `docs/references.md` says.

pub mod calibrate;
pub mod calibration;
pub mod config;
pub mod error;
pub mod initial;
pub mod noise_levels;
pub mod observability;
pub mod observations;
pub mod parameters;
pub mod problem;
pub mod residuals;
pub mod uncertainty;

pub use calibrate::calibrate;
pub use calibration::{Calibration, Status};
pub use config::{Config, Hold, ResidualKind};
pub use error::Error;
pub use observations::{Observation, Observations};
pub use parameters::Parameters;
