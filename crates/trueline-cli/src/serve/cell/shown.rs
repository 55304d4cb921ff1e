//! Content of a recording's page.

use super::growth::{Growth, Rate};
use trueline_cell::{CellState, RobotBrief};

/// Path of the picture.
pub(super) const PICTURE_PATH: &str = "/picture.png";

/// Present knowledge of a recording.
#[derive(Debug, Default)]
pub(super) struct Shown {
    /// Since it began, s.
    pub at_s: f64,
    /// The robot in words.
    pub robot: String,
    /// The robot's last pose.
    pub brief: RobotBrief,
    /// Camera and estimate.
    pub state: Option<CellState>,
    /// Poses a second.
    pub poses: Rate,
    /// Pictures a second.
    pub pictures: Rate,
    /// The estimate as it grew.
    pub growth: Growth,
}
