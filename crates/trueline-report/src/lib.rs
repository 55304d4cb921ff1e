//! Output of a calibration for people and programs: JSON, a terminal summary, an HTML report.
//!
//! Formatting only; every number comes from the calibration. Here metres become millimetres, seconds
//! milliseconds and radians degrees.
//!
//! ```
//! use trueline_method::{Config, calibrate};
//! use trueline_report::{result, summary};
//! use trueline_sim::{Preset, simulate};
//!
//! let scan = simulate(&Preset::Quick.scenario(), 1).ok_or("no line in view")?;
//! let calibration = calibrate(&scan, None, &Config::default())?;
//! assert!(summary::text(&calibration).starts_with("Calibration accepted"));
//! let offset_s = result::of(&calibration).time_offset_s.ok_or("not observable")?;
//! assert!((offset_s - 0.01773).abs() < 1e-3);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod against_truth;
#[cfg(feature = "plan")]
mod arm_summary;
mod axes;
#[cfg(feature = "sensor")]
pub mod board_result;
pub mod calibration_page;
#[cfg(feature = "sensor")]
mod camera_report;
pub mod certificate;
pub mod checks;
pub mod cloud_page;
pub mod comparison;
pub mod diagnosis;
pub mod evaluation_page;
pub mod evaluation_summary;
pub mod export;
pub mod facts;
mod markup;
pub mod number;
pub mod page;
pub mod picture_page;
#[cfg(feature = "plan")]
mod plan_axes;
#[cfg(feature = "plan")]
mod plan_film;
#[cfg(feature = "plan")]
pub mod plan_page;
#[cfg(feature = "plan")]
mod plan_seam_error;
#[cfg(feature = "plan")]
pub mod plan_source;
#[cfg(feature = "plan")]
pub mod plan_summary;
#[cfg(feature = "plan")]
mod plan_swing;
#[cfg(feature = "sensor")]
pub mod pose_result;
#[cfg(feature = "experiments")]
pub mod reproduction_page;
#[cfg(feature = "experiments")]
pub mod reproduction_tables;
pub mod result;
#[cfg(feature = "sensor")]
mod round_result;
pub mod seam_error;
#[cfg(feature = "sensor")]
pub mod sensor_json;
#[cfg(feature = "sensor")]
pub mod sensor_page;
#[cfg(feature = "sensor")]
pub mod sensor_text;
pub mod several_sensors;
mod stripes;
pub mod summary;
pub mod terminal_text;
pub mod verdict_colours;
pub mod wrapped;
