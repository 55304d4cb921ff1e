//! The unknowns of a problem, and their order in the tangent.
//!
//! | block | numbers | present |
//! |---|---|---|
//! | time offset t_d (s) | 1 | always |
//! | hand-eye rotation, left, tool frame (rad) | 3 | always |
//! | hand-eye translation (m) | 3 | always |
//! | line θ₂, θ₃ (rad), δ₂, δ₃ (m) | 4 | for each line |
//! | bow κ₂, κ₃ (m) | 2 | for each line, depending on [`Model`] |
//! | shape h₁ … h₅ (1, 1, 1, 1/m, 1/m) | 5 | depending on [`Model`] |
//!
//! This is their order. The first four are estimated without a prior. The others have a prior and are nuisance blocks. An observation depends on the
//! blocks of sensor and clock and on those of its own line. These are its *local* unknowns, in the same order.

use crate::problem::layout::Layout;
use std::ops::Range;
use trueline_geometry::Line;
use trueline_model::{Curvature, SheetShape};

/// Index of the time offset in the tangent.
pub const TIME_OFFSET: usize = 0;
/// First index of the hand-eye rotation.
pub const ROTATION: usize = 1;
/// First index of the hand-eye translation.
pub const TRANSLATION: usize = 4;
/// First index of the lines; each has [`Line::DIMENSION`].
pub const LINES: usize = 7;
/// Local unknowns of a straight line and an exact sensor.
pub const LOCAL_STRAIGHT: usize = LINES + Line::DIMENSION;
/// The same with the line's bow.
pub const LOCAL_BOWED: usize = LOCAL_STRAIGHT + Curvature::DIMENSION;
/// Local unknowns with the sensor's shape: the maximum.
pub const LOCAL_ALL: usize = LOCAL_BOWED + SheetShape::DIMENSION;

/// The parts of a scan that are modelled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Model {
    /// Straight lines, an exact sensor.
    Straight,
    /// Lines that may bow.
    Bowed,
    /// Bows, and a sensor whose sheet has a shape.
    Shaped,
}

/// The blocks of a problem.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unknowns {
    /// Number of lines.
    pub lines: usize,
    /// The model.
    pub model: Model,
}

impl Layout for Unknowns {
    fn count(&self) -> usize {
        self.local()
    }

    fn index(&self, local: usize, line: usize) -> Option<usize> {
        Some(self.place(local, line))
    }
}

impl Unknowns {
    /// Number of unknowns without a prior: time offset, hand-eye and lines.
    #[must_use]
    pub(crate) fn asked_for(&self) -> usize {
        line_index(self.lines)
    }

    /// Unknowns with a prior: bows and shape.
    #[must_use]
    pub(crate) fn known_before(&self) -> Range<usize> {
        self.asked_for()..self.dimension()
    }

    /// Number of unknowns.
    #[must_use]
    #[inline]
    pub fn dimension(&self) -> usize {
        match self.model {
            Model::Straight => self.asked_for(),
            Model::Bowed => self.bow(self.lines).start,
            Model::Shaped => self.bow(self.lines).start + SheetShape::DIMENSION,
        }
    }

    /// Indices of the bow of a line. Empty if lines are straight.
    #[must_use]
    pub fn bow(&self, line: usize) -> Range<usize> {
        if self.model == Model::Straight {
            return 0..0;
        }
        let first = self.asked_for() + Curvature::DIMENSION * line;
        first..first + Curvature::DIMENSION
    }

    /// Indices of the shape. Empty if the sensor is exact.
    #[must_use]
    pub fn shape(&self) -> Range<usize> {
        if self.model == Model::Shaped { self.bow(self.lines).start..self.dimension() } else { 0..0 }
    }

    /// Number of local unknowns of an observation.
    #[must_use]
    #[inline]
    pub fn local(&self) -> usize {
        match self.model {
            Model::Straight => LOCAL_STRAIGHT,
            Model::Bowed => LOCAL_BOWED,
            Model::Shaped => LOCAL_ALL,
        }
    }

