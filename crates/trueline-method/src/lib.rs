//! Joint calibration of a laser vision sensor's time offset, its hand-eye transform and the line it scans.
//!
//! ```text
//! Recording ─observations─▶ Observations ─problem─▶ LineProblem ─solve─▶ Solution ─conclude─▶ Calibration
//! ```
//!
//! One call does everything ([`calibrate()`]). The steps are public and pure, one file each. Nothing here prints or reads files. Threads start only
//! if [`Config::threads`] requests them. Source: \[Yang2025\], corrected as listed in `docs/references.md`.
//!
//! ```
//! use trueline_method::{Config, Status, calibrate};
//! use trueline_sim::{Preset, simulate};
//!
//! let scan = simulate(&Preset::Quick.scenario(), 1).ok_or("no seam in view")?;
//! let calibration = calibrate(&scan, None, &Config::default())?; // without any guess
//! assert_eq!(calibration.status(), Status::Accepted);
//! let offset = calibration.time_offset()?; // or the motion that is missing
//! let sigma_s = offset.sigma_s.ok_or("it was held")?;
//! assert!((offset.value_s - 0.01773).abs() < 4.0 * sigma_s, "the simulated offset is 17.73 ms");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod adjustment;
pub mod assess;
pub mod axes;
pub mod calibrate;
pub mod calibration;
pub mod config;
pub mod curve;
pub mod diagnose;
pub mod error;
pub mod evaluate;
pub mod findings;
pub mod hypotheses;
pub mod incremental;
pub mod input;
pub mod models;
pub mod order_statistics;
mod parallel;
pub mod problem;
pub mod several_sensors;
pub mod solve;
pub mod stripe;
mod thinning;
pub mod verdict;

pub use calibrate::calibrate;
pub use calibration::{Calibration, HandEye, LineEstimate, TimeOffset, Translation};
pub use config::{
    Config, DrawnLine, HeldSigma, Hold, Measurements, PartMoves, Requirement, ResidualKind, SeamCad,
    SensorMode, Stamps, Target, Use,
};
pub use error::Error;
pub use input::observations::{Observation, Observations};
pub use problem::parameters::Parameters;
pub use verdict::{Reason, Status, Verdict, Warning};
