//! Recorded scans: the dataset folder, foreign formats, units and conventions.
//!
//! A [`Recording`] is the only thing calibration ever sees; live, file and simulated data meet there. This is the one
//! library crate with millimetres, milliseconds and degrees: it converts them on the way in and out. Reading never
//! guesses, drops or clamps: unusable data are an [`Error`] with file, line, column, the expected form and a hint.
//!
//! ```
//! use std::path::Path;
//! use trueline_dataset::{Sensor, sensor_toml};
//!
//! let file = Path::new("sensor.toml");
//! let sensor = sensor_toml::parse(file, "kind = \"points\"\n[laser_plane]\nnormal = [0, 0, 1]\noffset_mm = 300\n")?;
//! let Sensor::Points { laser_plane_in_camera: Some(plane) } = sensor else { unreachable!("that is its kind") };
//! assert!((plane.offset() - 0.3).abs() < 1e-15, "millimetres end here");
//! let error = sensor_toml::parse(file, "kind = \"sonar\"\n").unwrap_err();
//! assert!(error.to_string().contains("sensor.toml"));
//! # Ok::<(), trueline_dataset::Error>(())
//! ```

pub mod axes;
pub mod axes_csv;
pub mod axes_folder;
pub mod axes_toml;
pub mod axis_limits;
mod axis_problem;
pub mod cad_file;
pub mod calibration_file;
mod camera_yaml;
pub mod decoded_picture;
pub mod dialect;
mod dxf;
mod encoder_log;
pub mod error;
pub mod feature_cache;
pub mod features_csv;
pub mod file_kind;
pub mod folder;
pub mod folder_profiles;
mod folder_writing;
mod found_seams;
mod frame_signals;
pub mod gray_picture;
pub mod gray_png;
pub mod guarded;
mod hash;
mod header_unit;
pub mod images;
pub mod import;
pub mod join;
pub mod json_lines;
pub mod known_toml;
pub mod laser_channel;
pub mod log_problem;
mod moment;
mod name_stamps;
mod nearest;
pub mod no_return;
pub mod outputs;
#[cfg(feature = "parquet")]
mod parquet_pages;
pub mod picture_names;
pub mod picture_poses_csv;
pub mod picture_rows;
mod picture_size;
mod picture_source;
pub mod pose_folder;
mod problem;
mod problem_hint;
pub mod profile;
pub mod profile_file;
pub mod profile_stream;
mod profile_text;
pub mod profiles_csv;
#[cfg(feature = "parquet")]
pub mod profiles_parquet;
pub mod recording;
pub mod reference_file;
pub mod result_file;
pub mod robot_csv;
mod rotation_columns;
pub mod round_folder;
mod rows;
mod sensor_covariance;
pub mod sensor_setup;
pub mod sensor_toml;
mod separator;
mod setup_toml;
pub mod several_sensors;
mod shared_samples;
pub mod sightings_csv;
pub mod source_file;
pub mod stamp;
pub mod stop_poses;
pub mod stripe_points_csv;
pub mod stripes_csv;
pub mod table;
mod table_start;
mod toml_place;
pub mod unit;
pub mod whole_file;
pub mod whole_folder;
mod wrapping_count;
pub mod written_form;

pub use axes::{AxisRecord, Carries};
pub use axis_limits::{AxisLimits, AxisMotion};
pub use axis_problem::AxisProblem;
pub use calibration_file::KnownCalibration;
pub use dialect::Dialect;
pub use error::{Error, Problem};
pub use found_seams::FoundSeams;
pub use frame_signals::FrameSignals;
pub use gray_png::{GrayImage, Pixels};
pub use images::FrameFile;
pub use laser_channel::Channel;
pub use log_problem::LogProblem;
pub use picture_source::{FrameStamp, PictureFolder, PictureSource};
pub use profile::{Profile, ProfilePoint};
pub use profile_file::{ProfileForm, ProfilesRead};
pub use recording::{
    Feature, Guess, LAST_LINE, MOST_CORRELATION, Measured, PlateStripe, Recording, RobotSample, Sensor,
    Truth, correlation_of,
};
pub use reference_file::Reference;
pub use sensor_setup::SensorSetup;
pub use sensor_toml::SensorFile;
pub use sightings_csv::Sighting;
pub use whole_folder::WholeFolder;
