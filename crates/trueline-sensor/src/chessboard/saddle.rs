//! A corner to a fraction of a pixel.
//!
//! Around a corner every gradient is square to the line that leads from the corner to its pixel: the corner is
//! where Σ w (g·(p − c))² is least, which is linear in c \[Foerstner1987\]. Weights fall off from the middle, so the
//! window is moved along until it sits on the corner.

use crate::gray::Gray;
use nalgebra::{Matrix2, Vector2};

/// A window that has not converged after this many moves is on no corner.
const MOST_MOVES: usize = 40;

/// A window that moves less than this has settled, px.
const SETTLED_PX: f64 = 1e-3;

/// The corner near `start`, seen through a window that reaches `reach` pixels from its middle. `None` if there is
/// none, or if the window leaves the picture.
pub(super) fn refine(picture: &Gray, start: &Vector2<f64>, reach: i32) -> Option<Vector2<f64>> {
    let mut corner = *start;
    for _ in 0..MOST_MOVES {
        let moved = step(picture, &corner, reach)?;
        if (moved - start).norm() > f64::from(reach) {
            return None;
        }
        let shift = (moved - corner).norm();
        corner = moved;
        if shift < SETTLED_PX {
            return Some(corner);
        }
    }
    None
}

fn step(picture: &Gray, corner: &Vector2<f64>, reach: i32) -> Option<Vector2<f64>> {
    let (mut matrix, mut right) = (Matrix2::zeros(), Vector2::zeros());
    let size = (2 * reach + 3) as usize;
    let mut patch = Vec::with_capacity(size * size);
    for dy in -reach - 1..=reach + 1 {
        for dx in -reach - 1..=reach + 1 {
            patch.push(picture.between(&(corner + Vector2::new(f64::from(dx), f64::from(dy))))?);
        }
    }
    let width = f64::from(reach);
    for y in 1..size - 1 {
        for x in 1..size - 1 {
            let gradient = Vector2::new(
                patch[y * size + x + 1] - patch[y * size + x - 1],
                patch[(y + 1) * size + x] - patch[(y - 1) * size + x],
            ) * 0.5;
            let at = Vector2::new(x as f64 - width - 1.0, y as f64 - width - 1.0);
            let weight = (-at.norm_squared() / (width * width)).exp();
            let outer = gradient * gradient.transpose() * weight;
            matrix += outer;
            right += outer * at;
        }
    }
    // Along an edge the gradients have one direction only: the smaller eigenvalue is then that of noise.
    let trace = matrix.trace();
    if !(trace > 0.0 && matrix.determinant() > 1e-4 * trace * trace) {
        return None;
    }
    Some(corner + matrix.try_inverse()? * right)
}
