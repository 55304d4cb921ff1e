//! A corner in daylight: in a colour picture the long arm has the laser's colour, and a short one begins at its end.
//!
//! On a surface that is lit itself a stripe hardly stands out, and in a whole picture much else has ridges. Only the laser
//! has its colour: it selects the long ridge that is the stripe, so no region must be stated. If the long arm stands out by
//! its levels, colours add nothing.

use crate::detection::Detection;
use crate::evidence::Evidence;
use crate::frame::Frame;
use crate::joint::arm_pair::{LeastArm, is_long};
use crate::joint::fillet;
use crate::joint::plain_corner::is_plain;
use crate::locate::edgel::Edgel;
use crate::locate::line_segment::{LineSegment, SegmentFinder};
use crate::locate::ridge_edgel::RidgeFinder;
use crate::locate::short_arm::{ShortArmSearch, short_arm};
use crate::measure::stripe_meter::StripeMeter;
use crate::picture::{Level, Picture};
use crate::region::PictureRegion;
use crate::stripe_choice::StripeChoice;
use nalgebra::Vector2;

/// Long arms with a search for a short one at their ends.
const MOST_LONG: usize = 4;
/// How far from the end of a long arm it is looked, px.
const LOOK_PX: f64 = 96.0;
/// A ridge lies on an arm that has the laser's colour if both its ends are this near to its line, px: colours are coarser than levels.
const NEAR_PX: f64 = 6.0;
/// Corners nearer to each other than this are the same, px.
const SAME_PX: f64 = 10.0;

/// Part of an arm's edgels that have edgels of levels beside them, if it stands out by these.
const SEEN: f64 = 1.0 / 3.0;

/// Inputs from a picture: its levels, and the excess of the laser's colour over the others in the same place.
pub(crate) struct ColouredFrame<'a, L, C> {
    pub(crate) frame: Frame<'a, L>,
    pub(crate) colour: &'a Picture<'a, C>,
    /// The straight segments that stand out by their levels, and those by their colour.
    pub(crate) bright: &'a [LineSegment],
    pub(crate) coloured: &'a [LineSegment],
}

/// Finds such corners; keeps its memory from one picture to the next.
#[derive(Clone, Debug, Default)]
pub(crate) struct ColouredCornerFinder {
    ridges: RidgeFinder,
    edgels: Vec<Edgel>,
    finder: SegmentFinder,
    segments: Vec<LineSegment>,
}

impl ColouredCornerFinder {
    /// The one corner at the ends of segments that have the laser's colour: its arms come towards the camera, or, on a
    /// `ridge`, go away from it. `None` if there is none, or several.
    pub(crate) fn find<L: Level, C: Level>(
        &mut self,
        picture: &ColouredFrame<'_, L, C>,
        ridge: bool,
        meter: &mut StripeMeter,
    ) -> Option<(Detection, Vec<LineSegment>)> {
        let long = |arm: &LineSegment, at_last| is_long(arm.continuous_from_end_px(at_last), arm.sigma_px);
        let arms =
            || picture.coloured.iter().filter(|arm| long(arm, false) || long(arm, true)).take(MOST_LONG);
        // An arm that stands out by its levels has been judged by them.
        if arms().any(|arm| is_seen(arm, picture.bright)) {
            return None;
        }
        let mut only: Option<(Detection, Vec<LineSegment>)> = None;
        for (arm, at_last) in arms().flat_map(|arm| [(arm, false), (arm, true)]) {
            let found =
                if long(arm, at_last) { self.at_end(picture, (arm, at_last), ridge, meter) } else { None };
            let Some(found) = found else { continue };
            let apart = |other: &Detection| (other.seam.pixel - found.seam.pixel).norm() > SAME_PX;
            if only.as_ref().is_some_and(|(other, _)| apart(other)) {
                return None;
            }
            only = Some((found, self.segments.clone()));
        }
        only
    }

    /// The corner at an end of a segment that has the laser's colour.
    fn at_end<L: Level, C: Level>(
        &mut self,
        picture: &ColouredFrame<'_, L, C>,
        (arm, at_last): (&LineSegment, bool),
        ridge: bool,
        meter: &mut StripeMeter,
    ) -> Option<Detection> {
        let frame = picture.frame;
        let end = arm.line.at(arm.span()[usize::from(at_last)]);
        let around = frame.lens.distorted(&end).0;
        let range = |middle: f64| [middle - LOOK_PX, middle + LOOK_PX];
        let region = PictureRegion::rectangle(range(around.x), range(around.y))?;
        self.ridges.find(frame.picture, &region, &mut self.edgels);
        self.finder.find(&self.edgels, frame.lens, &mut self.segments);
        let search = ShortArmSearch { frame, region: &region, usual: self.ridges.more_than_usual() };
        let is_on = |segment: &&LineSegment| {
            segment.span().iter().all(|s| arm.line.distance(&segment.line.at(*s)).abs() < NEAR_PX)
        };
        let long = self.segments.iter().find(is_on)?.clone();
        let [first, last] = long.span().map(|s| (long.line.at(s) - end).norm());
        let short = short_arm(&search, &long, last < first)?;
        self.segments.clear();
        self.segments.extend([long, short]);
        let evidence = Evidence { frame, segments: &self.segments, least_arm: LeastArm::SHORT };
        let found = fillet::find(&evidence, ridge, StripeChoice::Strongest, meter).ok()?;
        self.ridges.find(picture.colour, &region, &mut self.edgels);
        let usual = self.ridges.more_than_usual();
        let in_colour = ShortArmSearch {
            frame: Frame { picture: picture.colour, lens: frame.lens },
            region: &region,
            usual,
        };
        let has_colour = |to_px| in_colour.shows(found.seam.pixel, to_px);
        let arms_px = found.plates.iter().flatten().map(|plate| plate.points_px[1]);
        (is_plain(&search, &found) && arms_px.into_iter().all(has_colour)).then_some(found)
    }
}

/// Whether an arm that has the laser's colour stands out by its levels as well.
fn is_seen(arm: &LineSegment, bright: &[LineSegment]) -> bool {
    let [first, last] = arm.span();
    let places = bright.iter().flat_map(|segment| segment.marks.iter().map(|mark| segment.line.at(mark.s)));
    let is_on = |place: &Vector2<f64>| {
        arm.line.distance(place).abs() < NEAR_PX && (first..=last).contains(&arm.line.station(place))
    };
    places.filter(is_on).count() as f64 >= SEEN * arm.marks.len() as f64
}
