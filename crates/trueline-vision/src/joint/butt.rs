//! The gap of a butt joint: the middle between the ends of the stripe on two plates in one plane.

use crate::detection::{Detection, plates_in_order};
use crate::evidence::Evidence;
use crate::joint::arm_pair::{is_long, needed_px};
use crate::joint::plate_end::{Plate, PlateEndFinder};
use crate::line::Line2;
use crate::locate::line_segment::LineSegment;
use crate::not_found::NotFound;
use crate::picture::Level;
use crate::seam::{Seam, judged};
use crate::stripe_choice::StripeChoice;
use nalgebra::{Matrix2, Vector2};

/// The plates are in line to within this, rad in the picture.
const IN_LINE: f64 = 0.05;
/// And to within this beside each other at the gap, px.
const BESIDE_PX: f64 = 12.0;
/// A section with less than this part of the usual light is dark.
const DARK: f64 = 0.12;
/// Search range of an end, px.
const SEARCH_PX: f64 = 30.0;
/// Narrowest gap, px: speckle makes the stripe dark for less.
const NARROWEST_PX: f64 = 5.0;
/// Widest gap, px.
const WIDEST_PX: f64 = 300.0;
/// A second gap with this part of the widest one's width makes it doubtful, as soot and scratches make gaps too. This holds
/// only if its plates have this part of the light.
const RIVAL: f64 = 0.25;
const RIVAL_LIGHT: f64 = 0.25;

/// A gap between two plates.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Gap {
    plates: [Plate; 2],
    width_px: f64,
    /// Light of the stripe on both, levels × px.
    light: f64,
}

impl Gap {
    fn middle(&self) -> Vector2<f64> {
        0.5 * (self.plates[0].line.point + self.plates[1].line.point)
    }

    fn distance_px(&self, other: &Self) -> f64 {
        (self.plates[0].line.point - other.plates[0].line.point).norm()
    }
}

/// Finds gaps; memory is kept from one to the next.
#[derive(Clone, Debug, Default)]
pub(crate) struct ButtFinder {
    ends: PlateEndFinder,
    gaps: Vec<Gap>,
}

impl ButtFinder {
    /// Finds the middle of the gap.
    ///
    /// # Errors
    /// The reason why there is none.
    pub(crate) fn find<L: Level>(
        &mut self,
        evidence: &Evidence<'_, L>,
        choice: StripeChoice,
    ) -> Result<Detection, NotFound> {
        let segments = evidence.segments;
        self.gaps.clear();
        for (number, first) in segments.iter().enumerate() {
            self.holes(first, evidence);
            self.gaps.extend(segments[number + 1..].iter().filter_map(|second| between(first, second)));
        }
        self.gaps.sort_unstable_by(|a, b| b.width_px.total_cmp(&a.width_px));
        let frame = evidence.frame;
        let best = choice.among(self.gaps.iter(), |gap| gap.width_px, |gap| gap.middle(), frame.lens);
        let best = *best.ok_or(evidence.no_joint())?;
        let is_rival = |other: &&Gap| {
            **other != best
                && other.width_px > RIVAL * best.width_px
                && other.light > RIVAL_LIGHT * best.light
        };
        let rival = self.gaps.iter().find(is_rival);
        if let (Some(rival), StripeChoice::Strongest) = (rival, choice) {
            return Err(NotFound::Ambiguous { distance_px: rival.distance_px(&best) });
        }
        // The search for one end must not reach the other plate.
        let search_px = SEARCH_PX.min(0.35 * best.width_px).max(3.0);
        let mut end_of = |plate: &Plate| {
            let (edge, around) = self.ends.find(plate, Some(search_px), frame)?;
            Ok((self.ends.edge_point(&around, &edge, frame), around.fit))
        };
        let [a, b] = &best.plates;
        let ((on_a, fit_a), (on_b, fit_b)) = (end_of(a)?, end_of(b)?);
        let (seam, ideal) = middle(evidence, &[on_a, on_b], fit_a.present.min(fit_b.present))?;
        Ok(Detection { plates: plates_in_order([&fit_a, &fit_b], &ideal, frame.lens), ..seam.into() })
    }

