//! `trueline simulate --boards`.

use crate::sensor::board;
use clap::Args;
use trueline_sensor::Board;

#[derive(Args)]
#[command(next_help_heading = "Pictures of a chessboard (instead of a scan of a seam)")]
pub struct BoardsArgs {
    /// Write what a sensor is calibrated from with this board, chessboard:COLUMNSxROWS:SQUARE_MM, and its truth: boards (laser
    /// off), stripes (laser on), without-laser (the same poses) for `sensor`, and the scan moving for `calibrate --target board`
    #[arg(long, value_name = "BOARD", value_parser = board, conflicts_with_all = NOT_OF_BOARDS)]
    pub boards: Option<Board>,
    /// Pictures in each of boards, stripes and without-laser
    #[arg(long, value_name = "COUNT", default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=500), requires = "boards")]
    pub board_pictures: u32,
}

/// Options that say nothing of a board.
const NOT_OF_BOARDS: [&str; 20] = [
    "PathArgs",
    "preset",
    "plan",
    "random_cell",
    "noise_free",
    "duration_s",
    "robot_period_ms",
    "frame_period_ms",
    "feature_noise_px",
    "feature_noise_mm",
    "robot_noise_mm",
    "stamp_jitter_ms",
    "clock_drift_ppm",
    "outliers",
    "drops",
    "faults",
    "plates",
    "production",
    "images",
    "column_noise_px",
];
