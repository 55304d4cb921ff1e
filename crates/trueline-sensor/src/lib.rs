//! Calibrates the sensor itself, from pictures of a chessboard: the camera's intrinsics, the laser plane, and where the camera
//! is on the robot.
//!
//! ```text
//! picture ──chessboard──▶ view ──intrinsics──▶ camera ─┐
//! picture ──stripe──────▶ pixels of the stripe ────────┴─laser_plane──▶ plane
//! views and robot ──board_hand_eye──▶ time offset and hand-eye transform
//! ```
//!
//! Pictures come in as gray levels and results go out as values: no files, no threads, no printing. Metre, radian and
//! pixel; pixel (0, 0) is the centre of the top-left pixel.
//!
//! ```
//! use nalgebra::Vector3;
//! use trueline_sensor::laser_plane::fit_points;
//!
//! // The stripe on six boards, tilted to every side, in a laser plane 300 mm in front of the camera.
//! let boards: Vec<Vec<Vector3<f64>>> = (0..6)
//!     .map(|board| {
//!         let (sine, cosine) = (f64::from(board) * 0.5).sin_cos();
//!         (-10..=10).map(|k| 0.004 * f64::from(k)).map(|s| Vector3::new(s * cosine, s * sine, 0.3)).collect()
//!     })
//!     .collect();
//! let fit = fit_points(&boards)?;
//! assert!((fit.plane.offset() - 0.3).abs() < 1e-9);
//! # Ok::<(), trueline_sensor::Error>(())
//! ```

pub mod board;
pub mod board_hand_eye;
pub mod bundle;
mod bundle_state;
pub mod camera_inverse;
pub mod chessboard;
pub mod error;
pub mod gray;
pub mod homography;
pub mod intrinsics;
pub mod laser_plane;
pub mod picture_fit;
pub mod projection;
pub mod sheet_tilt;
pub mod stripe_residual;
pub mod verdict;

pub use board::{Board, FoundCorner, View};
pub use error::Error;
pub use gray::Gray;
