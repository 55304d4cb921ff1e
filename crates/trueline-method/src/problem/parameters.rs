//! The unknowns, their order, and how a tangent step moves them.

use nalgebra::{DVector, Vector3, Vector4};
use trueline_geometry::{Line, Pose, se3};

/// Index of the time offset in the tangent.
pub const TIME_OFFSET: usize = 0;
/// First index of the hand-eye rotation.
pub const ROTATION: usize = 1;
/// First index of the hand-eye translation.
pub const TRANSLATION: usize = 4;
/// First index of the lines; each has [`Line::DIMENSION`].
pub const LINES: usize = 7;

/// One value of all unknowns.
///
/// Tangent: \[t_d (s) | hand-eye rotation, left, tool frame (rad) | hand-eye translation (m) | for each line
/// θ₂, θ₃ (rad), δ₂, δ₃ (m)\].
#[derive(Clone, Debug, PartialEq)]
pub struct Parameters {
    /// Time offset t_d, s.
    pub time_offset_s: f64,
    /// Hand-eye transform.
    pub tool_from_camera: Pose,
    /// The lines in base.
    pub lines: Vec<Line>,
}

impl Parameters {
    /// Number of unknowns.
    #[must_use]
    pub fn dimension(&self) -> usize {
        LINES + Line::DIMENSION * self.lines.len()
    }

    /// Moves all unknowns by a tangent step \[Yang2025, Eq. 18\].
    #[must_use]
    pub fn retract(&self, step: &DVector<f64>) -> Self {
        let three = |first: usize| Vector3::new(step[first], step[first + 1], step[first + 2]);
        let lines = self.lines.iter().enumerate().map(|(k, line)| {
            let first = line_index(k);
            line.retract(&Vector4::from_fn(|row, _| step[first + row]))
        });
        Self {
            time_offset_s: self.time_offset_s + step[TIME_OFFSET],
            tool_from_camera: se3::retract_decoupled(
                &self.tool_from_camera,
                &three(ROTATION),
                &three(TRANSLATION),
            ),
            lines: lines.collect(),
        }
    }
}

/// First index of a line in the tangent.
#[must_use]
pub fn line_index(line: usize) -> usize {
    LINES + Line::DIMENSION * line
}

/// Names of the tangent's components, with SI units.
#[must_use]
pub fn names(lines: usize) -> Vec<String> {
    let mut names = vec!["time_offset_s".to_owned()];
    names.extend(["x", "y", "z"].map(|axis| format!("rotation_{axis}_rad")));
    names.extend(["x", "y", "z"].map(|axis| format!("translation_{axis}_m")));
    for line in 0..lines {
        let parts = ["turn_2_rad", "turn_3_rad", "offset_2_m", "offset_3_m"];
        names.extend(parts.map(|part| format!("line_{line}_{part}")));
    }
    names
}
