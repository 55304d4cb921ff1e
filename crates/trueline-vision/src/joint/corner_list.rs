//! The corners of a picture, in fixed memory, for joints that are made of several.

use crate::joint::arm_pair::{ArmPair, pairs};
use crate::lens::Lens;
use crate::locate::line_segment::{LineSegment, MOST_SEGMENTS};

/// Every pair of segments once.
const MOST_CORNERS: usize = MOST_SEGMENTS * (MOST_SEGMENTS - 1) / 2;

/// Corners of one kind.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CornerList([Option<ArmPair>; MOST_CORNERS]);

impl CornerList {
    /// The ridges, or else the valleys, among the segments.
    #[must_use]
    pub(crate) fn of(segments: &[LineSegment], ridge: bool, lens: &Lens) -> Self {
        let mut list = [None; MOST_CORNERS];
        let corners = pairs(segments, lens).filter_map(|(_, pair)| pair.ok()?.on_side(ridge, lens).ok());
        for (place, corner) in list.iter_mut().zip(corners.filter(|pair| pair.score() > 0.0)) {
            *place = Some(corner);
        }
        Self(list)
    }

    /// The corners.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &ArmPair> + Clone {
        self.0.iter().flatten()
    }
}
