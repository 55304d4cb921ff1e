//! The two lines of a step: the crossings of its riser with the upper and with the lower surface.

use crate::detection::Detection;
use crate::evidence::Evidence;
use crate::joint::arm_pair::{ArmPair, LEAST_FACE_PX, are_alike, is_long};
use crate::joint::corner::measure;
use crate::joint::corner_list::CornerList;
use crate::lens::Lens;
use crate::locate::line_segment::LineSegment;
use crate::measure::stripe_meter::StripeMeter;
use crate::not_found::NotFound;
use crate::picture::Level;
use crate::stripe_choice::StripeChoice;

/// The surfaces are parallel to within this, rad in the sheet.
const PARALLEL: f64 = 0.15;
/// A second step with this part of the best one's evidence makes it doubtful.
const RIVAL: f64 = 0.8;
/// Steps nearer to each other than this are the same, px.
const SAME_PX: f64 = 10.0;

/// Upper surface and riser, riser and lower surface; each with the riser's arm.
#[derive(Clone, Copy, Debug)]
struct StepCorners {
    edge: ArmPair,
    foot: ArmPair,
    risers: [usize; 2],
}

impl StepCorners {
    fn evidence(&self) -> f64 {
        self.edge.score() + self.foot.score()
    }
}

/// Finds the step.
///
/// # Errors
/// The reason why there is none.
pub fn find<L: Level>(
    evidence: &Evidence<'_, L>,
    choice: StripeChoice,
    meter: &mut StripeMeter,
) -> Result<Detection, NotFound> {
    let (segments, lens) = (evidence.segments, evidence.frame.lens);
    let ridges = CornerList::of(segments, true, lens);
    let valleys = CornerList::of(segments, false, lens);
    let steps = ridges.iter().flat_map(|edge| valleys.iter().map(move |foot| (edge, foot)));
    let steps = steps.filter_map(|(edge, foot)| step(segments, edge, foot, lens));
    let best = choice.among(steps.clone(), StepCorners::evidence, |step| step.edge.corner(), lens);
    let best = best.ok_or(evidence.no_joint())?;
    let apart = |other: &StepCorners| (other.edge.corner() - best.edge.corner()).norm();
    let is_rival = |other: &StepCorners| apart(other) > SAME_PX && other.evidence() > RIVAL * best.evidence();
    if let (StripeChoice::Strongest, Some(rival)) = (choice, steps.clone().find(is_rival)) {
        return Err(NotFound::Ambiguous { distance_px: apart(&rival) });
    }
    let edge = measure(meter, &best.edge.clear_of_far_end(best.risers[0]), evidence.frame)?;
    let foot = measure(meter, &best.foot.clear_of_far_end(best.risers[1]), evidence.frame)?;
    Ok(Detection { second: Some(foot.seam), ..edge })
}

/// The step that two corners make, if they do.
fn step(segments: &[LineSegment], edge: &ArmPair, foot: &ArmPair, lens: &Lens) -> Option<StepCorners> {
    let riser = *edge.segments.iter().find(|number| foot.segments.contains(number))?;
    let risers = [edge.arm_on(riser)?, foot.arm_on(riser)?];
    let [upper, lower] = [1 - risers[0], 1 - risers[1]];
    let surfaces = [edge.segments[upper], foot.segments[lower]];
    let riser_is_seen =
        edge.continuous_px[risers[0]] > LEAST_FACE_PX && foot.continuous_px[risers[1]] > LEAST_FACE_PX;
    let down = foot.corner() - edge.corner();
    let leads_down =
        edge.arms[risers[0]].along.dot(&down) > 0.0 && foot.arms[risers[1]].along.dot(&down) < 0.0;
    let long = is_long(edge.continuous_px[upper], edge.sigmas_px[upper])
        && is_long(foot.continuous_px[lower], foot.sigmas_px[lower]);
    let alike = surfaces[0] != surfaces[1] && are_alike(&segments[surfaces[0]], &segments[surfaces[1]]);
    if !(riser_is_seen && leads_down && long && alike) {
        return None;
    }
    // In opposite directions, and parallel.
    let (above, below) = (edge.in_sheet(lens)?[upper], foot.in_sheet(lens)?[lower]);
    let parallel = above.dot(&below) < 0.0 && above.perp(&below).abs() < PARALLEL;
    parallel.then_some(StepCorners { edge: *edge, foot: *foot, risers })
}
