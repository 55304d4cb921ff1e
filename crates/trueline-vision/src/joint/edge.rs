//! The edge of a plate over nothing that the laser reaches: where the stripe ends.

use crate::evidence::Evidence;
use crate::joint::arm_pair::{is_long, needed_px};
use crate::joint::plate_end::{Plate, PlateEndFinder, edge_point};
use crate::line::Line2;
use crate::locate::line_segment::LineSegment;
use crate::measure::stripe_end::BANDS;
use crate::not_found::NotFound;
use crate::picture::Level;
use crate::seam::{Seam, judged};
use nalgebra::Vector2;

/// Where the end is looked for around the last edgel, px.
const SEARCH_PX: f64 = 30.0;
/// An end so near to the picture's border is not the plate's, px.
const BORDER_PX: f64 = 60.0;
/// A second segment with this part of the longest one's weight may be the plate as well.
const RIVAL: f64 = 0.5;

/// Finds the end of the heaviest segment that has one within the picture.
///
/// # Errors
/// Why there is none.
pub fn find<L: Level>(evidence: &Evidence<'_, L>, ends: &mut PlateEndFinder) -> Result<Seam, NotFound> {
    let segments = evidence.segments;
    let best = &segments[0];
    let [first, last] = best.span();
    let continuous_px = best.continuous_from_end_px(false).max(best.continuous_from_end_px(true));
    if !is_long(continuous_px, best.sigma_px) {
        return Err(NotFound::ArmsTooShort {
            arms_px: [continuous_px; 2],
            needed_px: needed_px(best.sigma_px),
        });
    }
    if let Some(rival) = segments[1..].iter().find(|rival| rival.weight() > RIVAL * best.weight()) {
        return Err(NotFound::Ambiguous { distance_px: best.line.distance(&rival.line.point).abs() });
    }
    let within = [first, last].map(|s| is_inside(evidence, &best.line.at(s)));
    let plate = match within {
        [false, false] => return Err(NotFound::OutOfView),
        [true, true] => return Err(NotFound::Ambiguous { distance_px: last - first }),
        [at_first, _] => plate(best, at_first),
    };
    let frame = evidence.frame;
    let (edge, fit) = ends.find(&plate, SEARCH_PX, [true; BANDS], frame)?;
    let (ideal, covariance) = edge_point(&fit, &edge);
    judged(&covariance)?;
    Seam::from_ideal(frame.lens, &ideal, &covariance, fit.present)
}

/// A segment as a plate whose edge is at its first edgel, or at its last.
fn plate(segment: &LineSegment, at_first: bool) -> Plate {
    let [first, last] = segment.span();
    let (s, along) = if at_first { (first, -segment.line.along) } else { (last, segment.line.along) };
    let line = Line2 { point: segment.line.at(s), along };
    Plate { line, length_px: last - first, sigma_px: segment.sigma_px }
}

/// Whether an ideal pixel is well within the picture.
fn is_inside<L: Level>(evidence: &Evidence<'_, L>, ideal: &Vector2<f64>) -> bool {
    let lens = evidence.frame.lens;
    let pixel = lens.distorted(ideal).0;
    let [width, height] = lens.camera().size.map(f64::from);
    let within = |at: f64, size: f64| at > BORDER_PX && at < size - BORDER_PX;
    within(pixel.x, width) && within(pixel.y, height)
}
