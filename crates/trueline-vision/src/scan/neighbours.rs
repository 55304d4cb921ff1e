//! Seams of a scan against each other: a point that the pictures before and after it do not bear out.
//!
//! Pictures are looked at one by one; only afterwards, with all of them known, is a point refused that lies far
//! from where its neighbours have the seam. Far is measured by how well neighbours agree everywhere: a scan that
//! moves fast, or pictures that have nothing to do with each other, are not judged by this.

use crate::measure::regression::median;
use crate::not_found::NotFound;
use crate::seam::Seam;
use nalgebra::{Matrix3, Vector2, Vector3};

/// Neighbours through which a point's place is interpolated, those on the border of the scan on one side only.
const NEIGHBOURS: usize = 10;
/// Rounds of the fit through them, and the deviation below which all of them count alike, px.
const ROUNDS: usize = 12;
const ALIKE_PX: f64 = 0.3;
/// A point is refused beyond this many typical deviations, and this many px.
const TYPICAL: f64 = 10.0;
const LEAST_PX: f64 = 10.0;

/// Refuses the points that jump away from those before and after. `seams` are in the order of the scan, each
/// with its time, s. Returns how far a point typically is from where its neighbours have it, px; `None` with too few
/// of them.
pub fn refuse_jumps<'a>(seams: impl Iterator<Item = (f64, &'a mut Result<Seam, NotFound>)>) -> Option<f64> {
    let mut found: Vec<(f64, &mut Result<Seam, NotFound>)> = seams.filter(|(_, seam)| seam.is_ok()).collect();
    let points: Vec<(f64, Vector2<f64>)> = found
        .iter()
        .filter_map(|(time_s, seam)| seam.as_ref().ok().map(|seam| (*time_s, seam.pixel)))
        .collect();
    if points.len() <= NEIGHBOURS {
        return None;
    }
    let off: Vec<f64> = (0..points.len()).map(|k| (points[k].1 - expected(&points, k)).norm()).collect();
    let typical_px = median(&mut off.clone());
    let limit = (TYPICAL * typical_px).max(LEAST_PX);
    for ((_, seam), off) in found.iter_mut().zip(off) {
        if off > limit {
            **seam = Err(NotFound::Jumps { distance_px: off, most_px: limit });
        }
    }
    Some(typical_px)
}

/// Where its neighbours have a point: a parabola over time through them, of least absolute deviations, which a few
/// wrong ones do not move \[Schlossmacher1973\].
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
                // All at one time: nothing can be said against the point.
                None => return own,
            }
        }
        expected[axis] = at.x;
    }
    expected
}
