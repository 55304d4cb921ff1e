//! Sums of the products of all pairs of numbers in a row, over many rows: Σ row rowᵀ.

use nalgebra::DMatrix;

/// Rows gathered before their products are taken, so that a block stays in the nearest cache.
const BLOCK: usize = 64;
/// Numbers that the processor multiplies at once. Rows are padded with zeros to a multiple of it.
const WIDTH: usize = 4;

/// Σ row rowᵀ of the rows so far.
pub struct RowProducts {
    width: usize,
    /// Distance between rows.
    stride: usize,
    rows: Vec<f64>,
    filled: usize,
    /// Products of each number of a row with those from the start of its own group of four on, row by row.
    sums: Vec<f64>,
}

impl RowProducts {
    /// For rows of a given length.
    #[must_use]
    pub fn new(width: usize) -> Self {
        let stride = width.next_multiple_of(WIDTH);
        Self { width, stride, rows: vec![0.0; stride * BLOCK], filled: 0, sums: vec![0.0; stride * stride] }
    }

    /// Storage of the next row. It contains an earlier row, or zeros.
    pub fn next_row(&mut self) -> &mut [f64] {
        if self.filled == BLOCK {
            self.add_block();
        }
        self.filled += 1;
        let first = (self.filled - 1) * self.stride;
        &mut self.rows[first..first + self.width]
    }

    /// The row that was written last.
    ///
    /// # Panics
    /// If there is none.
    #[must_use]
    pub fn last_row(&self) -> &[f64] {
        let first = (self.filled - 1) * self.stride;
        &self.rows[first..first + self.width]
    }

    fn add_block(&mut self) {
        add_products(&mut self.sums, &self.rows[..self.filled * self.stride], self.stride);
        self.filled = 0;
    }

    /// The sums over all rows.
    #[must_use]
    pub fn sums(mut self) -> DMatrix<f64> {
        self.add_block();
        let sum = |row: usize, column: usize| self.sums[row.min(column) * self.stride + row.max(column)];
        DMatrix::from_fn(self.width, self.width, sum)
    }
}

/// Adds the products of some rows with the widest instructions that the processor has.
fn add_products(sums: &mut [f64], rows: &[f64], stride: usize) {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma") {
        // SAFETY: the function requires AVX2 and FMA, and the processor was just tested for both.
        #[expect(unsafe_code, reason = "the only way to call a function for a processor found at run time")]
        unsafe {
            add_products_avx2(sums, rows, stride);
        }
        return;
    }
    add_products_with(sums, rows, stride, |sum, a, b| sum + a * b);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn add_products_avx2(sums: &mut [f64], rows: &[f64], stride: usize) {
    add_products_with(sums, rows, stride, |sum, a, b| a.mul_add(b, sum));
}

#[inline(always)]
#[allow(clippy::inline_always, reason = "only what is inlined is compiled for the wide instructions")]
fn add_products_with(
    sums: &mut [f64],
    rows: &[f64],
    stride: usize,
    plus_product: impl Fn(f64, f64, f64) -> f64 + Copy,
) {
    for row in (0..stride).step_by(WIDTH) {
        let mut column = row;
        while column + 2 * WIDTH <= stride {
            add_tile::<{ 2 * WIDTH }>(sums, rows, (stride, row, column), plus_product);
            column += 2 * WIDTH;
        }
        if column < stride {
            add_tile::<WIDTH>(sums, rows, (stride, row, column), plus_product);
        }
    }
}

/// Adds a tile of the products: those of a group of four numbers with some columns. The tile stays in registers over all rows.
#[inline(always)]
#[allow(clippy::inline_always, reason = "only what is inlined is compiled for the wide instructions")]
fn add_tile<const COLUMNS: usize>(
    sums: &mut [f64],
    rows: &[f64],
    (stride, row, column): (usize, usize, usize),
    plus_product: impl Fn(f64, f64, f64) -> f64 + Copy,
) {
    let mut tile = [[0.0; COLUMNS]; WIDTH];
    for numbers in rows.chunks_exact(stride) {
        let (of_group, of_columns) = (&numbers[row..row + WIDTH], &numbers[column..column + COLUMNS]);
        for (sums, own) in tile.iter_mut().zip(of_group) {
            for (sum, other) in sums.iter_mut().zip(of_columns) {
                *sum = plus_product(*sum, *own, *other);
            }
        }
    }
    for (k, of_tile) in tile.iter().enumerate() {
        let first = (row + k) * stride + column;
        sums[first..first + COLUMNS].iter_mut().zip(of_tile).for_each(|(sum, products)| *sum += products);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of every width beside a multiple of four, more of them than a block and than a few blocks.
    #[test]
    fn products_of_more_rows_than_a_block_are_those_of_a_plain_loop() {
        for (width, count) in [(1, 1), (3, 150), (4, 64), (5, 65), (19, 331)] {
            let value = |k: usize, i: usize| (k as f64 * (1.0 + i as f64 * 0.37)).sin();
            let rows: Vec<Vec<f64>> = (0..count).map(|k| (0..width).map(|i| value(k, i)).collect()).collect();
            let mut products = RowProducts::new(width);
            for row in &rows {
                products.next_row().copy_from_slice(row);
                assert_eq!(products.last_row(), row);
            }
            let sums = products.sums();
            assert_eq!(sums.shape(), (width, width));
            for i in 0..width {
                for j in 0..width {
                    let plain: f64 = rows.iter().map(|row| row[i] * row[j]).sum();
                    // Some hundred products of at most one.
                    assert!((sums[(i, j)] - plain).abs() < 1e-12, "{width} {i} {j}");
                }
            }
        }
    }

    /// Both kinds of processors.
    #[test]
    fn plain_products_are_those_of_wide_instructions() {
        let rows: Vec<f64> = (0..8 * 64).map(|k| f64::from(k).sin()).collect();
        let [mut plain, mut wide] = [0, 1].map(|_| vec![0.0; 64]);
        add_products_with(&mut plain, &rows, 8, |sum, a, b| sum + a * b);
        add_products(&mut wide, &rows, 8);
        // 64 products of at most one, rounded once or twice.
        assert!(plain.iter().zip(&wide).all(|(a, b)| (a - b).abs() < 1e-13));
    }
}
