//! Order of points in base along a curve, open or closed, and the spline through them.

use crate::curve::graph::{ASIDE, Graph, directions};
use crate::curve::spline::Spline;
use nalgebra::Vector3;
use trueline_lsq::Loss;

/// Maximum number of points that are ordered; of more, every n-th.
const MOST_POINTS: usize = 500;
/// The curve must connect this fraction of the points.
const LEAST_CONNECTED: f64 = 0.6;
/// An end has less than this fraction of its neighbours on one side.
const LEAST_SIDE: f64 = 0.2;
/// Scale of the loss of the spline's fit, m.
const SCALE_M: f64 = 3e-3;
/// Rounds of arc length and weights.
const ROUNDS: usize = 3;

/// Ordered points.
#[derive(Clone, Debug)]
pub(crate) struct Ordered {
    /// Place of each point along the curve, m; `None` for outliers.
    pub along_m: Vec<Option<f64>>,
    /// Length of the curve, m.
    pub length_m: f64,
    /// Whether it is closed.
    pub closed: bool,
}

/// The order of points, m; `None` if they are not one curve.
#[must_use]
pub(crate) fn ordered(points: &[Vector3<f64>]) -> Option<Ordered> {
    let graph = Graph::of(points)?.parted(points).bridged(points).largest_part();
    if (graph.size() as f64) < LEAST_CONNECTED * points.len() as f64 {
        return None;
    }
    ordered_by(&graph, points)
}

/// Cause that points are not one curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Obstacle {
    /// The curve crosses itself.
    Crosses,
    /// The points lie on several pieces.
    InPieces,
}

/// The cause that points in the order of time, m, are not one curve, if it is known.
#[must_use]
pub(crate) fn obstacle(points: &[Vector3<f64>]) -> Option<Obstacle> {
    let some = thinned(points);
    let graph = Graph::of(&some)?.parted(&some).bridged(&some);
    if graph.is_parted() {
        return Some(Obstacle::Crosses);
    }
    let all = graph.size() as f64;
    ((graph.largest_part().size() as f64) < LEAST_CONNECTED * all).then_some(Obstacle::InPieces)
}

/// Every n-th point, so that there are not too many.
fn thinned(points: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let every = points.len().div_ceil(MOST_POINTS).max(1);
    points.iter().step_by(every).copied().collect()
}

/// The same by a graph.
#[must_use]
pub(crate) fn ordered_by(graph: &Graph, points: &[Vector3<f64>]) -> Option<Ordered> {
    let start = graph.kept.iter().position(|kept| *kept)?;
    let (end, _) = graph.farthest(start)?;
    if let Some(direction) = through(graph, points, end) {
        let near =
            |k: usize| (points[k] - points[end]).norm() < graph.radius_m && graph.are_on_one_branch(k, end);
        let cut = graph.without(near);
        if let Some(closed) = closed_at(graph, &cut, points, end, &direction) {
            return Some(closed);
        }
        // In an open curve the farthest point from there is an end.
        let (end, _) = graph.farthest(end)?;
        return open_from(graph, end);
    }
    open_from(graph, end)
}

fn open_from(graph: &Graph, end: usize) -> Option<Ordered> {
    let (other, distances_m) = graph.farthest(end)?;
    let along_m = distances_m.iter().map(|d| d.is_finite().then_some(*d)).collect();
    Some(Ordered { along_m, length_m: distances_m[other], closed: false })
}

/// Direction of the points about one that has points on both sides; `None` at an end.
fn through(graph: &Graph, points: &[Vector3<f64>], at: usize) -> Option<Vector3<f64>> {
    let off: Vec<Vector3<f64>> = graph.neighbours(at).map(|k| points[k] - points[at]).collect();
    let spread = off.iter().map(|v| v * v.transpose()).sum::<nalgebra::Matrix3<f64>>();
    let eigen = spread.symmetric_eigen();
    let direction: Vector3<f64> = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into();
    let aside =
        |sign: f64| off.iter().filter(|v| sign * direction.dot(v) > ASIDE * graph.radius_m).count() as f64;
    let sides = [aside(1.0), aside(-1.0)];
    let least = LEAST_SIDE * off.len() as f64;
    (sides[0] > least && sides[1] > least).then_some(direction)
}

