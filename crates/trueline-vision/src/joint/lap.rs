//! The edge of a lap joint: where the stripe on the upper plate ends.

use crate::detection::{Detection, plates_in_order};
use crate::evidence::Evidence;
use crate::frame::Frame;
use crate::joint::arm_pair::{are_alike, is_long, shows_plate};
use crate::joint::end_face::{Face, FaceFinder};
use crate::joint::plate_end::{Plate, PlateEndFinder};
use crate::lens::Lens;
use crate::line::Line2;
use crate::locate::line_segment::LineSegment;
use crate::measure::stripe_end::{BANDS, Edge};
use crate::measure::stripe_meter::Fit;
use crate::not_found::NotFound;
use crate::picture::Level;
use crate::seam::{Seam, judged};
use crate::stripe_choice::StripeChoice;
use nalgebra::Vector2;

/// Plates are parallel to within this, rad in the sheet.
const PARALLEL: f64 = 0.15;
/// The lower stripe begins within this of the upper one's end, px along it.
const APART_PX: f64 = 400.0;
/// The lower stripe lies at least this many thicknesses of the upper one beside it.
const STEP_SIGMAS: f64 = 4.0;

/// Number of thicknesses of the lower stripe left out at its beginning, and largest measured length of it, px.
const BESIDE_SIGMAS: f64 = 6.0;
const MOST_PX: f64 = 1200.0;
/// Least part of its sections that must show it.
const LEAST_PRESENT: f64 = 0.3;

/// The two plates of a lap.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Plates {
    upper: usize,
    lower: usize,
    /// The upper plate's line, towards its edge; the point is the last edgel.
    line: Line2,
    length: f64,
    weight: f64,
    /// Start of the lower plate's stripe.
    lower_start: Vector2<f64>,
    /// Bands on the side away from the lower plate: on the other side the light may run on down the upper
    /// plate's end face.
    bands: [bool; BANDS],
}

/// Finds edges; memory is kept from one to the next.
#[derive(Clone, Debug, Default)]
pub(crate) struct LapFinder {
    ends: PlateEndFinder,
    faces: FaceFinder,
}

impl LapFinder {
    /// Finds the edge.
    ///
    /// # Errors
    /// The reason why there is none.
    pub(crate) fn find<L: Level>(
        &mut self,
        evidence: &Evidence<'_, L>,
        choice: StripeChoice,
    ) -> Result<Detection, NotFound> {
        let (segments, frame) = (evidence.segments, evidence.frame);
        let numbers =
            (0..segments.len()).flat_map(|upper| (0..segments.len()).map(move |lower| [upper, lower]));
        let laps = numbers
            .filter(|[upper, lower]| upper != lower)
            .filter_map(|numbers| plates(segments, numbers, frame.lens));
        let best = choice.among(laps, |plates| plates.weight, |plates| plates.line.point, frame.lens);
        let best = best.ok_or(evidence.no_joint())?;
        let plate =
            Plate { line: best.line, length_px: best.length, sigma_px: segments[best.upper].sigma_px };
        let around = self.ends.look(&plate, None, frame)?;
        let (near, fit) = (self.ends.near_end(&around, best.bands)?, around.fit);
        let face = Face::between(&fit, plate.sigma_px, near.s, &best.lower_start, frame);
        let lit = face.as_ref().is_none_or(|face| face.is_lit(fit.amplitude, plate.sigma_px));
        let edge = if lit {
            let begins = face.and_then(|face| self.faces.edge(&face, plate.sigma_px));
            with_lit_face(&self.ends.end(&around, best.bands)?, begins, plate.sigma_px)
        } else {
            self.ends.whole_end(&around, frame)?
        };
        let (ideal, covariance) = self.ends.edge_point(&around, &edge, frame);
        judged(&covariance)?;
        let covariance = covariance + around.out_of_focus(&edge);
        let seam = Seam::from_ideal(frame.lens, &ideal, &covariance, fit.present)?;
        let lower = self.lower_stripe(&best, &segments[best.lower], frame);
        // One plate of two has no number of its own.
        let plates = lower.map_or([None; 2], |lower| plates_in_order([&fit, &lower], &ideal, frame.lens));
        Ok(Detection { plates, ..seam.into() })
    }

