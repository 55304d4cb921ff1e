//! Answers that a scan does not separate from the given one.

use super::answer::{LineEntry, PoseEntry};
use serde::{Deserialize, Serialize};

/// A complete answer that explains the scan as well.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct RivalEntry {
    /// Its time offset.
    pub time_offset_s: f64,
    /// Its hand-eye transform.
    pub tool_from_camera: PoseEntry,
    /// Its lines in base.
    pub lines: Vec<LineEntry>,
    /// Part of the features that it explains, among those that both answers can place.
    pub explains: f64,
    /// Lead of the given answer: z of the paired test over frames; within ± 5 it is not clear.
    pub z: f64,
    /// How much larger its residuals are than expected.
    pub noise_factor: f64,
    /// Statements about the cell; each of them would decide for it: `--offset-within 0.20`, `--looks +z`.
    pub statements: Vec<String>,
}
