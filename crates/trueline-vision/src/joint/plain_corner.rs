//! A corner within a region that was stated, where the stripe does not stand out from a surface that is lit itself, or one of
//! its arms is short.
//!
//! In a whole picture there is too much else that has short ridges. In a stated region, a short arm is accepted if it begins
//! at the end of a long one, and the corner if there is nothing else of weight.

use crate::detection::Detection;
use crate::evidence::Evidence;
use crate::frame::Frame;
use crate::joint::arm_pair::{LeastArm, is_long};
use crate::joint::fillet;
use crate::lens::Lens;
use crate::locate::edgel::Edgel;
use crate::locate::line_segment::{LineSegment, SegmentFinder};
use crate::locate::ridge_edgel::RidgeFinder;
use crate::locate::short_arm::{ShortArmSearch, short_arm};
use crate::measure::stripe_meter::StripeMeter;
use crate::picture::Level;
use crate::region::PictureRegion;
use crate::stripe_choice::StripeChoice;
use nalgebra::Vector2;

/// Long arms with a search for short ones at their ends.
const MOST_LONG: usize = 3;
/// Part of the sections of both arms that must show the stripe, and the most that the corner may be uncertain by, px.
const LEAST_QUALITY: f64 = 0.9;
const MOST_SIGMA_PX: f64 = 2.5;
/// Part of the weight of all ridges that lies on lines through the corner, and how near to it these pass, px. Corners that a person
/// sees have 0.7 and more, accidental ones of chessboards and furniture 0.4 and less.
const LEAST_THROUGH_CORNER: f64 = 0.6;
const THROUGH_PX: f64 = 5.0;

/// Finds such corners; keeps its memory from one picture to the next.
#[derive(Clone, Debug, Default)]
pub(crate) struct PlainCornerFinder {
    ridges: RidgeFinder,
    edgels: Vec<Edgel>,
    finder: SegmentFinder,
    segments: Vec<LineSegment>,
}

impl PlainCornerFinder {
    /// The corner in a region: its arms come towards the camera, or, on a `ridge`, go away from it. `None` if it is not
    /// plain.
    pub(crate) fn find<L: Level>(
        &mut self,
        frame: Frame<'_, L>,
        region: &PictureRegion,
        ridge: bool,
        choice: StripeChoice,
        meter: &mut StripeMeter,
    ) -> Option<Detection> {
        self.ridges.find(frame.picture, region, &mut self.edgels);
        self.finder.find(&self.edgels, frame.lens, &mut self.segments);
        let search = ShortArmSearch { frame, region, usual: self.ridges.more_than_usual() };
        let seen = self.segments.len();
        self.plain(&search, seen, ridge, (choice, meter)).or_else(|| {
            self.add_short_arms(&search);
            self.plain(&search, seen, ridge, (choice, meter))
        })
    }

    /// The corner among the segments, if it is beyond doubt. Short arms added to the `seen` ones are no evidence.
    fn plain<L: Level>(
        &self,
        search: &ShortArmSearch<'_, L>,
        seen: usize,
        ridge: bool,
        (choice, meter): (StripeChoice, &mut StripeMeter),
    ) -> Option<Detection> {
        let evidence = Evidence { frame: search.frame, segments: &self.segments, least_arm: LeastArm::SHORT };
        let found = fillet::find(&evidence, ridge, choice, meter).ok()?;
        (is_plain(search, &found) && self.has_most(&found, search.frame.lens, seen)).then_some(found)
    }

    /// The segments of the last corner.
    pub(crate) fn segments(&self) -> &[LineSegment] {
        &self.segments
    }

    fn add_short_arms<L: Level>(&mut self, search: &ShortArmSearch<'_, L>) {
        for number in 0..self.segments.len().min(MOST_LONG) {
            for at_last in [false, true] {
                let long = &self.segments[number];
                if is_long(long.continuous_from_end_px(at_last), long.sigma_px) {
                    let short = short_arm(search, long, at_last);
                    self.segments.extend(short);
                }
            }
        }
    }

    /// Whether most of the bright segments lie on lines through a corner.
    fn has_most(&self, found: &Detection, lens: &Lens, seen: usize) -> bool {
        let pixel = found.seam.pixel;
        let ideal = Vector2::from(lens.ideal(pixel.x as f32, pixel.y as f32).map(f64::from));
        let brightest = self.edgels.iter().fold(0.0_f32, |top, edgel| top.max(edgel.brightness));
        let all: f32 = self.edgels.iter().map(|edgel| (edgel.brightness / brightest).sqrt()).sum();
        let is_through = |segment: &&LineSegment| segment.line.distance(&ideal).abs() < THROUGH_PX;
        let through = self.segments[..seen].iter().filter(is_through).map(LineSegment::weight);
        through.sum::<f64>() >= LEAST_THROUGH_CORNER * f64::from(all)
    }
}

/// Whether the arms of a corner show the stripe all along, without a break, and cross at one place.
pub(crate) fn is_plain<L: Level>(search: &ShortArmSearch<'_, L>, found: &Detection) -> bool {
    let seam = &found.seam;
    let [Some(one), Some(other)] = found.plates else { return false };
    let leads = [one, other].iter().all(|plate| search.leads(seam.pixel, plate.points_px[1]));
    let is_known = seam.covariance_px2.trace() <= MOST_SIGMA_PX * MOST_SIGMA_PX;
    leads && is_known && seam.quality >= LEAST_QUALITY
}
