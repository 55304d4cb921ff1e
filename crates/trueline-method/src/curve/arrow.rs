//! Symmetric equations that are banded except for a few unknowns: control points of a spline, and unknowns shared by all
//! readings.
//!
//! ```text
//! ⎡ band   Bᵀ ⎤   band: the control points of an open spline, 2 · reach − 1 wide for readings of which each depends on `reach` neighbours
//! ⎣ B      A  ⎦   border: of a closed one the last reach − 1 control points; place and plates; the seven of clock and hand-eye
//! ```

use nalgebra::{DMatrix, DVector, SMatrix};

/// Unknowns of clock and hand-eye: t_d, φ, t.
pub(crate) const SHARED: usize = 7;
/// Control points that a point of a cubic spline depends on.
pub(crate) const CUBIC: usize = 4;

/// The equations M x = g.
#[derive(Clone, Debug)]
pub(crate) struct Arrow {
    /// Lower band, row by row: entry (i, i − d) at `i * (half_width + 1) + d`.
    band: Vec<f64>,
    half_width: usize,
    /// Border by band.
    border: DMatrix<f64>,
    /// Border by border.
    corner: DMatrix<f64>,
    /// Right side.
    pub gradient: DVector<f64>,
    banded: usize,
}

/// Their triangular root.
#[derive(Clone, Debug)]
pub(crate) struct ArrowRoot {
    band: Vec<f64>,
    half_width: usize,
    /// L⁻¹ Bᵀ, banded × border.
    followed: DMatrix<f64>,
    corner: DMatrix<f64>,
    banded: usize,
}

impl Arrow {
    /// Zero equations of a spline with `of_curve` unknowns of its form and `beside` others between these and the shared ones. A reading depends
    /// on at most `reach` neighbouring control points.
    #[must_use]
    pub(crate) fn new((of_curve, closed): (usize, bool), reach: usize, beside: usize) -> Self {
        let banded = if closed { of_curve.saturating_sub(2 * (reach - 1)) } else { of_curve };
        let (half_width, border) = (2 * reach - 1, of_curve - banded + beside + SHARED);
        Self {
            band: vec![0.0; banded * (half_width + 1)],
            half_width,
            border: DMatrix::zeros(border, banded),
            corner: DMatrix::zeros(border, border),
            gradient: DVector::zeros(of_curve + beside + SHARED),
            banded,
        }
    }

    /// Number of unknowns.
    #[must_use]
    pub(crate) fn size(&self) -> usize {
        self.gradient.len()
    }

    /// Index of the first shared unknown.
    #[must_use]
    pub(crate) fn shared(&self) -> usize {
        self.size() - SHARED
    }

    /// Adds to the entries (i, j) and (j, i).
    #[inline]
    pub(crate) fn add(&mut self, i: usize, j: usize, value: f64) {
        let (row, column) = if i >= j { (i, j) } else { (j, i) };
        if row < self.banded {
            self.band[row * (self.half_width + 1) + (row - column)] += value;
        } else if column < self.banded {
            self.border[(row - self.banded, column)] += value;
        } else {
            self.corner[(row - self.banded, column - self.banded)] += value;
            if row != column {
                self.corner[(column - self.banded, row - self.banded)] += value;
            }
        }
    }

    /// Adds a weighted row: its entries at these indices, and its measured value.
    #[inline]
    pub(crate) fn add_row(&mut self, entries: &[(usize, f64)], measured: f64, weight: f64) {
        for (k, (i, a)) in entries.iter().enumerate() {
            let weighted = weight * a;
            self.gradient[*i] += weighted * measured;
            for (j, b) in &entries[..=k] {
                self.add(*i, *j, weighted * b);
            }
        }
    }

    /// An entry.
    #[must_use]
    pub(crate) fn entry(&self, i: usize, j: usize) -> f64 {
        let (row, column) = if i >= j { (i, j) } else { (j, i) };
        if row >= self.banded {
            return if column < self.banded {
                self.border[(row - self.banded, column)]
            } else {
                self.corner[(row - self.banded, column - self.banded)]
            };
        }
        if row - column > self.half_width {
            0.0
        } else {
            self.band[row * (self.half_width + 1) + (row - column)]
        }
    }

