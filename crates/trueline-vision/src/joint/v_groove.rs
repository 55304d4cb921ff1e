//! The bottom of a groove: where its two faces meet, each of which ends at a plate.

use crate::evidence::Evidence;
use crate::joint::corner::{Pair, measure, pairs, sigmas_px};
use crate::lens::Lens;
use crate::locate::line_segment::LineSegment;
use crate::measure::stripe_meter::StripeMeter;
use crate::picture::Level;
use crate::seam::{Lengths, NotFound, Seam};

/// Distance within which the end of a face meets a plate, px.
const MEETS_PX: f64 = 40.0;
/// A second bottom with this part of the best one's evidence makes it doubtful, if it is further away than this, px.
const RIVAL: f64 = 0.8;
const SAME_PX: f64 = 10.0;
/// Most that two faces differ in brightness and thickness, as factors.
const MOST_CONTRAST: f64 = 4.0;
const MOST_SPREAD: f64 = 2.5;
/// Least length of a face that edgels cover, px.
const LEAST_FACE_PX: f64 = 24.0;

/// Finds the bottom.
///
/// # Errors
/// Why there is none.
pub fn find<L: Level>(evidence: &Evidence<'_, L>, meter: &mut StripeMeter) -> Result<Seam, NotFound> {
    let segments = evidence.segments;
    let grooves = || {
        pairs(segments, evidence.frame.lens)
            .filter(|pair| {
                pair.covered_px.iter().all(|covered| *covered > LEAST_FACE_PX) && pair.score() > 0.0
            })
            .filter(|pair| pair.is_valley(evidence.frame.lens) && alike(segments, pair))
            .map(|pair| (flanks(segments, &pair, evidence.frame.lens), pair))
            .filter(|(flanks, _)| *flanks > 0)
    };
    // A groove with both plates comes before one with one; then the one with more light on its faces.
    let better =
        |a: &(usize, Pair), b: &(usize, Pair)| a.0.cmp(&b.0).then(a.1.score().total_cmp(&b.1.score()));
    let (flanked, best) = grooves().max_by(better).ok_or(evidence.no_joint())?;
    let elsewhere = |pair: &Pair| (pair.corner() - best.corner()).norm() > SAME_PX;
    let rival = |(flanks, pair): (usize, Pair)| {
        flanks == flanked && elsewhere(&pair) && pair.score() > RIVAL * best.score()
    };
    if grooves().any(rival) {
        return Err(NotFound::Ambiguous);
    }
    measure(meter, &best, sigmas_px(segments, &best), evidence.frame)
}

/// Whether the light on two faces is of one kind: a spark across the stripe is brighter, or thicker, than both.
fn alike(segments: &[LineSegment], pair: &Pair) -> bool {
    let [a, b] = pair.segments.map(|number| &segments[number]);
    let within = |a: f64, b: f64, factor: f64| a.max(b) <= factor * a.min(b);
    within(a.brightness, b.brightness, MOST_CONTRAST) && within(a.sigma_px, b.sigma_px, MOST_SPREAD)
}

/// How many of the faces end at a plate, 0 to 2.
#[must_use]
pub fn flanks(segments: &[LineSegment], pair: &Pair, lens: &Lens) -> usize {
    let longer_px = Lengths::of(lens).longer_px;
    (0..2)
        .filter(|face| {
            let end = pair.arms[*face].at(pair.lengths[*face]);
            let others = segments.iter().enumerate().filter(|(number, _)| !pair.segments.contains(number));
            others.into_iter().any(|(_, plate)| {
                let [first, last] = plate.span();
                let nearest = plate.line.station(&end).clamp(first, last);
                let long = plate.covered_px(first, last) > longer_px;
                long && (plate.line.at(nearest) - end).norm() < MEETS_PX
            })
        })
        .count()
}
