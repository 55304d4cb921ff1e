//! From corners to a board: which corner is in which column and row.
//!
//! Neighbours are joined by an edge. Edges around a corner alternate between bright on the left and bright on the
//! right, and from each corner to the next they swap. A wrong corner breaks this pattern and is left out.

use super::edge;
use crate::gray::Gray;
use nalgebra::{Matrix2, Vector2};
use std::collections::{BTreeMap, VecDeque};

/// How many of the nearest corners may be neighbours.
const NEAREST: usize = 10;

/// How far a neighbour may be from where the grid expects it, in steps of the grid.
const TOLERANCE: f64 = 0.35;

/// A contrast weaker than this part of the usual one is not an edge of the board.
const LEAST_CONTRAST: f64 = 0.25;

/// Place in the grid.
pub(super) type Place = (i32, i32);

/// An edge to a neighbour: its index and the contrast on the way to it.
#[derive(Clone, Copy)]
struct Edge {
    to: usize,
    contrast: f64,
}

/// Corners by their place in the largest grid that they form.
pub(super) fn largest(picture: &Gray, corners: &[Vector2<f64>]) -> BTreeMap<Place, usize> {
    let edges = edges(picture, corners);
    let mut taken = vec![false; corners.len()];
    let mut best = BTreeMap::new();
    for seed in 0..corners.len() {
        if taken[seed] || edges[seed].len() < 2 {
            continue;
        }
        let grid = Walk::from(seed, corners, &edges).map(Walk::finish).unwrap_or_default();
        for index in grid.values() {
            taken[*index] = true;
        }
        if grid.len() > best.len() {
            best = grid;
        }
    }
    best
}

fn edges(picture: &Gray, corners: &[Vector2<f64>]) -> Vec<Vec<Edge>> {
    let all: Vec<Vec<Edge>> = (0..corners.len())
        .map(|from| {
            let near = nearest(corners, from).into_iter();
            near.filter_map(|to| {
                Some(Edge { to, contrast: edge::contrast(picture, &corners[from], &corners[to])? })
            })
            .collect()
        })
        .collect();
    let mut sizes: Vec<f64> = all.iter().flatten().map(|edge| edge.contrast.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let usual = sizes.get(3 * sizes.len() / 4).copied().unwrap_or(0.0);
    all.into_iter()
        .map(|edges| edges.into_iter().filter(|e| e.contrast.abs() > LEAST_CONTRAST * usual).collect())
        .collect()
}

fn nearest(corners: &[Vector2<f64>], from: usize) -> Vec<usize> {
    let mut others: Vec<(f64, usize)> = corners
        .iter()
        .enumerate()
        .filter(|(k, _)| *k != from)
        .map(|(k, corner)| ((corner - corners[from]).norm_squared(), k))
        .collect();
    let count = NEAREST.min(others.len());
    if count == 0 {
        return Vec::new();
    }
    others.select_nth_unstable_by(count - 1, |a, b| a.0.total_cmp(&b.0));
    others.truncate(count);
    others.into_iter().map(|(_, k)| k).collect()
}

/// A walk over the grid from corner to corner.
struct Walk<'a> {
    corners: &'a [Vector2<f64>],
    edges: &'a [Vec<Edge>],
    /// Corners reached so far, with the local steps of the grid as columns.
    reached: BTreeMap<usize, (Place, Matrix2<f64>)>,
    by_place: BTreeMap<Place, usize>,
    /// Contrast, with its sign, of an edge along the first direction from an even place.
    sign: f64,
}

impl<'a> Walk<'a> {
    /// Begins at a corner with edges in two directions, the second a right turn from the first.
    fn from(seed: usize, corners: &'a [Vector2<f64>], edges: &'a [Vec<Edge>]) -> Option<Self> {
        let first = edges[seed].first()?;
        let x = corners[first.to] - corners[seed];
        // The next direction has the other contrast; of its two sides the one that turns from u to v.
        let second = edges[seed].iter().find_map(|edge| {
            let y = corners[edge.to] - corners[seed];
            let sine = (x.x * y.y - x.y * y.x) / (x.norm() * y.norm());
            (sine.abs() > 0.3 && edge.contrast * first.contrast < 0.0).then_some(y * sine.signum())
        })?;
        let steps = Matrix2::from_columns(&[x, second]);
        Some(Self {
            corners,
            edges,
            reached: BTreeMap::from([(seed, ((0, 0), steps))]),
            by_place: BTreeMap::from([((0, 0), seed)]),
            sign: first.contrast.signum(),
        })
    }

    fn finish(mut self) -> BTreeMap<Place, usize> {
        let mut waiting: VecDeque<usize> = self.reached.keys().copied().collect();
        while let Some(from) = waiting.pop_front() {
            for edge in &self.edges[from] {
                if self.reach(from, edge) {
                    waiting.push_back(edge.to);
                }
            }
        }
        self.by_place
    }

    /// Follows an edge; true if it leads to a corner that was not reached before.
    fn reach(&mut self, from: usize, edge: &Edge) -> bool {
        let Some(&(place, steps)) = self.reached.get(&from) else { return false };
        let along = self.corners[edge.to] - self.corners[from];
        let Some(local) = steps.try_inverse().map(|inverse| inverse * along) else { return false };
        let rounded = local.map(f64::round);
        let is_step = rounded.abs().sum() == 1.0 && (local - rounded).norm() < TOLERANCE;
        let (dx, dy) = (rounded.x as i32, rounded.y as i32);
        if !is_step || edge.contrast.signum() != self.expected_sign(place, (dx, dy)) {
            return false;
        }
        let there = (place.0 + dx, place.1 + dy);
        if self.reached.contains_key(&edge.to) || self.by_place.contains_key(&there) {
            return false;
        }
        // Perspective changes the steps slowly: the one that was taken is measured anew.
        let mut updated = steps;
        let axis = usize::from(dx == 0);
        updated.set_column(axis, &(along * f64::from(dx + dy)));
        self.reached.insert(edge.to, (there, updated));
        self.by_place.insert(there, edge.to);
        true
    }

    /// Sign of the contrast of the edges that leave a place. Of the four squares around it two opposite ones are
    /// bright. So the two edges of one direction have one sign, and those of the other direction the other. From each
    /// place to the next the squares swap.
    fn expected_sign(&self, (i, j): Place, (dx, _): Place) -> f64 {
        let first_direction = dx != 0;
        let even = (i + j).rem_euclid(2) == 0;
        if first_direction == even { self.sign } else { -self.sign }
    }
}
