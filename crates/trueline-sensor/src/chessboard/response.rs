//! Response of a picture to the meeting point of four squares.
//!
//! On a ring of sixteen samples around such a point, opposite samples are alike and those a quarter turn away differ.
//! Along an edge or a line the reverse holds \[Bennett2014\]: response = Σ |(Iₙ + Iₙ₊₈) − (Iₙ₊₄ + Iₙ₊₁₂)| − Σ |Iₙ −
//! Iₙ₊₈| − 16 |mean of the ring − mean of the middle|.

use crate::gray::Gray;
use nalgebra::Vector2;

/// Offsets of the ring, of radius 5 px, in order around it.
const RING: [(i32, i32); 16] = [
    (0, -5),
    (2, -5),
    (3, -3),
    (5, -2),
    (5, 0),
    (5, 2),
    (3, 3),
    (2, 5),
    (0, 5),
    (-2, 5),
    (-3, 3),
    (-5, 2),
    (-5, 0),
    (-5, -2),
    (-3, -3),
    (-2, -5),
];

/// A candidate must reach this part of the strongest response.
const LEAST_PART: f32 = 0.06;

/// No two candidates are nearer than this, px.
const APART: usize = 4;

/// Largest number of candidates: the strongest are used.
const MOST_CANDIDATES: usize = 6000;

/// Pixels that look like corners, the strongest first.
pub(super) fn candidates(picture: &Gray) -> Vec<Vector2<f64>> {
    let (width, height) = (picture.width(), picture.height());
    let mut response = vec![0.0_f32; width * height];
    for row in 5..height.saturating_sub(5) {
        for column in 5..width.saturating_sub(5) {
            response[row * width + column] = response_at(picture, column, row);
        }
    }
    let strongest = response.iter().copied().fold(0.0, f32::max);
    let mut peaks: Vec<(f32, usize, usize)> = Vec::new();
    for row in 5..height.saturating_sub(5) {
        for column in 5..width.saturating_sub(5) {
            let value = response[row * width + column];
            if value > LEAST_PART * strongest && is_peak(&response, width, height, (column, row)) {
                peaks.push((value, column, row));
            }
        }
    }
    peaks.sort_by(|a, b| b.0.total_cmp(&a.0).then((a.2, a.1).cmp(&(b.2, b.1))));
    peaks.truncate(MOST_CANDIDATES);
    peaks.into_iter().map(|(_, column, row)| Vector2::new(column as f64, row as f64)).collect()
}

fn response_at(picture: &Gray, column: usize, row: usize) -> f32 {
    let ring: [f32; 16] = RING.map(|(dx, dy)| {
        picture.at(column.wrapping_add_signed(dx as isize), row.wrapping_add_signed(dy as isize))
    });
    let (mut sums, mut differences, mut total) = (0.0, 0.0, 0.0);
    for n in 0..4 {
        sums += ((ring[n] + ring[n + 8]) - (ring[n + 4] + ring[n + 12])).abs();
    }
    for n in 0..8 {
        differences += (ring[n] - ring[n + 8]).abs();
        total += ring[n] + ring[n + 8];
    }
    let middle = (picture.at(column, row)
        + picture.at(column - 1, row)
        + picture.at(column + 1, row)
        + picture.at(column, row - 1)
        + picture.at(column, row + 1))
        / 5.0;
    sums - differences - (total - 16.0 * middle).abs()
}

/// Whether no pixel nearby responds more; of equal ones the first counts.
fn is_peak(response: &[f32], width: usize, height: usize, (column, row): (usize, usize)) -> bool {
    let value = response[row * width + column];
    let rows = row.saturating_sub(APART)..=(row + APART).min(height - 1);
    rows.flat_map(|r| (column.saturating_sub(APART)..=(column + APART).min(width - 1)).map(move |c| (c, r)))
        .all(|(c, r)| {
            let other = response[r * width + c];
            other < value || (other == value && (r, c) >= (row, column))
        })
}
