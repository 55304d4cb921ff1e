//! `cell.toml`: prior knowledge of the scan, as a person writes it down.

mod arm_table;
mod cell_file;
mod rewritten;
mod values;

pub use cell_file::{parse, parse_with_urdf, sensor_name, urdf_name};
pub use rewritten::{with_guess, with_plates, with_usual_sensor};

/// A cell to begin with: the paper's, with every key explained.
pub const EXAMPLE: &str = include_str!("../../assets/cell.toml");
/// The sensor of [`EXAMPLE`].
pub const EXAMPLE_SENSOR: &str = include_str!("../../assets/sensor.toml");

/// A cell of a profiler to begin with.
pub const PROFILER_EXAMPLE: &str = include_str!("../../assets/cell-profiler.toml");
/// The sensor of [`PROFILER_EXAMPLE`].
pub const PROFILER_EXAMPLE_SENSOR: &str = include_str!("../../assets/sensor-profiler.toml");
