//! Simulated scans with known truth.
//!
//! A [`Scenario`] describes the cell, the robot's motion and the disturbances. [`simulate()`] casts the scan forward:
//! at each exposure the line is intersected with the laser sheet and the point projected into the camera. Nothing
//! here inverts a measurement or depends on the estimator. So a test against it does not test the estimator against
//! itself.
//!
//! ```
//! use trueline_sim::{Preset, simulate};
//!
//! let scan = simulate(&Preset::Quick.scenario(), 1).ok_or("the sensor never sees the line")?;
//! let truth = scan.truth.as_ref().ok_or("a simulation knows its truth")?;
//! assert!((truth.parameters.time_offset_s - 0.01773).abs() < 1e-12);
//! # Ok::<(), &str>(())
//! ```

pub mod arm;
pub mod axes;
pub mod boards;
pub mod capture;
pub mod curves;
pub mod faults;
mod followed_path;
pub mod images;
pub mod motion;
pub mod noise;
pub mod plates;
pub mod presets;
pub mod production;
pub mod random_cell;
pub mod round_target;
pub mod scenario;
pub mod shop;
pub mod shutter;
pub mod sightings;
pub mod simulate;
pub mod slow_errors;
pub mod weave;
pub mod weld;

pub use axes::{AxisCourse, SimulatedAxis, simulate_along_with_axes, simulate_with_axes};
pub use faults::Fault;
pub use followed_path::FollowedPath;
pub use images::{Joint, Look, PictureScan};
pub use plates::{
    PlateForm, PlatePair, Plates, ProfileCaster, ProfileLook, scan_plates, scan_plates_along, scan_profiles,
    scan_profiles_along,
};
pub use presets::Preset;
pub use random_cell::random_cell;
pub use round_target::{RoundScan, RoundScanned, RoundTarget};
pub use scenario::{
    Between, Cell, Disturbance, Progress, Scan, Scenario, SensorModel, Sine, Timing, TrackedIn,
};
pub use shutter::{Exposed, Shutter};
pub use sightings::{PoseMotion, Sighted, SightingNoise, SightingScan, ViewSize};
pub use simulate::{on_the_wall, simulate, simulate_along, simulate_sensors, simulate_with_faults};
pub use slow_errors::SlowErrors;
pub use weave::Weave;
pub use weld::{KnownScan, Weld, WeldScan, scan_weld};
