//! Sums of the products of all pairs of numbers in a row, over many rows: Σ row rowᵀ.

use nalgebra::DMatrix;

/// Rows gathered before their products are taken, so that a block stays in the nearest cache.
const BLOCK: usize = 64;
/// Numbers that the processor multiplies at once. Rows are padded with zeros to a multiple of it.
const WIDTH: usize = 4;
/// Rows whose products are added to a sum before it is written back.
const TOGETHER: usize = 4;

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
        // A row of zeros adds nothing.
        let used = self.filled.next_multiple_of(TOGETHER);
        self.rows[self.filled * self.stride..used * self.stride].fill(0.0);
        add_products(&mut self.sums, &self.rows[..used * self.stride], self.stride);
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

/// Adds the products of some rows, a multiple of [`TOGETHER`], with the widest instructions that the processor has.
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
    for rows in rows.chunks_exact(TOGETHER * stride) {
        let (first, rest) = rows.split_at(stride);
        let (second, rest) = rest.split_at(stride);
        let (third, fourth) = rest.split_at(stride);
        for (row, sums) in sums.chunks_exact_mut(stride).enumerate() {
            let [a, b, c, d] = [first[row], second[row], third[row], fourth[row]];
            // From the four that the number itself is in.
            let from = row / WIDTH * WIDTH;
            let of_rows =
                first[from..].iter().zip(&second[from..]).zip(third[from..].iter().zip(&fourth[from..]));
            for (sum, ((p, q), (r, s))) in sums[from..].iter_mut().zip(of_rows) {
                *sum =
                    plus_product(plus_product(plus_product(plus_product(*sum, a, *p), b, *q), c, *r), d, *s);
            }
        }
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
