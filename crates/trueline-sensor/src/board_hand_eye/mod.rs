//! Pose of the camera on the robot, from pictures of a fixed board: the robot stops before it, or moves.
//!
//! ```text
//! corners ──sighting──▶ pose of the board, its covariance ──closed_form──▶ first hand-eye
//!                                    └──────────────────────joint───────▶ time offset, hand-eye, board
//! ```
//!
//! At standstill the time offset cannot be determined. While the robot moves ([`moving`]), all three are estimated together:
//! a reference for calibrations without a board. Poses of any other detector or tracker ([`poses`]) use the same joint
//! estimate. If their noise is not stated it is estimated, and directions that the motion does not determine are named
//! ([`hidden`]). Sightings whose lengths are all wrong by one factor are answered with it ([`scale`]).

pub mod closed_form;
pub mod hidden;
pub mod joint;
pub(crate) mod lasting_motion;
pub mod moving;
pub(crate) mod noise_of_sightings;
pub mod pose_sighting;
pub mod pose_stops;
pub mod poses;
pub mod robot_path;
pub mod scale;
pub(crate) mod sight_model;
pub(crate) mod sighting;
pub(crate) mod start;
pub(crate) mod stop_noise;
pub mod unknowns;

pub use joint::{BoardFit, Carried, ErrorModel, Unknowns};
pub use pose_sighting::{PoseSighting, ReportedPose, Sighting};
pub use poses::{PoseFit, PoseOptions};
pub use robot_path::RobotPath;
pub use scale::Scale;
pub use sighting::{BoardSighting, Sightings};
