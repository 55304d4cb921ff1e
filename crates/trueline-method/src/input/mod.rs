//! Recording → observations: stamps, clocks, the robot's path, features on the laser plane.

pub mod axis_chain;
pub(crate) mod camera_sensor;
pub(crate) mod clock_count;
pub(crate) mod clock_line;
pub mod clock_model;
pub(crate) mod clock_wander;
pub mod feature_noise;
pub mod lateness;
pub mod noise_levels;
pub mod observations;
mod plane_before_camera;
pub(crate) mod repeated_poses;
pub mod robot_motion;
pub mod shape_knowledge;
pub mod shape_prior;
pub mod skip;
pub mod stops;
pub mod timestamps;
