//! Joint calibration of a laser vision sensor's time offset, its hand-eye transform and the line it scans.
//!
//! ```text
//! Recording ─observations─▶ Observations ─problem─▶ LineProblem ─solve─▶ Solution ─conclude─▶ Calibration
//! ```
//!
//! One call does it all ([`calibrate()`]); the steps are public and pure, one file each. Nothing here
//! prints or reads files, and threads start only where [`Config::threads`] asks for them. Source: \[Yang2025\],
//! corrected where `docs/references.md` says.

pub mod assess;
pub mod calibrate;
pub mod calibration;
mod conclude;
pub mod config;
pub mod diagnose;
pub mod error;
pub mod evaluate;
pub mod findings;
pub mod hypotheses;
pub mod input;
pub mod order_statistics;
pub mod problem;
pub mod solve;
pub mod stripe;
pub mod verdict;

pub use calibrate::calibrate;
pub use calibration::{Calibration, HandEye, LineEstimate, TimeOffset, Translation};
pub use config::{
    Config, DrawnLine, HeldSigma, Hold, Measurements, Requirement, ResidualKind, SensorMode, Stamps, Use,
};
pub use error::Error;
pub use input::observations::{Observation, Observations};
pub use problem::parameters::Parameters;
pub use verdict::{Reason, Status, Verdict, Warning};
