//! Pieces of a drawing, joined end to end.

use super::pairs::Pairs;
use crate::error::Error;
use nalgebra::Vector3;

/// Ends nearer than this part of the drawing's size meet: programs write few decimals.
const MEETS: f64 = 1e-5;
/// Pieces of a curve at most: joining looks at each pair of them.
const MOST_PIECES: usize = 20_000;

/// Points along an entity, in the unit of the drawing.
pub(super) struct Piece {
    /// Its first line in the file.
    pub(super) line: u64,
    /// The points.
    pub(super) points: Vec<Vector3<f64>>,
}

/// All pieces as one curve.
pub(super) fn one_curve(pairs: &Pairs<'_>, mut pieces: Vec<Piece>) -> Result<Vec<Vector3<f64>>, Error> {
    pieces.retain(|piece| !piece.points.is_empty());
    if pieces.is_empty() || pieces.len() > MOST_PIECES {
        let what =
            if pieces.is_empty() { "a drawing with no curve in it" } else { "a drawing of too many pieces" };
        let hint = "export the seam alone, as a polyline, arcs or a spline among the entities; blocks are \
            ignored";
        return Err(pairs.file_error(what, hint));
    }
    let near = MEETS * size(&pieces);
    let mut curve = pieces.remove(0).points;
    while !pieces.is_empty() {
        let (first, last) = (curve[0], curve[curve.len() - 1]);
        let ends = |piece: &Piece| [piece.points[0], piece.points[piece.points.len() - 1]];
        let gap = |piece: &Piece| {
            let [begin, end] = ends(piece);
            [last - begin, last - end, first - end, first - begin].map(|gap| gap.norm())
        };
        let at = pieces.iter().position(|piece| gap(piece).iter().any(|gap| *gap <= near));
        let Some(at) = at else {
            let least = |piece: &Piece| gap(piece).into_iter().fold(f64::INFINITY, f64::min);
            let (line, off) = (pieces[0].line, least(&pieces[0]));
            let what = format!(
                "a drawing of several curves: the piece that begins here is {off:.3} (in its unit) from the others"
            );
            return Err(pairs.error(line, what, "export one seam; its pieces must meet"));
        };
        let piece = pieces.remove(at);
        let gaps = gap(&piece);
        let which = (0..4).find(|k| gaps[*k] <= near);
        let mut points = piece.points;
        if matches!(which, Some(1 | 3)) {
            points.reverse();
        }
        if matches!(which, Some(0 | 1)) {
            curve.extend(points);
        } else {
            points.append(&mut curve);
            curve = points;
        }
    }
    // At the joint of two pieces the same point occurs twice.
    let last = curve.len() - 1;
    let is_ring = last > 2 && (curve[last] - curve[0]).norm() <= near;
    curve.dedup_by(|next, before| (*next - *before).norm() <= near);
    if is_ring {
        let (first, last) = (curve[0], curve.len() - 1);
        curve[last] = first;
    }
    Ok(curve)
}

fn size(pieces: &[Piece]) -> f64 {
    let mut points = pieces.iter().flat_map(|piece| &piece.points);
    let first = points.next().copied().unwrap_or_default();
    let (low, high) = points.fold((first, first), |(low, high), point| (low.inf(point), high.sup(point)));
    (high - low).norm()
}