    /// Index among all unknowns of a local one of an observation of `line`.
    #[must_use]
    #[inline]
    pub fn place(&self, local: usize, line: usize) -> usize {
        match local {
            0..LINES => local,
            LINES..LOCAL_STRAIGHT => line_index(line) + local - LINES,
            LOCAL_STRAIGHT..LOCAL_BOWED => self.bow(line).start + local - LOCAL_STRAIGHT,
            _ => self.shape().start + local - LOCAL_BOWED,
        }
    }

    /// Names of the tangent's components, with SI units.
    #[must_use]
    pub fn names(&self) -> Vec<String> {
        let mut names = vec!["time_offset_s".to_owned()];
        names.extend(["x", "y", "z"].map(|axis| format!("rotation_{axis}_rad")));
        names.extend(["x", "y", "z"].map(|axis| format!("translation_{axis}_m")));
        for line in 0..self.lines {
            let parts = ["turn_2_rad", "turn_3_rad", "offset_2_m", "offset_3_m"];
            names.extend(parts.map(|part| format!("line_{line}_{part}")));
        }
        if self.model != Model::Straight {
            names.extend(
                (0..self.lines)
                    .flat_map(|line| ["bow_2_m", "bow_3_m"].map(|part| format!("line_{line}_{part}"))),
            );
        }
        if self.model == Model::Shaped {
            let parts = ["width", "depth", "shear", "keystone_a_per_m", "keystone_b_per_m"];
            names.extend(parts.map(|part| format!("shape_{part}")));
        }
        names
    }
}

/// First index of a line in the tangent.
#[must_use]
pub fn line_index(line: usize) -> usize {
    LINES + Line::DIMENSION * line
}

#[cfg(test)]
mod tests {
    use super::*;

    const MODELS: [(Model, usize, usize); 3] =
        [(Model::Straight, 11, 15), (Model::Bowed, 13, 19), (Model::Shaped, 18, 24)];

    #[test]
    fn blocks_lie_one_after_the_other() {
        for (model, local, dimension) in MODELS {
            let two = Unknowns { lines: 2, model };
            assert_eq!((two.local(), two.dimension(), two.asked_for()), (local, dimension, 15));
            assert_eq!(two.known_before(), 15..dimension);
            let bows = if model == Model::Straight { [0..0, 0..0] } else { [15..17, 17..19] };
            assert_eq!([two.bow(0), two.bow(1)], bows);
            assert_eq!(two.shape(), if model == Model::Shaped { 19..24 } else { 0..0 });
        }
        assert_eq!([line_index(0), line_index(1), line_index(2)], [7, 11, 15]);
    }

    #[test]
    fn each_local_unknown_has_the_place_whose_name_it_bears() {
        for (model, local, dimension) in MODELS {
            let two = Unknowns { lines: 2, model };
            let names = two.names();
            assert_eq!(names.len(), dimension);
            for line in 0..2 {
                let own: Vec<String> = (0..local).map(|k| names[two.place(k, line)].clone()).collect();
                let mut expected: Vec<String> = [
                    "time_offset_s",
                    "rotation_x_rad",
                    "rotation_y_rad",
                    "rotation_z_rad",
                    "translation_x_m",
                    "translation_y_m",
                    "translation_z_m",
                ]
                .map(str::to_owned)
                .into();
                let of_line = ["turn_2_rad", "turn_3_rad", "offset_2_m", "offset_3_m", "bow_2_m", "bow_3_m"];
                expected.extend(of_line.map(|part| format!("line_{line}_{part}")));
                let of_shape = ["width", "depth", "shear", "keystone_a_per_m", "keystone_b_per_m"];
                expected.extend(of_shape.map(|part| format!("shape_{part}")));
                assert_eq!(own, expected[..local]);
            }
        }
    }
}
