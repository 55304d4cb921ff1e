//! A curve that was scanned.

use serde::{Deserialize, Serialize};

/// A curve in base: the seam, if no straight line explains it.
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
    /// Points of it, in the order of the scan; empty if the scan does not determine its place.
    pub points_mm: Vec<[f64; 3]>,
    /// Standard deviation of each point square to the curve.
    pub sigma_mm: Vec<f64>,
    /// The drawing used for the estimate; absent if there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cad: Option<CadEntry>,
}

/// A drawing where the scan found it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct CadEntry {
    /// The file.
    pub file: String,
    /// How far the seam might be off it, one standard deviation.
    pub tolerance_mm: f64,
    /// Whether the answer is that with the drawing. It is not used if the scan alone is as certain: then the drawing is only
    /// placed.
    pub used: bool,
    /// Pose of the part: coordinates of the drawing to base; absent if the scan does not determine it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub base_from_part: Option<CadPose>,
    /// Root mean square distance of the seam from the drawing.
    pub rms_mm: f64,
    /// A turn after which the drawing lies on itself: the part's place about it is chosen, not measured. Absent where there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub symmetric_about: Option<SymmetryEntry>,
}

/// A pose of a part.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct CadPose {
    /// Its translation.
    pub translation_mm: [f64; 3],
    /// Its rotation.
    pub rotation_wxyz: [f64; 4],
}

/// An axis of symmetry in base.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct SymmetryEntry {
    /// Unit vector along it.
    pub axis: [f64; 3],
    /// A point of it.
    pub point_mm: [f64; 3],
    /// The rotation; null if any rotation fits.
    pub angle_deg: Option<f64>,
}
