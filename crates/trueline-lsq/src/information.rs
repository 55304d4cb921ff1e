//! Information of the data on each unknown: rank, null directions, covariance.
//!
//! H = JᵀJ of the whitened residuals is the information. Its columns are scaled to unit length first, to make
//! a metre and a radian comparable. The singular values of the scaled J are then between 0 and √n. A
//! direction below a stated part of the largest one counts as unseen.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use std::ops::Range;

/// The spectrum of a scaled information matrix.
#[derive(Clone, Debug)]
pub struct Information {
    free: Vec<usize>,
    dimension: usize,
    scale: DVector<f64>,
    singular_values: DVector<f64>,
    composition: Vec<Vec<usize>>,
    root: DMatrix<f64>,
    null: DMatrix<f64>,
    known: usize,
}

impl Information {
    /// Analyses `hessian` over the unknowns not in `fixed`. A direction is observable if its scaled singular value exceeds `threshold` times the
    /// largest.
    ///
    /// Returns `None` if the matrix is not finite or the decomposition fails.
    #[must_use]
    pub fn new(hessian: &DMatrix<f64>, fixed: &[usize], threshold: f64) -> Option<Self> {
        if !hessian.iter().all(|x| x.is_finite()) {
            return None;
        }
        let free = (0..hessian.nrows()).filter(|k| !fixed.contains(k)).collect();
        Self::over(hessian, free, threshold)
    }

    /// The same with prior information on some unknowns, which are therefore determined in any case: the others
    /// follow. Rank, singular values and null directions of the others use the information left to them, H_xx − H_xk
    /// H_kk⁻¹ H_kx. The covariance is of all.
    ///
    /// Returns `None` also if one of them has no prior information after all.
    #[must_use]
    pub fn beside(
        hessian: &DMatrix<f64>,
        fixed: &[usize],
        known: Range<usize>,
        threshold: f64,
    ) -> Option<Self> {
        if known.is_empty() {
            return Self::new(hessian, fixed, threshold);
        }
        if !hessian.iter().all(|x| x.is_finite()) {
            return None;
        }
        let (first, count) = (known.start, known.len());
        let own = hessian.view((first, first), (count, count)).clone_owned().cholesky()?;
        let followed = own.solve(&hessian.rows(first, count).clone_owned());
        let left = hessian - hessian.columns(first, count) * &followed;
        let free = (0..hessian.nrows()).filter(|k| !fixed.contains(k) && !known.contains(k)).collect();
        let mut of_others = Self::over(&left, free, threshold)?;
        let following = -followed * &of_others.root;
        of_others.root.rows_mut(first, count).copy_from(&following);
        let rank = of_others.root.ncols();
        let mut root = of_others.root.resize_horizontally(rank + count, 0.0);
        let inverse = own.l().solve_lower_triangular(&DMatrix::identity(count, count))?;
        root.view_mut((first, rank), (count, count)).copy_from(&inverse.transpose());
        Some(Self { root, known: count, ..of_others })
    }

    fn over(hessian: &DMatrix<f64>, free: Vec<usize>, threshold: f64) -> Option<Self> {
        let dimension = hessian.nrows();
        let largest = free.iter().map(|&k| hessian[(k, k)]).fold(0.0, f64::max);
        // A column that is empty to rounding is left unscaled: it is itself a null direction.
        let scale = DVector::from_iterator(
            free.len(),
            free.iter().map(|&k| {
                let d = hessian[(k, k)];
                if d > largest * 1e-30 { 1.0 / d.sqrt() } else { 1.0 }
            }),
        );
        let scaled = DMatrix::from_fn(free.len(), free.len(), |i, j| {
            hessian[(free[i], free[j])] * scale[i] * scale[j]
        });
        // An empty matrix has no decomposition, and no information.
        let eigen = if free.is_empty() {
            SymmetricEigen { eigenvectors: DMatrix::zeros(0, 0), eigenvalues: DVector::zeros(0) }
        } else {
            SymmetricEigen::try_new(scaled, f64::EPSILON, 10_000)?
        };
        let mut order: Vec<usize> = (0..free.len()).collect();
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        let eigenvectors = DMatrix::from_fn(free.len(), free.len(), |i, j| eigen.eigenvectors[(i, order[j])]);
        let singular_values =
            DVector::from_iterator(free.len(), order.iter().map(|&k| eigen.eigenvalues[k].max(0.0).sqrt()));
        let largest = singular_values.iter().next().copied().unwrap_or(0.0);
        let rank = singular_values.iter().filter(|s| **s > threshold * largest).count();
        let mut root = DMatrix::zeros(dimension, rank);
        let mut null = DMatrix::zeros(dimension, free.len() - rank);
        for (row, &unknown) in free.iter().enumerate() {
            for column in 0..rank {
                root[(unknown, column)] = eigenvectors[(row, column)] * scale[row] / singular_values[column];
            }
            for column in rank..free.len() {
                null[(unknown, column - rank)] = eigenvectors[(row, column)];
            }
        }
        let composition = eigenvectors
            .column_iter()
            .map(|direction| strongest(direction.as_slice()).into_iter().map(|row| free[row]).collect())
            .collect();
        Some(Self { free, dimension, scale, singular_values, composition, root, null, known: 0 })
    }

