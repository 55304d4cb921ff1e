//! Findings in a single profile of a joint.

use super::face::Face;
use super::face_end::FaceEnd;
use super::no_seam::NoSeam;
use super::seen_joint::{SeenJoint, SeenSeam};

/// Findings in a profile of a joint.
#[expect(clippy::large_enum_variant, reason = "one a profile, nearly always the large variant")]
pub(super) enum Sight {
    /// The joint.
    Joint(SeenJoint),
    /// One face with its ends; only other profiles determine which of them is its edge.
    Face {
        /// The face.
        face: Face,
        /// Half of it, mm.
        half_length_mm: f64,
        /// Its left end and its right one.
        ends: [Result<FaceEnd, NoSeam>; 2],
    },
}

impl Sight {
    /// The end of a face with its edge from other profiles, to the left (0) or to the right (1).
    pub(super) fn end(&self, side: usize) -> Option<FaceEnd> {
        match self {
            Self::Joint(_) => None,
            Self::Face { ends, .. } => ends[side].clone().ok(),
        }
    }

    /// The joint. For one face it is the remaining one if the ends `at_border` are not the plate's.
    pub(super) fn joint(self, at_border: [bool; 2]) -> Result<SeenJoint, NoSeam> {
        let (face, half_length_mm, ends) = match self {
            Self::Joint(joint) => return Ok(joint),
            Self::Face { face, half_length_mm, ends } => (face, half_length_mm, ends),
        };
        let [left, right] = ends;
        let end = match at_border {
            [true, true] => return Err(NoSeam::EndOfView),
            [false, false] => return Err(NoSeam::BothEnds),
            [false, true] => left?,
            [true, false] => right?,
        };
        let seam = SeenSeam::Edge { face: 0, end };
        Ok(SeenJoint { faces: [Some(face), None], half_lengths_mm: [half_length_mm; 2], seam })
    }
}
