//! The residuals of a frame in blocks: two rows for each plate (or for the seam point), one for the edge point.
//!
//! A block of one row is stored as two rows. Its second row has zero own variance, and 1 on the diagonal of a covariance.

use crate::stripe::frame_residual::ROWS;
use nalgebra::{Matrix2, SMatrix, SVector, Vector2};
use std::ops::Range;

/// Plate 0 or the seam point, plate 1, the edge point.
pub(crate) const BLOCKS: usize = 3;

/// The rows of a block.
#[must_use]
pub(crate) fn rows_of(block: usize) -> Range<usize> {
    2 * block..(2 * block + 2).min(ROWS)
}

/// Its diagonal block of a covariance.
#[must_use]
pub(crate) fn block(covariance: &SMatrix<f64, ROWS, ROWS>, number: usize) -> Matrix2<f64> {
    let rows = rows_of(number);
    let at = |i: usize, j: usize| covariance[(rows.start + i, rows.start + j)];
    match rows.len() {
        1 => Matrix2::new(at(0, 0), 0.0, 0.0, 1.0),
        _ => Matrix2::new(at(0, 0), at(0, 1), at(1, 0), at(1, 1)),
    }
}

/// Adds to that block.
pub(crate) fn add_to_block(covariance: &mut SMatrix<f64, ROWS, ROWS>, number: usize, own: &Matrix2<f64>) {
    let rows = rows_of(number);
    for i in rows.clone() {
        for j in rows.clone() {
            covariance[(i, j)] += own[(i - rows.start, j - rows.start)];
        }
    }
}

/// Its residuals.
#[must_use]
pub(crate) fn pair_of_block(residual: &SVector<f64, ROWS>, number: usize) -> Vector2<f64> {
    let first = rows_of(number).start;
    Vector2::new(residual[first], residual.get(first + 1).copied().unwrap_or(0.0))
}
