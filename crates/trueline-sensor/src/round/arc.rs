//! The arc of a sphere or a cylinder among the points of a profile.
//!
//! From each of some short stretches a circle grows over its neighbours, so far as they lie on it. Of all arcs that turn far enough and are
//! no larger than the target the one with the most points is taken.

use super::cut::{Circle, FEWEST_POINTS};
use super::target::RoundTarget;
use nalgebra::Vector2;
use trueline_geometry::statistics::{mad_sigma, median, quantile};

/// Stretches that a profile is divided into; an arc grows from each.
const STRETCHES: usize = 16;
/// A point lies on a circle within so many times the scatter.
const ON_CIRCLE: f64 = 5.0;
/// Points of a profile that an arc is looked for among, at the most; then it takes all that lie on it.
const FEW: usize = 240;
/// An arc grows by this part of its length at a time.
const GROWS: f64 = 0.2;
/// It goes on while at least this part of the new points lies on it.
const MOST: f64 = 0.7;
/// Points further from their neighbour than this many columns begin another surface.
const COLUMNS_APART: f64 = 12.0;
/// An arc turns by this at the least, rad: 40°. A flat face turns by its noise alone.
const LEAST_TURN_RAD: f64 = 0.7;
/// Length of the arc that [`super::target::Row::off_circle`] is of, rad.
const LONG_RAD: f64 = 2.1;
/// Of a profile at least this part is smooth.
const SMOOTH: f64 = 0.3;
/// Points scatter about an arc by no more than this multiple of the noise: neighbours share some of it.
const LOOSE: f64 = 10.0;
/// Noise below which a profile is exact, m.
const EXACT_M: f64 = 1e-8;
/// Points that are left out at either end, in parts of the arc: there the laser spot runs over the edge of what is seen.
const ENDS: f64 = 0.01;

/// The points of a target's arc, in the order of the profile (sheet coordinates, m); `None` where there is none. Without a radius (m) any
/// arc counts.
#[must_use]
pub fn arc(points: &[Vector2<f64>], target: RoundTarget, radius_m: Option<f64>) -> Option<Vec<Vector2<f64>>> {
    let limits = Limits { noise_m: noise_m(points), off_circle: target.row().off_circle };
    let most_m = radius_m.map_or(f64::INFINITY, |radius_m| target.row().larger * radius_m);
    let few: Vec<Vector2<f64>> = points.iter().step_by(points.len().div_ceil(FEW).max(1)).copied().collect();
    let width = (few.len() / STRETCHES).max(FEWEST_POINTS);
    let mut best: Option<Grown> = None;
    for first in (0..(few.len() + 1).saturating_sub(width)).step_by((width / 2).max(1)) {
        if best.as_ref().is_some_and(|best| best.first <= first && first + width <= best.last) {
            continue;
        }
        let Some(found) = grown(&few, [first, first + width], &limits) else { continue };
        let is_arc = found.circle.radius_m <= most_m
            && found.circle.extent_rad(&few[found.first..found.last]) >= LEAST_TURN_RAD;
        if is_arc && best.as_ref().is_none_or(|best| found.last - found.first > best.last - best.first) {
            best = Some(found);
        }
    }
    let Grown { first, last, circle, limit_m } = best?;
    let (from, to) = (few[first].x.min(few[last - 1].x), few[first].x.max(few[last - 1].x));
    let is_on = |p: &&Vector2<f64>| (from..=to).contains(&p.x) && circle.off(p).abs() < limit_m;
    let on: Vec<Vector2<f64>> = points.iter().filter(is_on).copied().collect();
    let end = (ENDS * on.len() as f64).ceil() as usize;
    (on.len() >= FEWEST_POINTS + 2 * end).then(|| on[end..on.len() - end].to_vec())
}

/// How far the points of an arc are off their circle.
struct Limits {
    /// Noise of a point, m.
    noise_m: f64,
    /// Of an arc of [`LONG_RAD`], in radii.
    off_circle: f64,
}

