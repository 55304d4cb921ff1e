//! Joint calibration of a laser vision sensor's time offset, its hand-eye transform and the line it scans.
//!
//! ```text
//! Recording ─observations─▶ Observations ─problem─▶ LineProblem ─solve─▶ Solution ─conclude─▶ Calibration
//! ```
//!
//! One call does it all ([`calibrate()`]); the steps are public and pure, one file each. Nothing here
//! prints or reads files, and threads start only where [`Config::threads`] asks for them. Source: \[Yang2025\],
//! corrected where `docs/references.md` says.

pub mod alternatives;
pub mod at_torch;
pub mod calibrate;
pub mod calibration;
pub mod clock_check;
pub mod config;
pub mod disruption;
pub mod doctor;
pub mod error;
pub mod evaluate;
pub mod held_out;
pub mod held_poses;
pub mod initial;
mod kernel;
pub mod mistakes;
pub mod noise_levels;
pub mod observability;
pub mod observations;
pub mod offset_profile;
pub mod optimum;
pub mod order_statistics;
pub mod parameters;
pub mod placed;
pub mod prior;
pub mod problem;
pub mod reference;
pub mod reference_curve;
pub mod refine;
pub mod residuals;
pub mod restamp;
pub mod robot_motion;
pub mod sampling;
pub mod seam_points;
pub mod shown;
pub mod signal;
pub mod steady;
pub mod stream_clock;
pub mod streaming;
pub mod uncertainty;
pub mod verdict;

pub use calibrate::calibrate;
pub use calibration::{Calibration, Status};
pub use config::{Config, Hold, Requirement, ResidualKind, Stamps, Use};
pub use error::Error;
pub use observations::{Observation, Observations};
pub use parameters::Parameters;
