#![doc = include_str!("../README.md")]

mod calibration;
mod error;
#[cfg(feature = "open")]
pub mod open;
mod recording;
mod run_time;
mod run_time_error;

pub use calibration::{Calibration, load};
pub use error::Error;
pub use recording::Recording;
pub use run_time::{PlacerSetup, RunTime};
pub use run_time_error::RunTimeError;
/// A cell that is recorded, and estimated meanwhile.
#[cfg(feature = "live")]
pub use trueline_cell as live;
pub use trueline_dataset::result_file::ResultFile;
pub use trueline_dataset::{Feature, Guess, Measured, RobotSample, Sensor};
pub use trueline_geometry::{Line, Plane, Pose};
pub use trueline_method::assess::observability::Unobservable;
pub use trueline_method::evaluate::live_placement::{LivePlacement, Placement};
pub use trueline_method::evaluate::seam_points::{SeamPoint, SeamPoints};
pub use trueline_method::verdict::Axis;
pub use trueline_method::{
    Config, HandEye, Hold, LineEstimate, Reason, Requirement, ResidualKind, Stamps, Status, TimeOffset,
    Translation, Use, Warning,
};
pub use trueline_model::Camera;
/// Points in base at run time: see [`RunTime::placer`].
pub use trueline_rt as rt;
