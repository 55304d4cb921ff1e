//! Seams of a scan against each other: a point that the pictures before and after it do not bear out.
//!
//! Pictures are processed one by one. Only afterwards, with all of them known, a point far from its neighbours' seam
//! is refused. Far is measured by how well neighbours agree everywhere: a scan that moves fast, or pictures that have
//! nothing to do with each other, are not judged by this.

use crate::detection::Detection;
use crate::measure::regression::median;
use crate::not_found::NotFound;
use nalgebra::{Matrix3, Vector2, Vector3};

/// Neighbours through which a point's place is interpolated, those on the border of the scan on one side only.
const NEIGHBOURS: usize = 10;
/// Rounds of the fit through them, and the deviation below which all of them count alike, px.
const ROUNDS: usize = 12;
const ALIKE_PX: f64 = 0.3;
/// A point is refused beyond this many typical deviations, and this many px.
const TYPICAL: f64 = 10.0;
const LEAST_PX: f64 = 10.0;

/// Findings in the pictures of a scan, in its order, each with its time, s.
pub(crate) type InOrder<'a> = Vec<(f64, &'a mut Result<Detection, NotFound>)>;

/// Refuses the pictures in which the seam jumps away from where the pictures before and after have it. Returns how far a
/// point typically is from where its neighbours have it, px; `None` with too few of them.
pub fn refuse_jumps(scan: &mut InOrder<'_>) -> Option<f64> {
    let first = refuse_jumps_of(scan, |found| Some(found.seam.pixel));
    let second = refuse_jumps_of(scan, |found| found.second.map(|seam| seam.pixel));
    first.into_iter().chain(second).max_by(f64::total_cmp)
}

fn refuse_jumps_of(
    scan: &mut InOrder<'_>,
    place: impl Fn(&Detection) -> Option<Vector2<f64>>,
) -> Option<f64> {
    let points = places(scan, place);
    if points.len() <= NEIGHBOURS {
        return None;
    }
    let tracked: Vec<(f64, Vector2<f64>)> = points.iter().map(|(_, time_s, at)| (*time_s, *at)).collect();
    let off: Vec<f64> = (0..tracked.len()).map(|k| (tracked[k].1 - expected(&tracked, k)).norm()).collect();
    let typical_px = median(&mut off.clone());
    let limit = (TYPICAL * typical_px).max(LEAST_PX);
    for ((number, _, _), off) in points.iter().zip(off).filter(|(_, off)| *off > limit) {
        *scan[*number].1 = Err(NotFound::Jumps { distance_px: off, most_px: limit });
    }
    Some(typical_px)
}

/// The places of one line: number of the picture, time, pixel.
pub(crate) fn places(
    scan: &InOrder<'_>,
    place: impl Fn(&Detection) -> Option<Vector2<f64>>,
) -> Vec<(usize, f64, Vector2<f64>)> {
    let found =
        scan.iter().enumerate().filter_map(|(k, (time_s, found))| Some((k, *time_s, found.as_ref().ok()?)));
    found.filter_map(|(k, time_s, found)| Some((k, time_s, place(found)?))).collect()
}

/// Position by its neighbours: a parabola over time through them, of least absolute deviations, which a few wrong
/// ones do not move \[Schlossmacher1973\].
fn expected(points: &[(f64, Vector2<f64>)], number: usize) -> Vector2<f64> {
    let first = number.saturating_sub(NEIGHBOURS / 2).min(points.len() - 1 - NEIGHBOURS);
    let (own_time_s, own) = points[number];
    let around = || (first..=first + NEIGHBOURS).filter(|k| *k != number).map(|k| points[k]);
    let span_s = around().map(|(time_s, _)| (time_s - own_time_s).abs()).fold(1e-9, f64::max);
    let row = |time_s: f64| {
        let t = (time_s - own_time_s) / span_s;
        Vector3::new(1.0, t, t * t)
    };
    let mut expected = own;
    for axis in 0..2 {
        let mut at = Vector3::new(own[axis], 0.0, 0.0);
        for round in 0..ROUNDS {
            let (mut information, mut right) = (Matrix3::zeros(), Vector3::zeros());
            for (time_s, point) in around() {
                let row = row(time_s);
                // All alike at first; then each as the deviation from the last parabola asks.
                let off = (point[axis] - row.dot(&at)).abs();
                let weight = if round == 0 { 1.0 } else { 1.0 / off.max(ALIKE_PX) };
                information += row * row.transpose() * weight;
                right += row * (weight * point[axis]);
            }
            match information.try_inverse() {
                Some(inverse) => at = inverse * right,
                // All at one time: there is no evidence against the point.
                None => return own,
            }
        }
        expected[axis] = at.x;
    }
    expected
}
