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

    /// The best of some corners, the best of those without a common segment with it, and so on. At the crossing of two
    /// stripes, or of the lines of their arms, there is no third one.
    #[must_use]
    pub(crate) fn distinct(corners: impl Iterator<Item = ArmPair> + Clone) -> Self {
        let mut list = [None; MOST_CORNERS];
        for taken in 0..MOST_CORNERS {
            let (before, place) = list.split_at_mut(taken);
            let is_free = |pair: &ArmPair| {
                let mut others = before.iter().flatten();
                !others.any(|other: &ArmPair| pair.segments.iter().any(|k| other.segments.contains(k)))
            };
            let free = corners.clone().filter(is_free);
            let Some(best) = free.max_by(|a, b| a.score().total_cmp(&b.score())) else { break };
            place[0] = Some(best);
        }
        Self(list)
    }

    /// The corners.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &ArmPair> + Clone {
        self.0.iter().flatten()
    }
}
