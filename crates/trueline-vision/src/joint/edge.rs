//! The edge of a plate over nothing that the laser reaches: where the stripe ends.

use crate::detection::{Detection, StripeSupport};
use crate::evidence::Evidence;
use crate::joint::arm_pair::{is_long, needed_px};
use crate::joint::plate_end::{Plate, PlateEndFinder};
use crate::line::Line2;
use crate::locate::line_segment::LineSegment;
use crate::not_found::NotFound;
use crate::picture::Level;
use crate::seam::{Seam, judged};
use crate::stripe_choice::StripeChoice;
use nalgebra::Vector2;

/// An end so near to the picture's border is not the plate's, px.
const BORDER_PX: f64 = 60.0;
/// A second segment with this part of the longest one's weight may be the plate as well.
const RIVAL: f64 = 0.5;

/// Finds the end of the heaviest segment that ends within the picture, or the chosen one of all such ends.
///
/// # Errors
/// The reason why there is none.
pub fn find<L: Level>(
    evidence: &Evidence<'_, L>,
    choice: StripeChoice,
    ends: &mut PlateEndFinder,
) -> Result<Detection, NotFound> {
    let frame = evidence.frame;
    let plate = match choice {
        StripeChoice::Strongest => only_plate(evidence)?,
        _ => {
            let plates = evidence.segments.iter().filter(|segment| check_length(segment).is_ok());
            let plates = plates.flat_map(|segment| {
                inner_ends(evidence, segment).map(move |at_first| (segment, plate(segment, at_first)))
            });
            let weight = |(segment, _): &(&LineSegment, Plate)| segment.weight();
            let meant = choice.among(plates, weight, |(_, plate)| plate.line.point, frame.lens);
            meant.map(|(_, plate)| plate).ok_or_else(|| no_plate(evidence))?
        }
    };
    let (edge, around) = ends.find(&plate, None, frame)?;
    let (ideal, covariance) = ends.edge_point(&around, &edge, frame);
    judged(&covariance)?;
    let covariance = covariance + around.out_of_focus(&edge);
    let seam = Seam::from_ideal(frame.lens, &ideal, &covariance, around.fit.present)?;
    let plate = StripeSupport::of(&around.fit, &ideal, frame.lens);
    Ok(Detection { plates: [plate, None], ..seam.into() })
}

/// The plate of a picture in which a single end stands out.
fn only_plate<L: Level>(evidence: &Evidence<'_, L>) -> Result<Plate, NotFound> {
    let best = &evidence.segments[0];
    check_length(best)?;
    if let Some(rival) = evidence.segments[1..].iter().find(|rival| rival.weight() > RIVAL * best.weight()) {
        return Err(NotFound::Ambiguous { distance_px: best.line.distance(&rival.line.point).abs() });
    }
    let mut ends = inner_ends(evidence, best);
    match (ends.next(), ends.next()) {
        (None, _) => Err(NotFound::OutOfView),
        (Some(_), Some(_)) => Err(NotFound::Ambiguous { distance_px: best.length_px() }),
        (Some(at_first), None) => Ok(plate(best, at_first)),
    }
}

/// Why no segment has an end that could be measured.
fn no_plate<L: Level>(evidence: &Evidence<'_, L>) -> NotFound {
    check_length(&evidence.segments[0]).err().unwrap_or(NotFound::OutOfView)
}

fn check_length(segment: &LineSegment) -> Result<(), NotFound> {
    let continuous_px = segment.continuous_from_end_px(false).max(segment.continuous_from_end_px(true));
    if is_long(continuous_px, segment.sigma_px) {
        return Ok(());
    }
    let needed_px = needed_px(segment.sigma_px);
    Err(NotFound::ArmsTooShort { arms_px: [continuous_px; 2], needed_px })
}

/// The ends of a segment that are well within the picture: whether each is the first.
fn inner_ends<L: Level>(
    evidence: &Evidence<'_, L>,
    segment: &LineSegment,
) -> impl Iterator<Item = bool> + Clone + use<L> {
    let [first, last] = segment.span().map(|s| is_inside(evidence, &segment.line.at(s)));
    [(first, true), (last, false)].into_iter().filter(|(inside, _)| *inside).map(|(_, at_first)| at_first)
}

/// A segment as a plate with its edge at its first edgel, or at its last.
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