    /// The sum of these and others times a factor.
    #[must_use]
    pub(crate) fn plus(&self, other: &Self, factor: f64) -> Self {
        let band = self.band.iter().zip(&other.band).map(|(a, b)| a + factor * b).collect();
        Self {
            band,
            half_width: self.half_width,
            border: &self.border + &other.border * factor,
            corner: &self.corner + &other.corner * factor,
            gradient: &self.gradient + &other.gradient * factor,
            banded: self.banded,
        }
    }

    /// The same with all diagonal entries times 1 + `damping`.
    #[must_use]
    pub(crate) fn damped(&self, damping: f64) -> Self {
        let mut damped = self.clone();
        for k in 0..self.size() {
            damped.add(k, k, damping * self.entry(k, k));
        }
        damped
    }

    /// M x.
    #[cfg(test)]
    #[must_use]
    pub(crate) fn times(&self, x: &DVector<f64>) -> DVector<f64> {
        let (banded, border) = (self.banded, self.border.nrows());
        let mut product = DVector::zeros(self.size());
        for i in 0..banded {
            for d in 0..=self.half_width.min(i) {
                let value = self.band[i * (self.half_width + 1) + d];
                product[i] += value * x[i - d];
                if d > 0 {
                    product[i - d] += value * x[i];
                }
            }
        }
        let (of_band, of_border) = (x.rows(0, banded), x.rows(banded, border));
        let back = self.border.tr_mul(&of_border);
        let (mut upper, mut lower) = product.rows_range_pair_mut(0..banded, banded..);
        upper += back;
        lower += &self.border * of_band + &self.corner * of_border;
        product
    }

    /// The root; `None` where they are not positive definite.
    #[must_use]
    pub(crate) fn root(&self) -> Option<ArrowRoot> {
        let (banded, half_width) = (self.banded, self.half_width);
        let (width, mut band) = (half_width + 1, self.band.clone());
        for i in 0..banded {
            let least = i.saturating_sub(half_width);
            for j in least..=i {
                let mut sum = band[i * width + (i - j)];
                for k in least.max(j.saturating_sub(half_width))..j {
                    sum -= band[i * width + (i - k)] * band[j * width + (j - k)];
                }
                band[i * width + (i - j)] = if i == j {
                    // NaN fails this comparison.
                    if !(sum > 0.0 && sum.is_finite()) {
                        return None;
                    }
                    sum.sqrt()
                } else {
                    sum / band[j * width]
                };
            }
        }
        let (followed, corner) = (self.border.transpose(), DMatrix::zeros(0, 0));
        let mut root = ArrowRoot { band, half_width, followed, corner, banded };
        let mut followed = std::mem::replace(&mut root.followed, DMatrix::zeros(0, 0));
        for mut column in followed.column_iter_mut() {
            root.forward(column.as_mut_slice());
        }
        let left = &self.corner - followed.tr_mul(&followed);
        root.corner = left.cholesky()?.unpack();
        root.followed = followed;
        Some(root)
    }
}

impl ArrowRoot {
    /// L⁻¹ of the band, in place.
    fn forward(&self, x: &mut [f64]) {
        let width = self.half_width + 1;
        for i in 0..self.banded {
            let mut sum = x[i];
            for d in 1..=self.half_width.min(i) {
                sum -= self.band[i * width + d] * x[i - d];
            }
            x[i] = sum / self.band[i * width];
        }
    }

    /// L⁻ᵀ of the band, in place.
    fn backward(&self, x: &mut [f64]) {
        let width = self.half_width + 1;
        for i in (0..self.banded).rev() {
            x[i] /= self.band[i * width];
            for d in 1..=self.half_width.min(i) {
                x[i - d] -= self.band[i * width + d] * x[i];
            }
        }
    }

    /// M⁻¹ g.
    #[must_use]
    pub(crate) fn solve(&self, right: &DVector<f64>) -> DVector<f64> {
        let border = self.corner.nrows();
        let mut x = right.clone();
        self.forward(&mut x.as_mut_slice()[..self.banded]);
        let mut last = x.rows(self.banded, border) - self.followed.tr_mul(&x.rows(0, self.banded));
        self.corner.solve_lower_triangular_mut(&mut last);
        self.corner.tr_solve_lower_triangular_mut(&mut last);
        let mut first = x.rows(0, self.banded) - &self.followed * &last;
        self.backward(first.as_mut_slice());
        x.rows_mut(0, self.banded).copy_from(&first);
        x.rows_mut(self.banded, border).copy_from(&last);
        x
    }