impl Limits {
    /// How far an arc is off its circle because it is none, m.
    fn off_m(&self, circle: &Circle, points: &[Vector2<f64>]) -> f64 {
        if self.off_circle == 0.0 {
            return 0.0;
        }
        self.off_circle * circle.radius_m * (circle.extent_rad(points) / LONG_RAD).min(1.0).powi(3)
    }
}

/// A stretch of points on a circle, and how far these are off it at the most, m.
struct Grown {
    first: usize,
    last: usize,
    circle: Circle,
    limit_m: f64,
}

/// Noise of a point along the range, m: of third differences, which a smooth surface hardly has, in the smoother stretches of the profile.
fn noise_m(points: &[Vector2<f64>]) -> f64 {
    let third = |p: &[Vector2<f64>]| p[3].y - 3.0 * p[2].y + 3.0 * p[1].y - p[0].y;
    let of = |stretch: &[Vector2<f64>]| mad_sigma(&stretch.windows(4).map(third).collect::<Vec<f64>>());
    let length = (points.len() / STRETCHES).max(2 * FEWEST_POINTS);
    let noise_m = quantile(points.chunks(length).filter(|c| c.len() == length).map(of), SMOOTH);
    (noise_m.unwrap_or(0.0) / 20_f64.sqrt()).max(EXACT_M)
}

/// The points on the circle through a stretch, from it as far as they go.
fn grown(points: &[Vector2<f64>], stretch: [usize; 2], limits: &Limits) -> Option<Grown> {
    let [mut first, mut last] = stretch;
    let column_m = median(points.windows(2).map(|p| (p[1].x - p[0].x).abs()))?;
    let is_gap = |a: usize, b: usize| (points[b] - points[a]).norm() > COLUMNS_APART * column_m;
    if (first + 1..last).any(|k| is_gap(k - 1, k)) {
        return None;
    }
    let (mut circle, mut limit_m) = settled(&points[first..last], limits)??;
    loop {
        let step = ((last - first) as f64 * GROWS).ceil() as usize;
        let within = |circle: &Circle, from: usize, to: usize| {
            let on = points[from..to].iter().filter(|p| circle.off(p).abs() < limit_m).count();
            on as f64 >= MOST * (to - from) as f64
        };
        let to = (last..(last + step).min(points.len())).find(|k| is_gap(k - 1, *k));
        let to = to.unwrap_or((last + step).min(points.len()));
        let from = (first.saturating_sub(step)..first).rev().find(|k| is_gap(*k, k + 1));
        let from = from.map_or(first.saturating_sub(step), |k| k + 1);
        let to = if to > last && within(&circle, last, to) { to } else { last };
        let from = if from < first && within(&circle, from, first) { from } else { first };
        if (from, to) == (first, last) {
            break;
        }
        let Some(next) = settled(&points[from..to], limits)? else { break };
        (first, last, (circle, limit_m)) = (from, to, next);
    }
    Some(Grown { first, last, circle, limit_m })
}

/// The circle through most of some points, and how far these are off it at the most, m. `Some(None)` of points that scatter too much.
fn settled(points: &[Vector2<f64>], limits: &Limits) -> Option<Option<(Circle, f64)>> {
    let mut circle = Circle::of(points)?;
    for _ in 0..2 {
        let off_m = limits.off_m(&circle, points);
        let limit_m = ON_CIRCLE * scatter_m(&circle, points, limits.noise_m)? + off_m;
        let on: Vec<Vector2<f64>> =
            points.iter().filter(|p| circle.off(p).abs() < limit_m).copied().collect();
        if on.len() < FEWEST_POINTS {
            return None;
        }
        circle = Circle::of(&on)?;
    }
    let scatter_m = scatter_m(&circle, points, limits.noise_m)?;
    let off_m = limits.off_m(&circle, points);
    let is_loose = scatter_m > LOOSE * limits.noise_m + off_m;
    Some((!is_loose).then_some((circle, ON_CIRCLE * scatter_m + off_m)))
}

fn scatter_m(circle: &Circle, points: &[Vector2<f64>], noise_m: f64) -> Option<f64> {
    // The median of |N(0, 1)| is 0.67449.
    let median_m = median(points.iter().map(|p| circle.off(p).abs()))?;
    Some((median_m / 0.674_49).max(noise_m))
}