    /// The stripe on the lower plate, without the part next to its beginning: there it fades, or the upper plate's light is
    /// beside it.
    fn lower_stripe<L: Level>(
        &mut self,
        plates: &Plates,
        segment: &LineSegment,
        frame: Frame<'_, L>,
    ) -> Option<Fit> {
        let line =
            Line2 { point: plates.lower_start, along: toward(&segment.line.along, &plates.line.along) };
        let [first, last] = segment.span();
        let span = [BESIDE_SIGMAS * segment.sigma_px, (last - first).min(MOST_PX)];
        let meter = &mut self.ends.meter;
        let (fit, _) = meter.fit(&line, span, segment.sigma_px, frame)?;
        let fit = meter.without_bent_start(fit);
        (fit.present >= LEAST_PRESENT).then_some(fit)
    }
}

/// The edge from the light on the upper plate's end face, if there is some: the stripe's own end, from the other
/// side, and the place where the face meets the stripe.
fn with_lit_face(end: &Edge, face: Option<Edge>, sigma_px: f64) -> Edge {
    // The face's flank reaches around the corner by about half of the stripe's thickness.
    let blurred = Edge { sigma_px: end.sigma_px.hypot(0.6 * sigma_px), ..*end };
    let Some(face) = face.filter(|face| (face.s - end.s).abs() < 4.0 * face.sigma_px.hypot(blurred.sigma_px))
    else {
        return blurred;
    };
    let [a, b] = [blurred, face].map(|edge| edge.sigma_px.powi(-2));
    Edge { s: (a * blurred.s + b * face.s) / (a + b), sigma_px: (a + b).sqrt().recip(), ..*end }
}

fn plates(segments: &[LineSegment], [upper, lower]: [usize; 2], lens: &Lens) -> Option<Plates> {
    let [a, b] = [upper, lower].map(|number| &segments[number]);
    let ends = |segment: &LineSegment| segment.span().map(|s| segment.line.at(s));
    let ([a0, a1], [b0, b1]) = (ends(a), ends(b));
    // Towards the other plate.
    let forward = a.line.along.dot(&(0.5 * (b0 + b1) - 0.5 * (a0 + a1))) > 0.0;
    let (along, edge) = if forward { (a.line.along, a1) } else { (-a.line.along, a0) };
    let line = Line2 { point: edge, along };
    let b_forward = line.along.dot(&b.line.along) > 0.0;
    let continuous_px = [a.continuous_from_end_px(forward), b.continuous_from_end_px(!b_forward)];
    if !is_long(continuous_px[0], a.sigma_px)
        || !shows_plate(continuous_px[1], b.sigma_px)
        || !are_alike(a, b)
    {
        return None;
    }
    let (start, end) = (line.station(&b0).min(line.station(&b1)), line.station(&b0).max(line.station(&b1)));
    // The lower stripe lies ahead. A stripe beside is a ghost.
    let ahead = end > 0.3 * a.span()[1].min(60.0) && start.abs() < APART_PX && start > -0.3 * (end - start);
    let step = line.distance(&line_point_at(b, &line, start.max(0.0)));
    let beside = step.abs() > STEP_SIGMAS * a.sigma_px;
    let sheet = |ideal: &Vector2<f64>| lens.on_sheet(ideal).map(|(point, _)| point);
    let (sa0, sa1) = (sheet(&a0)?, sheet(&a1)?);
    let (sb0, sb1) = (sheet(&b0)?, sheet(&b1)?);
    let (da, db) = ((sa1 - sa0).normalize(), (sb1 - sb0).normalize());
    let parallel = da.perp(&db).abs() < PARALLEL;
    // The upper plate is the nearer one: its line passes the lower segment on the camera's side.
    let across = Vector2::new(-da.y, da.x);
    let away = across * across.dot(&lens.away()).signum();
    let above = away.dot(&(0.5 * (sb0 + sb1) - sa0)) > 0.0;
    let length = (a1 - a0).norm();
    (ahead && beside && parallel && above).then(|| Plates {
        upper,
        lower,
        line,
        length,
        weight: a.weight() + b.weight(),
        lower_start: if line.station(&b0) < line.station(&b1) { b0 } else { b1 },
        bands: std::array::from_fn(|band| if step > 0.0 { band * 2 < BANDS } else { band * 2 >= BANDS }),
    })
}

/// A direction turned to the side of another.
fn toward(along: &Vector2<f64>, other: &Vector2<f64>) -> Vector2<f64> {
    if along.dot(other) < 0.0 { -along } else { *along }
}

/// The point of a segment's line at a station of another line.
fn line_point_at(segment: &LineSegment, other: &Line2, station: f64) -> Vector2<f64> {
    let slope = segment.line.along.dot(&other.along);
    let start = other.station(&segment.line.point);
    segment.line.at((station - start) / slope)
}
