//! The truth in a cell.

use crate::cell::Cell;
use trueline_geometry::{Axis, Line, Pose};

/// The unknown truth of a cell: hand-eye transform, line and external axes.
#[derive(Clone, Debug)]
pub struct Truth {
    /// Hand-eye transform.
    pub tool_from_camera: Pose,
    /// The line, anchored in the middle of the seam.
    pub line: Line,
    /// The external axes, in the order of the cell's.
    pub axes: Vec<Axis>,
}

impl Truth {
    /// As the guess has it; `None` if both ends of the seam are one point.
    #[must_use]
    pub fn guessed(cell: &Cell) -> Option<Self> {
        let axes = cell.axes.iter().map(|axis| axis.axis).collect();
        Some(Self { tool_from_camera: cell.tool_from_camera, line: cell.seam.line()?, axes })
    }
}
