//! One weld → its evidence about the stored calibration.

pub mod evidence;
pub mod linearized;
pub(crate) mod pieces;
pub(crate) mod plate_rows;
pub(crate) mod row;
mod seam_fit;
pub(crate) mod unknowns;
pub mod weld;
pub(crate) mod weld_error;
pub(crate) mod weld_statistic;

pub use evidence::{Chunk, Evidence};
pub use seam_fit::{SeamFit, fitted_seams};
pub use weld::{Weld, shape_origin_m};
pub use weld_error::WeldError;
pub use weld_statistic::WeldStatistic;
