//! The corner of a fillet: the pair of segments with the most light on it and the least against it.

use crate::evidence::Evidence;
use crate::joint::corner::{Pair, measure, pairs, sigmas_px};
use crate::measure::stripe_meter::StripeMeter;
use crate::picture::Level;
use crate::seam::{Lengths, NotFound, Seam};

/// A second corner with this part of the best one's evidence makes it doubtful.
const RIVAL: f64 = 0.9;
/// Corners nearer to each other than this are the same, px.
const SAME_PX: f64 = 10.0;

/// Finds the corner.
///
/// # Errors
/// Why there is none.
pub fn find<L: Level>(evidence: &Evidence<'_, L>, meter: &mut StripeMeter) -> Result<Seam, NotFound> {
    let segments = evidence.segments;
    let lengths = Lengths::of(evidence.frame.lens);
    // The corner of a fillet lies behind its arms; what lies before them is an edge, or a crossing with a ghost.
    let fillet = |pair: &Pair| lengths.suffice(pair.covered_px) && pair.is_valley(evidence.frame.lens);
    let long = || pairs(segments, evidence.frame.lens).filter(fillet);
    let best = long().max_by(|a, b| a.score().total_cmp(&b.score())).ok_or(evidence.no_joint())?;
    if best.score() <= 0.0 {
        return Err(NotFound::NotThisJoint);
    }
    let elsewhere = |pair: &Pair| (pair.corner() - best.corner()).norm() > SAME_PX;
    if long().any(|pair| elsewhere(&pair) && pair.score() > RIVAL * best.score()) {
        return Err(NotFound::Ambiguous);
    }
    measure(meter, &best, sigmas_px(segments, &best), evidence.frame)
}
