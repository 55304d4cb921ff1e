//! One command a file.

pub mod apply;
pub mod calibrate;
pub mod calibrate_board;
#[cfg(feature = "gige")]
pub mod camera_sim;
pub mod demo;
pub mod diff;
pub mod doctor;
pub mod evaluate;
pub mod export;
pub mod features;
pub mod import;
pub mod import_csv;
pub mod listen;
pub mod plan;
pub mod rapid;
pub mod record;
pub mod reproduce;
pub mod robot_sim;
pub mod scan;
pub mod sensor_intrinsics;
pub mod sensor_laser_plane;
pub mod sensor_plane_pictures;
pub mod simulate;
pub mod simulate_images;
pub mod stream_sim;
