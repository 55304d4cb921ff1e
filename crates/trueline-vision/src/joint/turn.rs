//! Place at which a stripe turns: a point where two plates meet. On a round object it turns everywhere; two straight lines
//! fit two stretches of it and cross beside it.

use crate::joint::arm_pair::{ArmPair, LEAST_FACE_PX, covers_way};
use crate::lens::Lens;
use crate::locate::line_segment::LineSegment;
use crate::locate::tiles::TILE;
use crate::not_found::NotFound;
use nalgebra::{Matrix3, Vector2, Vector3};

/// Part of the stripe's whole turn that lies at a corner, at least. For an arc that is cut into two arms none does: their
/// chords differ by as much as each arm turns itself.
const AT_CORNER: f64 = 0.5;
/// Least bow of an arm in standard deviations, and best uncertainty of an edgel's place, px.
const BOWED: f64 = 3.0;
const EDGEL_PX: f64 = 0.3;
/// The stripe continues with a piece that begins this near to the end of the last one, px.
const GOES_ON_PX: f64 = 40.0;
/// By how much the arms are longer than a bead between them: one facet of something round is about as long as the next.
const LONGER_THAN_BEAD: f64 = 2.0;

/// Whether the stripe turns at the corner of a pair, and not all along.
///
/// # Errors
/// [`NotFound::TurnsAllAlong`], or [`NotFound::ArmsTooShort`] beside a bead as long as they are.
pub(crate) fn at_corner(segments: &[LineSegment], pair: &ArmPair, lens: &Lens) -> Result<(), NotFound> {
    longer_than_bead(segments, pair)?;
    let [first, second] = pair.in_sheet(lens).ok_or(NotFound::OutOfView)?;
    let corner_rad = turn_rad(&-first, &second);
    // Outward along the first arm is backward along the stripe.
    let senses = [-corner_rad.signum(), corner_rad.signum()];
    let headings = [first, second];
    let (mut at_corner_rad, mut whole_rad) = (corner_rad.abs(), corner_rad.abs());
    for k in 0..2 {
        let bow_rad = bow_rad(&segments[pair.segments[k]], pair, k, lens).map_or(0.0, |rad| senses[k] * rad);
        let half_rad = 0.5 * bow_rad.max(0.0);
        at_corner_rad -= half_rad;
        whole_rad += half_rad.max(beyond_rad(segments, pair, k, (headings[k], senses[k]), lens));
    }
    if at_corner_rad >= AT_CORNER * whole_rad {
        return Ok(());
    }
    let [corner_deg, whole_deg] = [at_corner_rad.max(0.0), whole_rad].map(f64::to_degrees);
    Err(NotFound::TurnsAllAlong { corner_deg, whole_deg })
}

/// By how much a direction turns into another, rad.
fn turn_rad(from: &Vector2<f64>, to: &Vector2<f64>) -> f64 {
    from.perp(to).atan2(from.dot(to))
}

fn longer_than_bead(segments: &[LineSegment], pair: &ArmPair) -> Result<(), NotFound> {
    let begins = [0, 1].map(|k| pair.arms[k].at(pair.gaps_px[k]));
    // Ends are known to half a tile each.
    let half_px = 0.5 * TILE as f64;
    let ends = |other: &LineSegment| {
        let [first, last] = other.span();
        [first - half_px, last + half_px].map(|s| other.line.at(s))
    };
    let others = others(segments, pair).map(|(_, other)| ends(other));
    let needed_px = LONGER_THAN_BEAD * (begins[1] - begins[0]).norm();
    let arms_px = [0, 1].map(|k| pair.lengths[k] - pair.gaps_px[k]);
    if arms_px.iter().any(|px| *px < needed_px) && covers_way(begins, others) {
        return Err(NotFound::ArmsTooShort { arms_px, needed_px });
    }
    Ok(())
}

/// The segments outside a pair, with their numbers.
fn others<'a>(
    segments: &'a [LineSegment],
    pair: &'a ArmPair,
) -> impl Iterator<Item = (usize, &'a LineSegment)> + Clone {
    segments.iter().enumerate().filter(|(number, _)| !pair.segments.contains(number))
}

