//! A curve that was scanned.

use serde::{Deserialize, Serialize};

/// A curve in base: the seam, where no straight line explains it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct CurveEntry {
    /// Which, among the lines of the features.
    pub label: String,
    /// Whether its end is its beginning.
    pub closed: bool,
    /// Its length.
    pub length_mm: f64,
    /// Number of knots.
    pub knots: usize,
    /// Their distance.
    pub spacing_mm: f64,
    /// Standard deviation of the third differences of its control points, by restricted maximum likelihood: how much it bends.
    pub s3_mm: f64,
    /// Effective number of unknowns of curve, time offset and hand-eye transform.
    pub edf: f64,
    /// Points of it, in the order of the scan; empty where the scan does not show where it is.
    pub points_mm: Vec<[f64; 3]>,
    /// Standard deviation of each point square to the curve.
    pub sigma_mm: Vec<f64>,
}
