//! The laser's stripe on a board: pixels along its middle.
//!
//! Seen across, the stripe is a ridge of the picture. Every line of pixels across the board offers its best ridges; on a
//! plane the stripe is straight once the lens distortion is taken out, so the straight line that most of them share is the
//! stripe. Where the ground beside a ridge is bright on one side and dark on the other, it is the edge of a square, or a
//! stripe whose middle is shifted by one: such ridges are left out.

use crate::gray::Gray;
use crate::laser_plane::ground::Ground;
use nalgebra::Vector2;
use trueline_geometry::statistics::median;
use trueline_model::Camera;

/// Width of the smoothing along a line of pixels, standard deviation, by how far beside the stripe the ground is looked at.
const SMOOTHING: f64 = 0.4;

/// Ridges of a line of pixels that are considered.
const RIDGES: usize = 4;

/// A ridge belongs to the stripe within this distance, px.
const NEAR_PX: f64 = 1.5;

/// The stripe is seen on this part of the lines of pixels at least. Where it runs near the edges of squares it is not.
const LEAST_PART: f64 = 0.12;

/// Levels beside the stripe may differ by this part of its height.
const MOST_UNEVEN: f64 = 0.2;

/// A ridge of the stripe has this part of the usual strength at least: black reflects a third of what white does.
const LEAST_STRENGTH: f64 = 0.2;

/// A ridge of the stripe is stronger than noise by this much: noise makes ridges too, and among many some lie on a straight line.
const ABOVE_NOISE: f64 = 3.0;

/// The ridge of a line of pixels, by strength, that is noise: the stripe and perhaps its reflection are stronger.
const NOISE_RIDGE: usize = 2;

/// A line of pixels that crosses the ground on less than this is not looked at, px.
const LEAST_SPAN_PX: f64 = 20.0;

/// A ridge in a line of pixels.
#[derive(Clone, Copy)]
struct Ridge {
    pixel: Vector2<f64>,
    ideal: Vector2<f64>,
    strength: f64,
}

/// Pixels along the stripe's middle, within the outline of what it falls on. Empty where there is no stripe.
#[must_use]
pub fn find(picture: &Gray, camera: &Camera, ground: &Ground) -> Vec<Vector2<f64>> {
    let upright = along(picture, camera, ground, false);
    let level = along(picture, camera, ground, true);
    if upright.len() > level.len() { upright } else { level }
}

/// The stripe as seen by columns (`by_column`) or rows of pixels.
fn along(picture: &Gray, camera: &Camera, ground: &Ground, by_column: bool) -> Vec<Vector2<f64>> {
    let lines = if by_column { picture.width() } else { picture.height() };
    let mut ridges = Vec::new();
    let mut looked_at = 0;
    for line in 0..lines {
        let Some((from, to)) = span(&ground.outline, line as f64, by_column) else { continue };
        if to - from < LEAST_SPAN_PX {
            continue;
        }
        looked_at += 1;
        ridges.push(ridges_of(picture, (camera, ground), (line, by_column), (from, to)));
    }
    let Some(stripe) = straight(&ridges, camera.focal.x) else { return Vec::new() };
    if (stripe.len() as f64) < LEAST_PART * f64::from(looked_at) {
        return Vec::new();
    }
    stripe.into_iter().map(|ridge| ridge.pixel).collect()
}

/// Where a line of pixels enters and leaves the outline.
fn span(outline: &[Vector2<f64>], line: f64, by_column: bool) -> Option<(f64, f64)> {
    let split = |p: &Vector2<f64>| if by_column { (p.x, p.y) } else { (p.y, p.x) };
    let mut crossings = Vec::new();
    for (k, from) in outline.iter().enumerate() {
        let ((a, s), (b, t)) = (split(from), split(&outline[(k + 1) % outline.len()]));
        if (a <= line) != (b <= line) {
            crossings.push(s + (t - s) * (line - a) / (b - a));
        }
    }
    crossings.sort_by(f64::total_cmp);
    Some((*crossings.first()?, *crossings.last()?)).filter(|(from, to)| to > from)
}