/// By how much an arm turns in the sheet from where the other arm's light ends to its own end, outward, rad: that of the
/// parabola through its edgels. `None` if they show none.
fn bow_rad(segment: &LineSegment, pair: &ArmPair, k: usize, lens: &Lens) -> Option<f64> {
    let arm = &pair.arms[k];
    let forward = segment.line.along.dot(&arm.along).signum();
    let corner = segment.line.station(&arm.point);
    let own = segment.marks.iter().map(|mark| [forward * (mark.s - corner), forward * mark.beside_px]);
    let own = own.filter(|[x, _]| *x > TILE as f64);
    let count = own.clone().count() as f64;
    let [begin, end] = own.clone().fold([f64::INFINITY, 0.0], |[a, b], [x, _]| [a.min(x), x.max(b)]);
    let (middle, half) = (0.5 * (begin + end), 0.5 * (end - begin));
    let powers = |x: f64| {
        let x = (x - middle) / half;
        Vector3::new(1.0, x, x * x)
    };
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for [x, beside] in own.clone() {
        normal += powers(x) * powers(x).transpose();
        right += powers(x) * beside;
    }
    let inverse = normal.try_inverse().filter(|_| count > 3.0)?;
    let parabola = inverse * right;
    let squares: f64 = own.map(|[x, beside]| (beside - powers(x).dot(&parabola)).powi(2)).sum();
    let variance = (squares / (count - 3.0)).max(EDGEL_PX * EDGEL_PX);
    if parabola.z * parabola.z < BOWED * BOWED * variance * inverse.m33 {
        return None;
    }
    let point = |x: f64| {
        let ideal = arm.at(x) + arm.normal() * powers(x).dot(&parabola);
        lens.on_sheet(&ideal).map(|(point, _)| point)
    };
    let [from, halfway, to] = [point(begin)?, point(middle)?, point(end)?];
    // The chords of both halves differ by half of a parabola's turn.
    Some(2.0 * turn_rad(&(halfway - from), &(to - halfway)))
}

/// By how much the stripe turns on in the corner's sense beyond the end of an arm, rad in the sheet, piece by piece.
fn beyond_rad(
    segments: &[LineSegment],
    pair: &ArmPair,
    k: usize,
    (heading, sense): (Vector2<f64>, f64),
    lens: &Lens,
) -> f64 {
    let mut end = pair.arms[k].at(pair.lengths[k]);
    let (mut along, mut heading) = (pair.arms[k].along, heading);
    let (mut sum_rad, mut used) = (0.0, 0_u32);
    loop {
        let free = others(segments, pair).filter(|(number, _)| used & (1 << number) == 0);
        let next = free.filter_map(|(number, piece)| Some((number, onward(piece, end, along)?)));
        let near = |[near, _]: &[Vector2<f64>; 2]| (near - end).norm();
        let Some((number, [from, to])) = next.min_by(|a, b| near(&a.1).total_cmp(&near(&b.1))) else {
            return sum_rad;
        };
        let Some(((a, _), (b, _))) = lens.on_sheet(&from).zip(lens.on_sheet(&to)) else { return sum_rad };
        let turned_rad = sense * turn_rad(&heading, &(b - a));
        if turned_rad <= 0.0 {
            return sum_rad;
        }
        sum_rad += turned_rad;
        (end, along, heading) = (to, (to - from).normalize(), b - a);
        used |= 1 << number;
    }
}

/// The ends of a piece that continues the stripe from its end, the nearer one first.
fn onward(piece: &LineSegment, end: Vector2<f64>, along: Vector2<f64>) -> Option<[Vector2<f64>; 2]> {
    let [first, last] = piece.span().map(|s| piece.line.at(s));
    let at_last = (last - end).norm() < (first - end).norm();
    let [from, to] = if at_last { [last, first] } else { [first, last] };
    let goes_on = (from - end).norm() < GOES_ON_PX && (to - from).dot(&along) > 0.0;
    (goes_on && piece.continuous_from_end_px(at_last) > LEAST_FACE_PX).then_some([from, to])
}
