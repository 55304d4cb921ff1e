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
    let mut pairs = pairs(pieces, evidence.lens);
    let lengths = Lengths::of(evidence.lens);
    pairs.retain(|pair| lengths.suffice(pair.covered_px));
    pairs.sort_by(|a, b| b.score().total_cmp(&a.score()));
    let best = *pairs.first().ok_or(match pieces.len() {
        1 => NotFound::OnePiece,
        _ => NotFound::NotThisJoint,
    })?;
    if best.score() <= 0.0 {
        return Err(NotFound::NotThisJoint);
    }
    let elsewhere = |pair: &&Pair| (pair.corner() - best.corner()).norm() > SAME_PX;
    if pairs.iter().find(elsewhere).is_some_and(|rival| rival.score() > RIVAL * best.score()) {
        return Err(NotFound::Ambiguous);
    }
    measure(&mut work.meter, &best, sigmas_px(pieces, &best), (evidence.picture, evidence.lens))
}

/// Thickness of the stripe on the two pieces, px.
#[must_use]
pub fn sigmas_px(pieces: &[Piece], pair: &Pair) -> [f64; 2] {
    pair.pieces.map(|number| pieces[number].sigma_px)
}
