//! The corner of a fillet: the pair of pieces with the most light on it and the least against it.

use crate::corner::{Pair, measure, pairs};
use crate::detector::{Evidence, Workspace};
use crate::picture::Level;
use crate::pieces::Piece;
use crate::seam::{Lengths, NotFound, Seam};

/// A second corner with this part of the best one's evidence makes it doubtful.
const RIVAL: f64 = 0.9;
/// Corners nearer to each other than this are the same, px.
const SAME_PX: f64 = 10.0;

/// Finds the corner.
///
/// # Errors
/// Why there is none.
pub fn find<L: Level>(evidence: &Evidence<'_, L>, work: &mut Workspace) -> Result<Seam, NotFound> {
    let pieces = evidence.pieces;
    let lengths = Lengths::of(evidence.lens);
    // The corner of a fillet lies behind its arms; what lies before them is an edge, or a crossing with a ghost.
    let fillet = |pair: &Pair| lengths.suffice(pair.covered_px) && pair.is_valley(evidence.lens);
    let long = || pairs(pieces, evidence.lens).filter(fillet);
    let best = long().max_by(|a, b| a.score().total_cmp(&b.score())).ok_or(evidence.no_joint())?;
    if best.score() <= 0.0 {
        return Err(NotFound::NotThisJoint);
    }
    let elsewhere = |pair: &Pair| (pair.corner() - best.corner()).norm() > SAME_PX;
    if long().any(|pair| elsewhere(&pair) && pair.score() > RIVAL * best.score()) {
        return Err(NotFound::Ambiguous);
    }
    measure(&mut work.meter, &best, sigmas_px(pieces, &best), (evidence.picture, evidence.lens))
}

/// Thickness of the stripe on the two pieces, px.
#[must_use]
pub fn sigmas_px(pieces: &[Piece], pair: &Pair) -> [f64; 2] {
    pair.pieces.map(|number| pieces[number].sigma_px)
}
