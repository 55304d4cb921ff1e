//! The effect of one source of error on an answer.

use nalgebra::DMatrix;

/// The source of a part of an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ShareOf {
    /// Random noise.
    Noise,
    /// Common error of the stamps.
    Stamps,
    /// The sensor's own calibration.
    Sensor,
    /// The robot.
    Robot,
    /// Bow and form of the seam.
    SeamForm,
    /// The detector's bias with the tilt.
    Detector,
    /// The lag of the robot behind its recorded poses.
    PoseLag,
    /// The radius of the edge.
    EdgeRadius,
    /// Held quantities that are not known exactly.
    Held,
    /// Prior uncertainty of external axes.
    Axes,
}

/// Effect of an error on the unknowns: columns in the tangent, each of unit variance.
#[derive(Clone, Debug)]
pub(crate) struct Share {
    /// Its source.
    pub of: ShareOf,
    /// The columns.
    pub columns: DMatrix<f64>,
    /// The corresponding errors of the sensor's shape (5 × columns), if it is held.
    pub shape: Option<DMatrix<f64>>,
}
