//! Chessboards in files.
//!
//! ```text
//! pictures of a board ────────────pictures──▶ views ──▶ trueline_sensor::intrinsics
//! pictures of a board with stripe ─striped──▶ views ──▶ trueline_sensor::laser_plane
//! pictures of a plate, with poses ─plate_stops──▶ stops ──▶ trueline_sensor::laser_plane::plate
//! dataset folder with pictures ─moving_scan──▶ time offset and hand-eye transform
//! dataset folder of sightings ─────pose_scan──▶ time offset, hand-eye transform and target
//! dataset folder with a sphere or cylinder ─round_scan──▶ time offset, hand-eye transform and target
//! what was found ──────────────sensor_file──▶ sensor.toml
//! ```
//!
//! Nothing is printed and nothing is written.
//!
//! ```
//! use std::path::Path;
//! use trueline_sensor::board_files::sensor_file;
//! use trueline_dataset::{sensor_toml, stripe_points_csv};
//! use trueline_sensor::laser_plane::fit_points;
//!
//! // The laser's stripe on four boards, in the plane z = 300 mm.
//! let mut table = "board,x_mm,y_mm,z_mm\n".to_owned();
//! for board in 0..4 {
//!     for k in 0..10 {
//!         table += &format!("{board},{},{},300\n", 5 * k, 20 * board);
//!     }
//! }
//! let boards = stripe_points_csv::read(Path::new("points.csv"), table.as_bytes())?;
//! let fit = fit_points(&boards.into_values().collect::<Vec<_>>())?;
//! let text = sensor_toml::format_file(&sensor_file::of_points(&fit));
//! assert!(text.contains("[laser_plane]") && (fit.plane.offset() - 0.3).abs() < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod arcs;
mod axis_start;
mod error;
pub mod moving_scan;
pub mod pictures;
pub mod plate_stops;
pub mod pose_scan;
pub mod round_scan;
pub mod sensor_file;
pub mod striped;

pub use error::BoardError;
