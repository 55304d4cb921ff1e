//! The unknowns, their order, and how a tangent step moves them.

use nalgebra::{DVector, SVector, Vector3, Vector4};
use trueline_dataset::Guess;
use trueline_geometry::{Line, Pose, se3};

/// Index of the time offset in the tangent.
pub const TIME_OFFSET: usize = 0;
/// First index of the hand-eye rotation.
pub const ROTATION: usize = 1;
/// First index of the hand-eye translation.
pub const TRANSLATION: usize = 4;
/// First index of the lines; each has [`Line::DIMENSION`].
pub const LINES: usize = 7;
/// Unknowns that one observation depends on: those of sensor and clock, and its own line's.
pub const LOCAL: usize = LINES + Line::DIMENSION;

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

    /// How clock and sensor differ from another value of theirs, as a tangent step: what [`Parameters::retract`] adds.
    #[must_use]
    pub fn minus(&self, from: &Guess) -> SVector<f64, LINES> {
        let (turn, shift) = se3::difference_decoupled(&self.tool_from_camera, &from.tool_from_camera);
        let mut step = SVector::<f64, LINES>::zeros();
        step[TIME_OFFSET] = self.time_offset_s - from.time_offset_s;
        step.fixed_rows_mut::<3>(ROTATION).copy_from(&turn);
        step.fixed_rows_mut::<3>(TRANSLATION).copy_from(&shift);
        step
    }

    /// Time offset and hand-eye transform alone.
    #[must_use]
    pub fn guess(&self) -> Guess {
        Guess { time_offset_s: self.time_offset_s, tool_from_camera: self.tool_from_camera }
    }
}

/// First index of a line in the tangent.
#[must_use]
pub fn line_index(line: usize) -> usize {
    LINES + Line::DIMENSION * line
}

/// Index among all unknowns of one of those that an observation of `line` depends on.
#[must_use]
pub fn global_index(local: usize, line: usize) -> usize {
    if local < LINES { local } else { line_index(line) + local - LINES }
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