/// The strongest ridges of a line of pixels, between two places on it.
fn ridges_of(
    picture: &Gray,
    (camera, ground): (&Camera, &Ground),
    (line, by_column): (usize, bool),
    (from, to): (f64, f64),
) -> Vec<Ridge> {
    let count = if by_column { picture.height() } else { picture.width() };
    let first = (from.ceil().max(0.0)) as usize;
    let last = (to.floor().max(0.0) as usize).min(count.saturating_sub(1));
    if last < first + 8 {
        return Vec::new();
    }
    let level = |k: usize| f64::from(if by_column { picture.at(line, k) } else { picture.at(k, line) });
    let profile: Vec<f64> = (first..=last).map(level).collect();
    let beside_px = ground.beside_px;
    let bend = second_derivative(&profile, SMOOTHING * f64::from(beside_px));
    let pixel =
        |at: f64| if by_column { Vector2::new(line as f64, at) } else { Vector2::new(at, line as f64) };
    let on_one_square = |k: usize| {
        let (at, reach) = ((first + k) as f64, f64::from(beside_px) + 1.0);
        ground.is_plain_between(&pixel(at - reach), &pixel(at + reach))
    };
    let mut peaks: Vec<(f64, usize)> = (1..bend.len() - 1)
        .filter(|&k| {
            -bend[k] > 0.0
                && bend[k] <= bend[k - 1]
                && bend[k] < bend[k + 1]
                && is_clean(&profile, k, beside_px as usize)
                && on_one_square(k)
        })
        .map(|k| (-bend[k], k))
        .collect();
    peaks.sort_by(|a, b| b.0.total_cmp(&a.0));
    peaks.truncate(RIDGES);
    peaks
        .into_iter()
        .filter_map(|(strength, k)| {
            // The vertex of the parabola through three values.
            let (a, b, c) = (bend[k - 1], bend[k], bend[k + 1]);
            let at = (first + k) as f64 + 0.5 * (a - c) / (a - 2.0 * b + c);
            let pixel = pixel(at);
            let (ray, _) = camera.ray(&pixel).ok()?;
            Some(Ridge { pixel, ideal: ray.xy(), strength })
        })
        .collect()
}

/// Whether the ground is alike on both sides of a ridge.
fn is_clean(profile: &[f64], k: usize, reach: usize) -> bool {
    if k < reach + 1 || k + reach + 1 >= profile.len() {
        return false;
    }
    let mean = |at: usize| (profile[at - 1] + profile[at] + profile[at + 1]) / 3.0;
    let (before, after) = (mean(k - reach), mean(k + reach));
    let height = profile[k] - 0.5 * (before + after);
    height > 0.0 && (before - after).abs() < MOST_UNEVEN * height
}

/// Second derivative of the smoothed profile; beyond its ends the last value goes on.
fn second_derivative(profile: &[f64], smoothing_px: f64) -> Vec<f64> {
    let reach = (4.0 * smoothing_px) as isize;
    let variance = smoothing_px * smoothing_px;
    let weights: Vec<f64> = (-reach..=reach)
        .map(|k| {
            let x = k as f64;
            (x * x / variance - 1.0) * (-0.5 * x * x / variance).exp()
        })
        .collect();
    // Cut off, the weights no longer sum to zero: a bright ground would look bent.
    let mean = weights.iter().sum::<f64>() / weights.len() as f64;
    let last = profile.len() as isize - 1;
    (0..=last)
        .map(|k| {
            let at = |d: isize| profile[(k + d).clamp(0, last) as usize];
            weights.iter().zip(-reach..=reach).map(|(w, d)| (w - mean) * at(d)).sum()
        })
        .collect()
}

/// The ridges, one of each line of pixels, that lie on one straight line: of all pairs of lines of pixels a fixed choice is
/// tried, so that the result does not depend on chance.
fn straight(ridges: &[Vec<Ridge>], focal_px: f64) -> Option<Vec<Ridge>> {
    let near = NEAR_PX / focal_px;
    let least = least_strength(ridges)?;
    let step = (ridges.len() / 12).max(1);
    let anchors: Vec<usize> = (0..ridges.len()).step_by(step).collect();
    let mut best: Vec<Ridge> = Vec::new();
    for (n, &i) in anchors.iter().enumerate() {
        for &j in &anchors[n + 3.min(anchors.len() - n)..] {
            for a in &ridges[i] {
                for b in &ridges[j] {
                    if a.strength.min(b.strength) < least {
                        continue;
                    }
                    let along = (b.ideal - a.ideal).normalize();
                    let found = on_line(ridges, &a.ideal, &along, near, least);
                    if found.len() > best.len() {
                        best = found;
                    }
                }
            }
        }
    }
    (best.len() >= 10).then_some(best)
}

fn on_line(
    ridges: &[Vec<Ridge>],
    from: &Vector2<f64>,
    along: &Vector2<f64>,
    near: f64,
    least_strength: f64,
) -> Vec<Ridge> {
    let off = |r: &Ridge| along.perp(&(r.ideal - from)).abs();
    let nearest = |line: &Vec<Ridge>| {
        line.iter()
            .filter(|r| r.strength >= least_strength)
            .min_by(|a, b| off(a).total_cmp(&off(b)))
            .copied()
            .filter(|r| off(r) < near)
    };
    ridges.iter().filter_map(nearest).collect()
}

/// The least strength of a ridge that may be the stripe's.
fn least_strength(ridges: &[Vec<Ridge>]) -> Option<f64> {
    let usual = |rank: usize| median(ridges.iter().filter_map(|line| Some(line.get(rank)?.strength)));
    let noise = usual(NOISE_RIDGE).unwrap_or(0.0);
    Some((LEAST_STRENGTH * usual(0)?).max(ABOVE_NOISE * noise))
}
