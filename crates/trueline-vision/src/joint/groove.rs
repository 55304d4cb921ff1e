//! The two shoulders of a groove: where its faces meet the plates.

use crate::detection::Detection;
use crate::evidence::Evidence;
use crate::joint::arm_pair::{ArmPair, LEAST_FACE_PX, is_long};
use crate::joint::corner::measure;
use crate::joint::corner_list::CornerList;
use crate::lens::Lens;
use crate::locate::segment_parts::SegmentParts;
use crate::measure::stripe_meter::StripeMeter;
use crate::not_found::NotFound;
use crate::picture::Level;
use crate::stripe_choice::StripeChoice;
use nalgebra::Vector2;

/// The plates are parallel to within this, rad in the sheet.
const PARALLEL: f64 = 0.3;
/// Least width, px.
const NARROWEST_PX: f64 = 40.0;
/// A second groove makes the best one doubtful with this part of its evidence.
const RIVAL: f64 = 0.8;
/// Grooves nearer to each other than this are the same, px.
const SAME_PX: f64 = 10.0;

/// Two shoulders, each with the arm that is the plate.
#[derive(Clone, Copy, Debug)]
struct Shoulders {
    corners: [ArmPair; 2],
    plates: [usize; 2],
}

impl Shoulders {
    fn evidence(&self) -> f64 {
        self.corners[0].score() + self.corners[1].score()
    }

    /// Weight of the segments that another pair of shoulders lacks: common segments do not separate them.
    fn weight_without(&self, other: &Self) -> f64 {
        let arms = self.corners.iter().flat_map(|pair| pair.segments.into_iter().zip(pair.weights));
        let shared = |number: usize| other.corners.iter().any(|pair| pair.segments.contains(&number));
        arms.filter(|(number, _)| !shared(*number)).map(|(_, weight)| weight).sum()
    }

    fn middle(&self) -> Vector2<f64> {
        0.5 * (self.corners[0].corner() + self.corners[1].corner())
    }
}

/// Finds grooves; memory is kept from one to the next.
#[derive(Clone, Debug, Default)]
pub(crate) struct GrooveFinder {
    parts: SegmentParts,
    meter: StripeMeter,
}

impl GrooveFinder {
    /// Finds the shoulders.
    ///
    /// # Errors
    /// The reason why there are none.
    pub(crate) fn find<L: Level>(
        &mut self,
        evidence: &Evidence<'_, L>,
        choice: StripeChoice,
    ) -> Result<Detection, NotFound> {
        // Plates in one plane share a line.
        let evidence = Evidence { segments: self.parts.of(evidence.segments), ..*evidence };
        find(&evidence, choice, &mut self.meter)
    }
}

fn find<L: Level>(
    evidence: &Evidence<'_, L>,
    choice: StripeChoice,
    meter: &mut StripeMeter,
) -> Result<Detection, NotFound> {
    let lens = evidence.frame.lens;
    let ridges = CornerList::of(evidence.segments, true, lens);
    let pairs = ridges.iter().enumerate().flat_map(|(k, a)| ridges.iter().skip(k + 1).map(move |b| [a, b]));
    let grooves = pairs.filter_map(|[a, b]| shoulders(a, b, lens));
    let best = choice.among(grooves.clone(), Shoulders::evidence, Shoulders::middle, lens);
    let best = best.ok_or(evidence.no_joint())?;
    let apart = |other: &Shoulders| (other.middle() - best.middle()).norm();
    let as_likely = |other: &Shoulders| other.weight_without(&best) > RIVAL * best.weight_without(other);
    let is_rival = |other: &Shoulders| apart(other) > SAME_PX && as_likely(other);
    if let (StripeChoice::Strongest, Some(rival)) = (choice, grooves.clone().find(is_rival)) {
        return Err(NotFound::Ambiguous { distance_px: apart(&rival) });
    }
    let [a, b] = [0, 1].map(|k| best.corners[k].clear_of_far_end(1 - best.plates[k]));
    let sideways = |pair: &ArmPair| lens.sideways_m(&pair.corner()).ok_or(NotFound::OutOfView);
    let (left, right) = if sideways(&a)? <= sideways(&b)? { (a, b) } else { (b, a) };
    let left = measure(meter, &left, evidence.frame)?;
    let right = measure(meter, &right, evidence.frame)?;
    Ok(Detection { second: Some(right.seam), ..left.seam.into() })
}

/// The groove that two ridges are the shoulders of, if they are.
fn shoulders(a: &ArmPair, b: &ArmPair, lens: &Lens) -> Option<Shoulders> {
    if a.segments.iter().any(|number| b.segments.contains(number)) {
        return None;
    }
    let across = b.corner() - a.corner();
    if across.norm() < NARROWEST_PX {
        return None;
    }
    let plates = [plate(a, &-across)?, plate(b, &across)?];
    let directions = [a.in_sheet(lens)?[plates[0]], b.in_sheet(lens)?[plates[1]]];
    let parallel =
        directions[0].perp(&directions[1]).abs() < PARALLEL && directions[0].dot(&directions[1]) < 0.0;
    parallel.then_some(Shoulders { corners: [*a, *b], plates })
}

/// The arm of a shoulder that is the plate: it leads away from the groove, and is long. The other leads into it.
fn plate(shoulder: &ArmPair, outward: &Vector2<f64>) -> Option<usize> {
    let outward = outward.normalize();
    let [a, b] = shoulder.arms.map(|arm| arm.along.dot(&outward));
    let plate = usize::from(b > a);
    let face = 1 - plate;
    let is_plate = is_long(shoulder.continuous_px[plate], shoulder.sigmas_px[plate]) && a.max(b) > 0.5;
    (is_plate && shoulder.continuous_px[face] > LEAST_FACE_PX && a.min(b) < 0.3).then_some(plate)
}
