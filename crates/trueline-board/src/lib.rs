//! Chessboards in files.
//!
//! ```text
//! pictures of a board ────────────pictures──▶ views ──▶ trueline_sensor::intrinsics
//! pictures of a board with stripe ─striped──▶ views ──▶ trueline_sensor::laser_plane
//! dataset folder with pictures ─moving_scan──▶ time offset and hand-eye transform
//! what was found ──────────────sensor_file──▶ sensor.toml
//! ```
//!
//! Nothing is printed and nothing is written.

mod error;
pub mod moving_scan;
pub mod pictures;
pub mod sensor_file;
pub mod striped;

pub use error::BoardError;
