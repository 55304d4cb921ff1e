//! Whether two corners are neighbours: between neighbours runs an edge, bright on one side and dark on the other.

use crate::gray::Gray;
use nalgebra::Vector2;

/// Places along the way from corner to corner at which the edge is sampled.
const ALONG: [f64; 5] = [0.2, 0.35, 0.5, 0.65, 0.8];

/// Distance of the sampled levels from the edge, as a part of its length.
const BESIDE: f64 = 0.18;

/// How alike the contrasts along an edge must be.
const LEAST_EVENNESS: f64 = 0.35;

/// Contrast of the edge that runs from one corner to another: positive where the left side, seen along the way, is
/// bright. `None` if no such edge runs there.
pub(super) fn contrast(picture: &Gray, from: &Vector2<f64>, to: &Vector2<f64>) -> Option<f64> {
    let along = to - from;
    let left = Vector2::new(along.y, -along.x) * BESIDE;
    let mut contrasts = [0.0; ALONG.len()];
    for (contrast, part) in contrasts.iter_mut().zip(ALONG) {
        let at = from + along * part;
        *contrast = picture.between(&(at + left))? - picture.between(&(at - left))?;
    }
    let largest = contrasts.iter().map(|c| c.abs()).fold(0.0, f64::max);
    let even =
        contrasts.iter().all(|c| c.signum() == contrasts[0].signum() && c.abs() >= LEAST_EVENNESS * largest);
    (even && largest > 0.0).then(|| contrasts.iter().sum::<f64>() / ALONG.len() as f64)
}
