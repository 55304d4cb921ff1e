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
