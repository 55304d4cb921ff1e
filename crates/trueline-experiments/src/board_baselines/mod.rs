//! What a checkerboard at standstill gives: the baselines of Table I that need a board.

pub mod hand_eye;
pub mod static_board;

pub use static_board::StaticRow;
