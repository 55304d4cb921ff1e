//! The sensor's own axes, for words that a person can point at.

use nalgebra::Matrix3;

/// Along the stripe, square to the laser plane (along the seam), and depth, in the tool frame.
#[derive(Clone, Copy, Debug)]
pub struct SensorAxes {
    /// As columns.
    pub tool_from_axes: Matrix3<f64>,
}

/// Names of the axes.
pub const AXES: [&str; 3] = ["across", "along", "depth"];

/// The same in words.
pub const IN_WORDS: [&str; 3] = ["along the stripe", "along the seam", "in depth"];
