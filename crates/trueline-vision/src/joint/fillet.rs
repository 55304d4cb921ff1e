//! A corner of two plates, seen from inside (fillet) or from outside (the corner of a block): the pair of arms with the
//! most light on it and the least against it.

use crate::detection::Detection;
use crate::evidence::Evidence;
use crate::joint::arm_pair::{ArmPair, heaviest_reason, pairs, toe};
use crate::joint::corner::measure;
use crate::joint::corner_list::CornerList;
use crate::joint::turn::at_corner;
use crate::measure::stripe_meter::StripeMeter;
use crate::not_found::NotFound;
use crate::picture::Level;
use crate::stripe_choice::StripeChoice;

/// A second corner with this part of the best one's evidence makes it doubtful.
const RIVAL: f64 = 0.9;
/// Corners nearer to each other than this are the same, px.
const SAME_PX: f64 = 10.0;

/// Finds the corner with arms towards the camera or, on a `ridge`, away from it. Light on the other side is another
/// object, or the crossing with a ghost.
///
/// # Errors
/// The reason why there is none.
pub fn find<L: Level>(
    evidence: &Evidence<'_, L>,
    ridge: bool,
    choice: StripeChoice,
    meter: &mut StripeMeter,
) -> Result<Detection, NotFound> {
    let (lens, least) = (evidence.frame.lens, evidence.least_arm);
    let judged = || {
        pairs(evidence.segments, lens).map(move |(weight, pair)| {
            (weight, pair.and_then(|pair| pair.on_side(ridge, lens)).and_then(|pair| pair.long(least)))
        })
    };
    let segments = evidence.segments;
    let doubt =
        |pair: &ArmPair| toe(segments, pair, least, lens).or_else(|| at_corner(segments, pair, lens).err());
    choose(evidence, judged, doubt, choice, meter)
}

/// Measures the corner that is meant among pairs that were judged, unless there is a doubt about it.
///
/// # Errors
/// The reason why there is none.
pub fn choose<L: Level, I: Iterator<Item = (f64, Result<ArmPair, NotFound>)> + Clone>(
    evidence: &Evidence<'_, L>,
    judged: impl Fn() -> I,
    doubt: impl Fn(&ArmPair) -> Option<NotFound>,
    choice: StripeChoice,
    meter: &mut StripeMeter,
) -> Result<Detection, NotFound> {
    let lens = evidence.frame.lens;
    let corners = || judged().filter_map(|(_, pair)| pair.ok());
    let best = corners().max_by(|a, b| a.score().total_cmp(&b.score()));
    let best = best.ok_or_else(|| heaviest_reason(judged(), evidence.no_joint()))?;
    if best.score() <= 0.0 {
        return Err(NotFound::GoesOn);
    }
    let apart = |pair: &ArmPair| (pair.corner() - best.corner()).norm();
    if choice != StripeChoice::Strongest {
        let distinct = CornerList::distinct(corners());
        let meant = choice.among(distinct.iter(), |pair| pair.score(), |pair| pair.corner(), lens);
        let meant = meant.unwrap_or(&best);
        return doubt(meant).map_or_else(|| measure(meter, meant, evidence.frame), Err);
    }
    let rival = corners().find(|pair| apart(pair) > SAME_PX && pair.score() > RIVAL * best.score());
    if let Some(rival) = rival {
        return Err(NotFound::Ambiguous { distance_px: apart(&rival) });
    }
    if let Some(reason) = doubt(&best) {
        return Err(reason);
    }
    measure(meter, &best, evidence.frame)
}
