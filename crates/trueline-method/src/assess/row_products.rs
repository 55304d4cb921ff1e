//! Sums of the products of all pairs of numbers in a row, over many rows: Σ row rowᵀ.

use nalgebra::DMatrix;

/// Rows that are gathered before their products are taken: a block stays in the nearest cache.
const BLOCK: usize = 64;

/// Σ row rowᵀ of the rows so far.
pub struct RowProducts {
    /// One row a column.
    block: DMatrix<f64>,
    filled: usize,
    sums: DMatrix<f64>,
}

impl RowProducts {
    /// Of rows of so many numbers.
    #[must_use]
    pub fn new(width: usize) -> Self {
        Self { block: DMatrix::zeros(width, BLOCK), filled: 0, sums: DMatrix::zeros(width, width) }
    }

    /// Numbers of the next row, to be written: they are those of an earlier row, or zero.
    pub fn next_row(&mut self) -> &mut [f64] {
        if self.filled == BLOCK {
            self.add_block();
        }
        self.filled += 1;
        let width = self.block.nrows();
        &mut self.block.as_mut_slice()[(self.filled - 1) * width..self.filled * width]
    }

    /// The row that was written last.
    ///
    /// # Panics
    /// If there is none.
    #[must_use]
    pub fn last_row(&self) -> &[f64] {
        let width = self.block.nrows();
        &self.block.as_slice()[(self.filled - 1) * width..self.filled * width]
    }

    fn add_block(&mut self) {
        let filled = self.block.columns(0, self.filled);
        self.sums.gemm(1.0, &filled, &filled.transpose(), 1.0);
        self.filled = 0;
    }

    /// The sums over all rows.
    #[must_use]
    pub fn sums(mut self) -> DMatrix<f64> {
        self.add_block();
        self.sums
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_of_more_rows_than_a_block_are_those_of_a_plain_loop() {
        let rows: Vec<[f64; 3]> = (0..150).map(|k| [1.0, f64::from(k).sin(), f64::from(k).cos()]).collect();
        let mut products = RowProducts::new(3);
        for row in &rows {
            products.next_row().copy_from_slice(row);
            assert_eq!(products.last_row(), row);
        }
        let sums = products.sums();
        for (i, j) in [(0, 0), (0, 1), (1, 2), (2, 0), (2, 2)] {
            let plain: f64 = rows.iter().map(|row| row[i] * row[j]).sum();
            // 150 products of at most one.
            assert!((sums[(i, j)] - plain).abs() < 1e-12);
        }
    }
}