    /// log |H| of the curve alone, with its place.
    #[must_use]
    pub(crate) fn log_det_curve(&self) -> f64 {
        let width = self.half_width + 1;
        let of_band: f64 = (0..self.banded).map(|i| self.band[i * width].ln()).sum();
        let wrapped = self.corner.nrows() - SHARED;
        2.0 * (of_band + (0..wrapped).map(|k| self.corner[(k, k)].ln()).sum::<f64>())
    }

    /// log |S| of the shared unknowns, with the curve eliminated.
    #[must_use]
    pub(crate) fn log_det_shared(&self) -> f64 {
        let wrapped = self.corner.nrows() - SHARED;
        2.0 * (wrapped..self.corner.nrows()).map(|k| self.corner[(k, k)].ln()).sum::<f64>()
    }

    /// S = A − B H⁻¹ Bᵀ: the information on the shared unknowns, with the curve eliminated.
    #[must_use]
    pub(crate) fn shared_information(&self) -> SMatrix<f64, SHARED, SHARED> {
        let wrapped = self.corner.nrows() - SHARED;
        let root: SMatrix<f64, SHARED, SHARED> =
            self.corner.fixed_view::<SHARED, SHARED>(wrapped, wrapped).into();
        root * root.transpose()
    }

    /// M⁻¹.
    #[must_use]
    pub(crate) fn inverse(&self) -> DMatrix<f64> {
        let size = self.banded + self.corner.nrows();
        let mut inverse = DMatrix::zeros(size, size);
        let mut unit = DVector::zeros(size);
        for k in 0..size {
            unit[k] = 1.0;
            inverse.set_column(k, &self.solve(&unit));
            unit[k] = 0.0;
        }
        inverse
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    /// Equations of rows like a spline's, compared with the full matrix.
    fn both(closed: bool, reach: usize) -> (Arrow, DMatrix<f64>) {
        let (points, of_curve) = (11, 22);
        let mut arrow = Arrow::new((of_curve, closed), reach, 0);
        let mut full = DMatrix::zeros(of_curve + SHARED, of_curve + SHARED);
        let mut seed = 1_u64;
        let mut next = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 40) as f64 / f64::from(1 << 24) - 0.5
        };
        for row in 0..80 {
            let first = row % if closed { points } else { points + 1 - reach };
            let curve = (0..2 * reach).map(|k| 2 * ((first + k / 2) % points) + k % 2);
            let entries: Vec<(usize, f64)> =
                curve.chain(of_curve..of_curve + SHARED).map(|at| (at, next())).collect();
            arrow.add_row(&entries, next(), 2.0);
            for (i, a) in &entries {
                for (j, b) in &entries {
                    full[(*i, *j)] += 2.0 * a * b;
                }
            }
        }
        (arrow, full)
    }

    #[test]
    fn it_is_the_full_matrix_solved() {
        for (closed, reach) in [(false, CUBIC), (true, CUBIC), (false, 6), (true, 6)] {
            let (arrow, full) = both(closed, reach);
            let root = arrow.root().unwrap();
            // 29 unknowns of a condition below 1e4.
            let x = root.solve(&arrow.gradient);
            assert!((&full * &x - &arrow.gradient).norm() < 1e-9);
            assert!((arrow.times(&x) - &arrow.gradient).norm() < 1e-9);
            let inverse = full.clone().try_inverse().unwrap();
            assert!((root.inverse() - &inverse).norm() < 1e-8 * inverse.norm());
            let shared = inverse.view((22, 22), (7, 7)).clone_owned().try_inverse().unwrap();
            let own = DMatrix::from_column_slice(7, 7, root.shared_information().as_slice());
            assert!((own - &shared).norm() < 1e-9 * shared.norm());
            let curve = full.view((0, 0), (22, 22)).clone_owned().cholesky().unwrap();
            let log_det = 2.0 * curve.l().diagonal().map(f64::ln).sum();
            assert!((root.log_det_curve() - log_det).abs() < 1e-9);
            let all = 2.0 * full.clone().cholesky().unwrap().l().diagonal().map(f64::ln).sum();
            assert!((root.log_det_curve() + root.log_det_shared() - all).abs() < 1e-9);
            assert!((arrow.entry(3, 2) - full[(3, 2)]).abs() < 1e-12);
        }
    }
}
