//! Rows of a reading: two coordinates of a seam point, or two support points on each of two plates.

use nalgebra::{Const, Dyn, OMatrix, SMatrix, SVector};

/// Rows of a reading at most. Unused ones are zero.
pub(crate) const ROWS: usize = 4;
/// A number for each row.
pub(crate) type Rows = SVector<f64, ROWS>;
/// Displacement of the rows by errors, a column each.
pub(crate) type Moved = OMatrix<f64, Const<ROWS>, Dyn>;
/// W with W Σ Wᵀ = 1 for the rows of a reading.
pub(crate) type Whitener = SMatrix<f64, ROWS, ROWS>;

/// The root of a covariance of the first `rows`; `None` if it is not positive definite.
#[must_use]
pub(crate) fn whitener(covariance: &Whitener, rows: usize) -> Option<Whitener> {
    let mut padded = *covariance;
    for unused in rows..ROWS {
        padded[(unused, unused)] = 1.0;
    }
    let root = padded.cholesky()?.l().solve_lower_triangular(&Whitener::identity())?;
    let mut whitener = Whitener::zeros();
    whitener.view_mut((0, 0), (rows, rows)).copy_from(&root.view((0, 0), (rows, rows)));
    Some(whitener)
}
