//! A calibration in the words of robots and programs.
//!
//! A [`Mounting`] (where the sensor sits, and how late its stamps are) becomes text in one of [`FORMATS`], each with its
//! convention in words. All of them contain the same: the pose of the sensor in the frame of the robot's reported pose,
//! `p_tool = R p_sensor + t`. [`time_offset`] explains the use of the time offset.
//!
//! ```
//! use trueline_report::export::{Mounting, named};
//! let mounting = Mounting::new(nalgebra::Isometry3::translation(0.06197, 0.0, 0.145), Some(0.017663));
//! let text = named("ur").expect("a known name").text(&mounting).expect("UR writes any pose");
//! assert!(text.contains("p[0.061970000, 0.000000000, 0.145000000, 0.000000000000, 0.000000000000, 0.000000000000]"));
//! ```

pub mod axes;
pub mod cloud;
pub mod curves;
pub mod files;
mod format;
mod formats;
mod mounting;
mod number;
pub mod points;
pub mod robots;
pub mod ros;
pub mod time_offset;

pub use format::{Format, Group, Unsupported};
pub use formats::{FORMATS, list, named};
pub use mounting::Mounting;
