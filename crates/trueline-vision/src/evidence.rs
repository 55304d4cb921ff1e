//! Findings in a picture before the search for a joint.

use crate::frame::Frame;
use crate::joint::arm_pair::LeastArm;
use crate::locate::line_segment::LineSegment;
use crate::not_found::NotFound;

/// The picture and the straight segments of the stripe in it.
#[derive(Clone, Copy, Debug)]
pub struct Evidence<'a, L> {
    /// The picture and its lens.
    pub frame: Frame<'a, L>,
    /// The straight segments of the stripe, the strongest first.
    pub segments: &'a [LineSegment],
    /// How long the arms of a corner must be.
    pub least_arm: LeastArm,
}

impl<L> Evidence<'_, L> {
    /// The reason why there is no joint among the segments.
    #[must_use]
    pub(crate) fn no_joint(&self) -> NotFound {
        match self.segments {
            [only] => NotFound::OnePiece { length_px: only.length_px() },
            segments => NotFound::NotThisJoint { pieces: segments.len() },
        }
    }
}
