//! A curved seam in pieces, each nearly a parabola. A part with such a seam is treated like a part with many short seams.
//!
//! The first weld of a part cuts the curve. A piece is up to 40 mm long and turns by up to half a radian, so a parabola is off an
//! arc of radius R by at most R·0.5⁴/128, 0.03 mm for 60 mm. Later welds of the part are cut at the same places: a point belongs
//! to the piece with the nearest middle.

use super::seam_fit::{SeamFit, fitted_piece, in_base};
use super::weld_error::{LEAST_FEATURES, WeldError};
use crate::reference::Part;
use nalgebra::Vector3;
use trueline_geometry::Line;
use trueline_method::evaluate::placed_features::PlacedFeatures;
use trueline_method::order_statistics::median;

/// Largest turn of a piece, rad …
const TURN_RAD: f64 = 0.5;
/// … and its largest length, m.
const LENGTH_M: f64 = 40e-3;
/// A piece has twice the required features, because its neighbours may get some.
const FEATURES: usize = 2 * LEAST_FEATURES;
/// Distance between the places where the direction of the curve is evaluated, m.
const NODE_M: f64 = 4e-3;
/// Points of a running median, which rejects an outlier.
const SMOOTH: usize = 5;
/// A weld is of a part's curve if this fraction of its points is no farther from a middle than a piece is long.
const OF_PART: f64 = 0.9;

/// The pieces of a curved weld, cut like those of its part, if it has one.
///
/// # Errors
/// A piece with too few points, or without a line across the laser plane.
pub(crate) fn fitted_pieces(
    of: &mut PlacedFeatures,
    parts: &[Part],
    shape_origin_m: [f64; 2],
) -> Result<Vec<SeamFit>, WeldError> {
    // Whole stripes support straight seams only.
    of.stripes.clear();
    let labels: Vec<u32> = of.list.iter().map(|feature| feature.line).collect();
    for part in parts {
        let middles: Vec<Vector3<f64>> = part.lines.iter().map(|line| *line.anchor()).collect();
        if !covers(&middles, of) {
            continue;
        }
        let fits = cut(of, &middles, shape_origin_m);
        let is_like = |fits: &Vec<SeamFit>| part.is_like(&lines(fits));
        if let Some(fits) = fits.ok().filter(is_like) {
            return Ok(fits);
        }
    }
    let count = labels.iter().max().map_or(0, |last| last + 1);
    let of_label = |label: u32| {
        let own = of.list.iter().zip(&labels).filter(|(_, own)| **own == label);
        middles(&own.map(|(feature, _)| in_base(feature)).collect::<Vec<_>>())
    };
    let first: Vec<Vector3<f64>> = (0..count).flat_map(of_label).collect();
    // Cut about the present middles of the pieces; the part keeps them from now on.
    let fits = cut(of, &first, shape_origin_m)?;
    let middles: Vec<Vector3<f64>> = fits.iter().map(|fit| *fit.seam.line.anchor()).collect();
    cut(of, &middles, shape_origin_m)
}

fn lines(fits: &[SeamFit]) -> Vec<Line> {
    fits.iter().map(|fit| fit.seam.line).collect()
}

/// Whether pieces about these middles cover the points of a weld.
fn covers(middles: &[Vector3<f64>], of: &PlacedFeatures) -> bool {
    let near = of.list.iter().filter(|feature| {
        let point = in_base(feature);
        middles.iter().any(|middle| (middle - point).norm() < LENGTH_M)
    });
    near.count() as f64 > OF_PART * of.list.len() as f64
}

/// Numbers the features by the nearest middle, and fits each piece.
fn cut(
    of: &mut PlacedFeatures,
    middles: &[Vector3<f64>],
    shape_origin_m: [f64; 2],
) -> Result<Vec<SeamFit>, WeldError> {
    for feature in &mut of.list {
        let point = in_base(feature);
        let off = |k: &usize| (middles[*k] - point).norm_squared();
        let nearest = (0..middles.len()).min_by(|a, b| off(a).total_cmp(&off(b)));
        feature.line = nearest.unwrap_or(0) as u32;
    }
    let fit = |(number, middle)| fitted_piece(of, number, middle, shape_origin_m);
    (0..).zip(middles).map(fit).collect()
}

/// Middles of the pieces of a curve through points in the order of time, m.
fn middles(points: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let nodes = nodes(points);
    let steps: Vec<Vector3<f64>> = nodes.windows(2).map(|pair| pair[1] - pair[0]).collect();
    // Fraction of a piece used by each step: of its turn or of its length.
    let turn = |k: usize| if k == 0 { 0.0 } else { steps[k - 1].angle(&steps[k]) };
    let taken: Vec<f64> =
        (0..steps.len()).map(|k| (turn(k) / TURN_RAD).max(steps[k].norm() / LENGTH_M)).collect();
    let all: f64 = taken.iter().sum();
    let count = (all.ceil() as usize).clamp(1, (points.len() / FEATURES).max(1));
    let (mut done, mut middles) = (0.0, Vec::with_capacity(count));
    for (k, taken) in taken.iter().enumerate() {
        while middles.len() < count && done + taken >= (middles.len() as f64 + 0.5) * all / count as f64 {
            let part =
                ((middles.len() as f64 + 0.5) * all / count as f64 - done) / taken.max(f64::MIN_POSITIVE);
            middles.push(nodes[k] + steps[k] * part);
        }
        done += taken;
    }
    middles
}

/// Places along a curve, each where the curve first leaves the neighbourhood of the earlier ones: a second pass adds none.
fn nodes(points: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let mut nodes: Vec<Vector3<f64>> = Vec::new();
    for some in points.windows(SMOOTH) {
        let axis = |k: usize| median(some.iter().map(|point| point[k])).unwrap_or(some[0][k]);
        let point = Vector3::from_fn(|k, _| axis(k));
        if nodes.iter().all(|node| (node - point).norm() > NODE_M) {
            nodes.push(point);
        }
    }
    nodes
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ring of 50 mm turns by 2π: thirteen pieces of half a radian, on the ring and evenly spaced, after one pass or two.
    #[test]
    fn a_ring_has_pieces_of_half_a_radian() {
        for passes in [1.0, 2.0] {
            let at = |k: i32| {
                let turn = passes * std::f64::consts::TAU * f64::from(k) / 1200.0;
                Vector3::new(0.05 * turn.cos(), 0.05 * turn.sin(), 0.3)
            };
            let points: Vec<_> = (0..1200).map(at).collect();
            let middles = middles(&points);
            assert_eq!(middles.len(), 13);
            for pair in middles.windows(2) {
                // Nodes lie on chords of 4 mm.
                assert!((pair[0].xy().norm() - 0.05).abs() < 1e-4);
                assert!(((pair[1] - pair[0]).norm() - 0.024).abs() < 2.5e-3, "{pair:?}");
            }
        }
    }
}
