//! Calibrates the sensor itself, from pictures of a chessboard: the camera's intrinsics, the laser plane, and where the camera
//! is on the robot.
//!
//! ```text
//! picture ──chessboard──▶ view ──intrinsics──▶ camera ─┐
//! picture ──stripe──────▶ pixels of the stripe ────────┴─laser_plane──▶ plane (boards, or a plain plate and the robot)
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
//! // The stripe on six boards in a plane that leans by 45°, y = z − 0.3 m, each board nearer or farther.
//! let stripe = |z: f64| (0..20).map(|k| Vector3::new(0.002 * f64::from(k), z - 0.3, z)).collect::<Vec<_>>();
//! let boards: Vec<_> = (0..6).map(|k| stripe(0.25 + 0.02 * f64::from(k))).collect();
//! let fit = fit_points(&boards)?;
//! assert!((fit.plane.offset() - 0.3 / 2_f64.sqrt()).abs() < 1e-9 && fit.rms_m < 1e-9);
//! # Ok::<(), trueline_sensor::Error>(())
//! ```

pub mod board;
pub mod board_files;
pub mod board_hand_eye;
pub mod bundle;
mod bundle_state;
pub mod chessboard;
pub mod error;
pub mod gray;
pub mod homography;
pub mod intrinsics;
mod inverse_of_free;
pub mod laser_plane;
mod picture_fit;
mod pixel_ray;
pub mod pose_verdict;
pub mod projection;
pub mod round;
pub mod sheet;
pub mod sheet_tilt;
pub mod stripe_residual;
pub mod verdict;

pub use board::{Board, FoundCorner, View};
pub use error::Error;
pub use gray::Gray;
