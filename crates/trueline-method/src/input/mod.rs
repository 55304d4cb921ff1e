//! Recording → observations: stamps, clocks, the robot's path, features on the laser plane.

pub(crate) mod camera_sensor;
pub mod clock_model;
pub mod feature_noise;
pub mod noise_levels;
pub mod observations;
pub mod path_noise;
pub(crate) mod repeated_poses;
pub mod robot_motion;
pub mod shape_knowledge;
pub mod shape_prior;
pub mod skip;
pub mod stops;
pub mod timestamps;
