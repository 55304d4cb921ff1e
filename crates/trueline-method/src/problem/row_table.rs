//! A table of rows that are converted to the coordinates of a covariance's root together.

use nalgebra::{DMatrix, DMatrixView, DVectorView};

/// Rows converted together, so that a block stays in the nearest cache.
const BLOCK: usize = 64;

/// Rows of equal length.
pub(crate) struct RowTable {
    width: usize,
    values: Vec<f64>,
}

impl RowTable {
    /// An empty table of rows of a given length.
    #[must_use]
    pub(crate) fn new(width: usize) -> Self {
        Self { width, values: Vec::new() }
    }

    /// Adds a row of zeros.
    pub(crate) fn push(&mut self) -> &mut [f64] {
        let end = self.values.len();
        self.values.resize(end + self.width, 0.0);
        &mut self.values[end..]
    }

    /// The last row. Empty without rows.
    pub(crate) fn last(&mut self) -> &mut [f64] {
        let start = self.values.len().saturating_sub(self.width);
        &mut self.values[start..]
    }

    /// Replaces each row r by rootᵀ r in place. A root has no more columns than rows.
    #[must_use]
    pub(crate) fn in_root(mut self, root: &DMatrix<f64>) -> Self {
        let (before, after) = (self.width, root.ncols());
        debug_assert!(root.nrows() == before && after <= before, "the root of these unknowns");
        let rows = self.len();
        let root_rows = root.transpose();
        let mut carried = DMatrix::zeros(after, BLOCK);
        for first in (0..rows).step_by(BLOCK) {
            let count = BLOCK.min(rows - first);
            let block = DMatrixView::from_slice(&self.values[first * before..], before, count);
            carried.columns_mut(0, count).gemm(1.0, &root_rows, &block, 0.0);
            self.values[first * after..(first + count) * after]
                .copy_from_slice(&carried.as_slice()[..count * after]);
        }
        self.values.truncate(rows * after);
        Self { width: after, values: self.values }
    }

    /// A row.
    pub(crate) fn of(&self, row: usize) -> DVectorView<'_, f64> {
        DVectorView::from_slice(&self.values[row * self.width..], self.width)
    }

    /// All of them.
    pub(crate) fn iter(&self) -> impl Iterator<Item = DVectorView<'_, f64>> {
        (0..self.len()).map(|row| self.of(row))
    }

    /// Their number.
    pub(crate) fn len(&self) -> usize {
        self.values.len() / self.width.max(1)
    }

    /// Numbers of each.
    pub(crate) fn width(&self) -> usize {
        self.width
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DVector;

    #[test]
    fn rows_of_several_blocks_are_carried_as_one_by_one() {
        let root = DMatrix::from_fn(3, 2, |i, j| (i as f64 - 0.7 * j as f64).cos());
        let row = |k: usize| [0, 1, 2].map(|i: usize| ((3 * k + i) as f64).sin());
        let mut table = RowTable::new(3);
        assert!(table.last().is_empty());
        for k in 0..150 {
            table.push().copy_from_slice(&row(k));
            assert_eq!(table.last(), row(k));
        }
        let carried = table.in_root(&root);
        assert_eq!((carried.len(), carried.width()), (150, 2));
        for (k, found) in carried.iter().enumerate() {
            let plain = root.transpose() * DVector::from_row_slice(&row(k));
            // Sums of three products of at most one.
            assert!((found - plain).amax() < 1e-15, "{k}");
        }
    }
}
