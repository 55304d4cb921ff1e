//! The bottom of a groove: the crossing of its two faces, each of which ends at a plate.

use crate::detection::Detection;
use crate::evidence::Evidence;
use crate::joint::arm_pair::{ArmPair, LEAST_FACE_PX, are_alike, heaviest_reason, is_long, pairs_over_root};
use crate::joint::corner::measure;
use crate::lens::Lens;
use crate::locate::line_segment::LineSegment;
use crate::measure::stripe_meter::StripeMeter;
use crate::not_found::NotFound;
use crate::picture::Level;
use crate::stripe_choice::StripeChoice;

/// Distance within which the end of a face meets a plate, px.
const MEETS_PX: f64 = 40.0;
/// A second bottom with this part of the best one's evidence makes it doubtful, if it is further away than this, px.
const RIVAL: f64 = 0.8;
const SAME_PX: f64 = 10.0;

/// Finds the bottom.
///
/// # Errors
/// The reason why there is none.
pub(crate) fn find<L: Level>(
    evidence: &Evidence<'_, L>,
    choice: StripeChoice,
    meter: &mut StripeMeter,
) -> Result<Detection, NotFound> {
    let (segments, lens) = (evidence.segments, evidence.frame.lens);
    let judged = || {
        pairs_over_root(segments, lens)
            .map(|(weight, pair)| (weight, pair.and_then(|pair| face_pair(pair, lens))))
    };
    let grooves = || {
        let likely = judged().filter_map(|(_, pair)| pair.ok());
        likely
            .filter(|pair| {
                pair.score() > 0.0 && are_alike(&segments[pair.segments[0]], &segments[pair.segments[1]])
            })
            .map(|pair| (flanks(segments, &pair), pair))
            // If much of the root is dark, only both plates show that the faces belong together.
            .filter(|(flanks, pair)| *flanks > usize::from(pair.is_open()))
    };
    // A groove with both plates comes before one with one; then the one with more light on its faces.
    let better =
        |a: &(usize, ArmPair), b: &(usize, ArmPair)| a.0.cmp(&b.0).then(a.1.score().total_cmp(&b.1.score()));
    let best = grooves().max_by(better);
    let (flanked, best) = best.ok_or_else(|| heaviest_reason(judged(), evidence.no_joint()))?;
    if choice != StripeChoice::Strongest {
        let alike = grooves().filter(|(flanks, _)| *flanks == flanked).map(|(_, pair)| pair);
        let meant = choice.among(alike, ArmPair::score, ArmPair::corner, lens);
        return measure(meter, &meant.unwrap_or(best), evidence.frame);
    }
    let apart = |pair: &ArmPair| (pair.corner() - best.corner()).norm();
    let is_rival = |(flanks, pair): &(usize, ArmPair)| {
        *flanks == flanked && apart(pair) > SAME_PX && pair.score() > RIVAL * best.score()
    };
    if let Some((_, rival)) = grooves().find(is_rival) {
        return Err(NotFound::Ambiguous { distance_px: apart(&rival) });
    }
    measure(meter, &best, evidence.frame)
}

/// The pair, if it can be the faces of a groove.
fn face_pair(pair: ArmPair, lens: &Lens) -> Result<ArmPair, NotFound> {
    let pair = pair.on_side(false, lens)?;
    if pair.continuous_px.iter().all(|px| *px > LEAST_FACE_PX) {
        return Ok(pair);
    }
    Err(NotFound::ArmsTooShort { arms_px: pair.continuous_px, needed_px: LEAST_FACE_PX })
}

/// Number of faces that end at a plate, 0 to 2.
#[must_use]
pub(crate) fn flanks(segments: &[LineSegment], pair: &ArmPair) -> usize {
    (0..2)
        .filter(|face| {
            let end = pair.arms[*face].at(pair.lengths[*face]);
            let others = segments.iter().enumerate().filter(|(number, _)| !pair.segments.contains(number));
            others.into_iter().any(|(_, plate)| {
                let [first, last] = plate.span();
                let nearest = plate.line.station(&end).clamp(first, last);
                (plate.line.at(nearest) - end).norm() < MEETS_PX && is_plate(plate, pair, *face)
            })
        })
        .count()
}

/// Whether a segment at the end of a face is the plate of a groove. It leads outward, turned back from the face, is long,
/// and has no light over the opening.
fn is_plate(plate: &LineSegment, pair: &ArmPair, face: usize) -> bool {
    let [end, other_end] = [face, 1 - face].map(|k| pair.arms[k].at(pair.lengths[k]));
    let [along, other_along] = [pair.arms[face].along, pair.arms[1 - face].along];
    // Along the stripe it turns one way at the root, and the other way at a shoulder.
    let root = (-other_along).perp(&along);
    let outward = if root * along.perp(&plate.line.along) < 0.0 { 1.0 } else { -1.0 };
    let at = plate.line.station(&end);
    let covered_px = |from: f64, to: f64| {
        let [a, b] = [at + outward * from, at + outward * to];
        plate.covered_px(a.min(b), a.max(b))
    };
    let opening_px = (other_end - end).norm() - 2.0 * MEETS_PX;
    let over_opening = opening_px > 0.0 && covered_px(-MEETS_PX - opening_px, -MEETS_PX) > 0.5 * opening_px;
    is_long(covered_px(-MEETS_PX, plate.length_px()), plate.sigma_px) && !over_opening
}
