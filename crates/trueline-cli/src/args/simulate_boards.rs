//! `trueline simulate --boards`.

use crate::args::seam_scan_options::SEAM_SCAN_OPTIONS;
use crate::args::sensor::board;
use clap::Args;
use trueline_sensor::Board;

#[derive(Args)]
#[command(next_help_heading = "Pictures of a chessboard (instead of a scan of a seam)")]
pub(crate) struct BoardsArgs {
    /// Write a sensor's calibration pictures of this board, chessboard:COLUMNSxROWS:SQUARE_MM, and its truth: boards
    /// (laser off), stripes (laser on), without-laser (the same poses) for `sensor`, and the scan moving for `calibrate
    /// --target board`
    #[arg(long, value_name = "BOARD", value_parser = board, conflicts_with_all = not_of_boards())]
    pub(crate) boards: Option<Board>,
    /// Pictures in each of boards, stripes and without-laser
    #[arg(long, value_name = "COUNT", default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=500), requires = "boards")]
    pub(crate) board_pictures: u32,
}

/// Options that do not apply to a board.
fn not_of_boards() -> Vec<&'static str> {
    [&SEAM_SCAN_OPTIONS[..], &["plates", "production", "images", "column_noise_px"]].concat()
}