    /// Adds the stretches of a segment without light to the gaps.
    fn holes<L: Level>(&mut self, segment: &LineSegment, evidence: &Evidence<'_, L>) {
        let span = segment.span();
        if span[1] - span[0] < 2.0 * needed_px(segment.sigma_px) {
            return;
        }
        let frame = evidence.frame;
        let Some((line, template)) = self.ends.meter.learn(&segment.line, span, segment.sigma_px, frame)
        else {
            return;
        };
        let start = line.station(&segment.line.point);
        let [first, last] = span.map(|s| s + start);
        self.ends.meter.section(&line, [first, last], &template, frame);
        let plate = |at: f64, along, length_px| Plate {
            line: Line2 { point: line.at(at), along },
            length_px,
            sigma_px: segment.sigma_px,
        };
        for [from, to] in self.ends.meter.dark_stretches(DARK) {
            let width_px = to - from;
            if (NARROWEST_PX..WIDEST_PX).contains(&width_px)
                && [from - first, last - to].iter().all(|px| is_long(*px, segment.sigma_px))
            {
                let plates = [plate(*from, line.along, from - first), plate(*to, -line.along, last - to)];
                let light = segment.brightness * segment.length_px();
                self.gaps.push(Gap { plates, width_px, light });
            }
        }
    }
}

/// The middle in the sheet, where lengths are true, and its ideal pixel.
fn middle<L: Level>(
    evidence: &Evidence<'_, L>,
    [(a, a_covariance), (b, b_covariance)]: &[(Vector2<f64>, Matrix2<f64>); 2],
    quality: f64,
) -> Result<(Seam, Vector2<f64>), NotFound> {
    let lens = evidence.frame.lens;
    let ((on_a, _), (on_b, _)) = lens.on_sheet(a).zip(lens.on_sheet(b)).ok_or(NotFound::OutOfView)?;
    let (ideal, _) = lens.from_sheet(&(0.5 * (on_a + on_b))).ok_or(NotFound::OutOfView)?;
    let covariance = 0.25 * (a_covariance + b_covariance);
    judged(&covariance)?;
    let seam = Seam::from_ideal(lens, &ideal, &covariance, quality)?;
    Ok((Seam { gap_m: (on_a - on_b).norm(), ..seam }, ideal))
}

/// The gap between two segments nearly in line.
fn between(first: &LineSegment, second: &LineSegment) -> Option<Gap> {
    if first.line.along.perp(&second.line.along).abs() > IN_LINE {
        return None;
    }
    let covered = |segment: &LineSegment| segment.covered_px(segment.span()[0], segment.span()[1]);
    if !is_long(covered(first), first.sigma_px) || !is_long(covered(second), second.sigma_px) {
        return None;
    }
    let plates = [towards(first, second), towards(second, first)];
    let [a, b] = plates.map(|plate| plate.line);
    let width_px = a.station(&b.point);
    let light = [first, second].iter().map(|segment| segment.brightness * segment.length_px()).sum();
    let facing = a.distance(&b.point).abs() < BESIDE_PX && a.along.dot(&b.along) < 0.0;
    (facing && (NARROWEST_PX..WIDEST_PX).contains(&width_px)).then_some(Gap { plates, width_px, light })
}

/// The plate of a segment, with the line turned towards another segment.
fn towards(segment: &LineSegment, other: &LineSegment) -> Plate {
    let middle = |segment: &LineSegment| segment.line.at(0.5 * (segment.span()[0] + segment.span()[1]));
    let forward = segment.line.along.dot(&(middle(other) - middle(segment))) > 0.0;
    let [first, last] = segment.span();
    let (s, along) = if forward { (last, segment.line.along) } else { (first, -segment.line.along) };
    let line = Line2 { point: segment.line.at(s), along };
    Plate { line, length_px: last - first, sigma_px: segment.sigma_px }
}