    /// The same if only some directions count as seen: the columns of `kept` (orthonormal, in the coordinates
    /// of [`Information::covariance_root`]). Directions perpendicular to them become null directions.
    #[must_use]
    pub fn keeping(&self, kept: &DMatrix<f64>) -> Self {
        let unscaled = DVector::from_iterator(
            self.dimension,
            (0..self.dimension).map(|k| {
                self.free.iter().position(|free| *free == k).map_or(0.0, |row| 1.0 / self.scale[row])
            }),
        );
        let dropped = orthogonal_complement(kept);
        let steps = &self.root * &dropped;
        let mut null = self.null.clone().resize_horizontally(self.null.ncols() + steps.ncols(), 0.0);
        for (k, step) in steps.column_iter().enumerate() {
            null.set_column(self.null.ncols() + k, &step.component_mul(&unscaled).normalize());
        }
        Self { root: &self.root * kept, null: null.qr().q(), ..self.clone() }
    }

    /// Number of estimated unknowns, including those with a prior.
    #[must_use]
    pub fn size(&self) -> usize {
        self.free.len() + self.known
    }

    /// Singular values of the scaled, whitened Jacobian, falling.
    #[must_use]
    pub fn singular_values(&self) -> &DVector<f64> {
        &self.singular_values
    }

    /// The unknowns in the direction of each singular value, the strongest first. Shares below a fifth are
    /// left out.
    #[must_use]
    pub fn composition(&self) -> &[Vec<usize>] {
        &self.composition
    }

    /// Number of determined directions, including those with a prior.
    #[must_use]
    pub fn rank(&self) -> usize {
        self.root.ncols()
    }

    /// Ratio of the largest to the smallest singular value. Infinite for a singular problem.
    #[must_use]
    pub fn condition(&self) -> f64 {
        let n = self.singular_values.len();
        if n == 0 { 1.0 } else { self.singular_values[0] / self.singular_values[n - 1] }
    }

    /// Null directions as unit vectors of the scaled unknowns, one column each. Rows are all unknowns, and zero for fixed ones.
    #[must_use]
    pub fn null_space(&self) -> &DMatrix<f64> {
        &self.null
    }

    /// Covariance on the observable directions (pseudo-inverse of H). Zero for fixed unknowns.
    #[must_use]
    pub fn covariance(&self) -> DMatrix<f64> {
        &self.root * self.root.transpose()
    }

    /// A root C½ of [`Information::covariance`], one column for each observable direction: C = C½ C½ᵀ and C½ᵀ H C½ = I.
    #[must_use]
    pub fn covariance_root(&self) -> &DMatrix<f64> {
        &self.root
    }
}

/// Indices of the components with at least a fifth of a unit direction's square, the strongest first.
fn strongest(direction: &[f64]) -> Vec<usize> {
    let mut places: Vec<usize> = (0..direction.len()).filter(|k| direction[*k].powi(2) >= 0.2).collect();
    places.sort_by(|a, b| direction[*b].abs().total_cmp(&direction[*a].abs()));
    places
}

/// Orthonormal columns orthogonal to the given orthonormal ones.
fn orthogonal_complement(columns: &DMatrix<f64>) -> DMatrix<f64> {
    let (size, count) = columns.shape();
    let projector = DMatrix::identity(size, size) - columns * columns.transpose();
    let eigen = projector.symmetric_eigen();
    let mut order: Vec<usize> = (0..size).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    DMatrix::from_fn(size, size - count, |i, j| eigen.eigenvectors[(i, order[j])])
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    #[test]
    fn each_direction_is_named_by_the_unknowns_that_carry_it() {
        // Unknowns 1 and 3 are correlated by 0.99, 2 is alone, 0 is held. The scaled eigenvalues are 1.99, 1 and 0.01.
        let mut hessian = DMatrix::identity(4, 4);
        (hessian[(1, 3)], hessian[(3, 1)]) = (0.99, 0.99);
        let information = Information::new(&hessian, &[0], 1e-9).unwrap();
        let sorted = |k: usize| {
            let mut unknowns = information.composition()[k].clone();
            unknowns.sort_unstable();
            unknowns
        };
        assert_eq!([sorted(0), sorted(1), sorted(2)], [vec![1, 3], vec![2], vec![1, 3]]);
    }

    #[test]
    fn the_strongest_come_first_whatever_their_sign_and_the_weak_are_left_out() {
        // Squares 0.25, 0.1, 0.42 and 0.23.
        assert_eq!(strongest(&[0.5, -0.316, -0.648, 0.48]), [2, 0, 3]);
        assert_eq!(strongest(&[0.44, 0.45, -0.777]), [2, 1], "0.194 and 0.2025");
    }
}