/// The order of a closed curve that was cut at a point; `None` if the cut divides it.
fn closed_at(
    graph: &Graph,
    cut: &Graph,
    points: &[Vector3<f64>],
    at: usize,
    direction: &Vector3<f64>,
) -> Option<Ordered> {
    /// A cut that leaves this fraction of the points in one piece does not divide the curve.
    const IN_ONE_PIECE: f64 = 0.95;
    /// Range of the search for the beginning around the cut, in radii.
    const BESIDE: f64 = 2.5;
    let off = |k: usize| points[k] - points[at];
    let ahead = |k: &usize| {
        let is_near = off(*k).norm() < BESIDE * graph.radius_m;
        cut.kept[*k] && is_near && direction.dot(&off(*k)) > 0.0 && graph.are_on_one_branch(*k, at)
    };
    let begin = (0..points.len()).filter(ahead).min_by(|a, b| off(*a).norm().total_cmp(&off(*b).norm()))?;
    let (last, distances_m) = cut.farthest(begin)?;
    let reached = distances_m.iter().filter(|d| d.is_finite()).count();
    if (reached as f64) < IN_ONE_PIECE * cut.size() as f64 {
        return None;
    }
    let first_m = off(begin).norm();
    let length_m = first_m + distances_m[last] + off(last).norm();
    let along_m = (0..points.len()).map(|k| {
        if distances_m[k].is_finite() {
            return Some(first_m + distances_m[k]);
        }
        let place_m = direction.dot(&off(k));
        (graph.kept[k] && !cut.kept[k]).then_some(if place_m < 0.0 { length_m + place_m } else { place_m })
    });
    Some(Ordered { along_m: along_m.collect(), length_m, closed: true })
}

/// The curve through points in base, m, with knots of about a spacing, and the place of each point on it. `None` if they are not
/// one curve, or if it is longer than `most_length_m`. A closed curve that may not be closed is cut at its beginning.
#[must_use]
pub(crate) fn curve_through(
    points: &[Vector3<f64>],
    spacing_m: f64,
    (may_close, most_control): (bool, usize),
    most_length_m: f64,
) -> Option<(Spline, Vec<f64>)> {
    let some = thinned(points);
    let Ordered { along_m, length_m, closed } = ordered(&some)?;
    let closed = closed && may_close;
    if length_m > most_length_m {
        return None;
    }
    let in_order = along_m.iter().zip(&some).filter_map(|(along_m, point)| Some(((*along_m)?, *point, 1.0)));
    let mut samples: Vec<(f64, Vector3<f64>, f64)> = in_order.collect();
    let mut spline = Spline::through(&samples, length_m, spacing_m, closed, most_control)?;
    for _ in 0..ROUNDS {
        let lengths_m = spline.arc_lengths(8);
        let step_m = spline.spacing_m / 8.0;
        let loss = Loss::GemanMcClure { scale: SCALE_M };
        for (u_m, point, weight) in &mut samples {
            *weight = loss.weight((spline.point(*u_m) - *point).norm_squared());
            let place = (*u_m / step_m).clamp(0.0, (lengths_m.len() - 1) as f64);
            let before = (place as usize).min(lengths_m.len() - 2);
            let part = place - before as f64;
            *u_m = lengths_m[before] * (1.0 - part) + lengths_m[before + 1] * part;
        }
        spline = Spline::through(&samples, *lengths_m.last()?, spacing_m, closed, most_control)?;
    }
    let u_m = places_on(&spline, points);
    Some((spline, u_m))
}

/// u of each point in the order of time, m: the nearest place of the curve. At a crossing it is on the branch along the sensor's
/// travel.
#[must_use]
pub(crate) fn places_on(spline: &Spline, points: &[Vector3<f64>]) -> Vec<f64> {
    if !spline.meets_itself() {
        return points.iter().map(|point| nearest(spline, point)).collect();
    }
    let along = directions(points);
    points.iter().zip(&along).map(|(point, along)| nearest_along(spline, point, Some(along))).collect()
}

/// u of the sample of a curve that is nearest to a point, m.
#[must_use]
pub(crate) fn nearest(spline: &Spline, point: &Vector3<f64>) -> f64 {
    nearest_along(spline, point, None)
}

/// The same; a sample with another direction than `along` counts as farther by one knot.
fn nearest_along(spline: &Spline, point: &Vector3<f64>, along: Option<&Vector3<f64>>) -> f64 {
    const PER_KNOT: usize = 3;
    let step_m = spline.spacing_m / PER_KNOT as f64;
    let steps = (spline.span_m() / step_m).round() as usize;
    let squared = |k: &usize| {
        let (place, tangent) = spline.at(&spline.basis(*k as f64 * step_m));
        let aside = along.map_or(0.0, |along| 1.0 - along.dot(&tangent).powi(2) / tangent.norm_squared());
        (place - point).norm_squared() + aside * spline.spacing_m.powi(2)
    };
    let best = (0..=steps).min_by(|a, b| squared(a).total_cmp(&squared(b))).unwrap_or(0);
    best as f64 * step_m
}
