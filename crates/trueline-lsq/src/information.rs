//! What the data say about each unknown: rank, null directions, covariance.
//!
//! H = JᵀJ of the whitened residuals is the information. Its columns are scaled to unit length first, so
//! that a metre and a radian can be compared; the singular values of the scaled J are then between 0 and
//! √n, and a direction is called unseen below a stated part of the largest one.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// The spectrum of a scaled information matrix.
#[derive(Clone, Debug)]
pub struct Information {
    free: Vec<usize>,
    dimension: usize,
    scale: DVector<f64>,
    eigenvectors: DMatrix<f64>,
    singular_values: DVector<f64>,
    threshold: f64,
}

impl Information {
    /// Analyses `hessian` over the unknowns not in `fixed`; a direction counts as seen if its scaled
    /// singular value is above `threshold` times the largest.
    ///
    /// Returns `None` if the matrix is not finite or the decomposition fails.
    #[must_use]
    pub fn new(hessian: &DMatrix<f64>, fixed: &[usize], threshold: f64) -> Option<Self> {
        let dimension = hessian.nrows();
        let free: Vec<usize> = (0..dimension).filter(|k| !fixed.contains(k)).collect();
        if !hessian.iter().all(|x| x.is_finite()) {
            return None;
        }
        let largest = free.iter().map(|&k| hessian[(k, k)]).fold(0.0, f64::max);
        // A column that is empty to rounding is left unscaled: it is a null direction by itself.
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
        let eigen = SymmetricEigen::try_new(scaled, f64::EPSILON, 10_000)?;
        let mut order: Vec<usize> = (0..free.len()).collect();
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        let eigenvectors = DMatrix::from_fn(free.len(), free.len(), |i, j| eigen.eigenvectors[(i, order[j])]);
        let singular_values =
            DVector::from_iterator(free.len(), order.iter().map(|&k| eigen.eigenvalues[k].max(0.0).sqrt()));
        Some(Self { free, dimension, scale, eigenvectors, singular_values, threshold })
    }

    /// Number of unknowns that are estimated.
    #[must_use]
    pub fn size(&self) -> usize {
        self.free.len()
    }

    /// Singular values of the scaled, whitened Jacobian, falling.
    #[must_use]
    pub fn singular_values(&self) -> &DVector<f64> {
        &self.singular_values
    }

    /// Number of directions that are seen.
    #[must_use]
    pub fn rank(&self) -> usize {
        let Some(&largest) = self.singular_values.iter().next() else {
            return 0;
        };
        self.singular_values.iter().filter(|s| **s > self.threshold * largest && **s > 0.0).count()
    }

    /// Largest over smallest singular value; infinite for a singular problem.
    #[must_use]
    pub fn condition(&self) -> f64 {
        let n = self.singular_values.len();
        if n == 0 { 1.0 } else { self.singular_values[0] / self.singular_values[n - 1] }
    }

    /// Null directions as unit vectors of the scaled unknowns, one column each; rows are all unknowns,
    /// fixed ones zero.
    #[must_use]
    pub fn null_space(&self) -> DMatrix<f64> {
        let (rank, count) = (self.rank(), self.free.len());
        let mut null = DMatrix::zeros(self.dimension, count - rank);
        for (column, k) in (rank..count).enumerate() {
            for (row, &unknown) in self.free.iter().enumerate() {
                null[(unknown, column)] = self.eigenvectors[(row, k)];
            }
        }
        null
    }

    /// Covariance on the seen directions (pseudo-inverse of H); zero for fixed unknowns.
    #[must_use]
    pub fn covariance(&self) -> DMatrix<f64> {
        let root = self.covariance_root();
        &root * root.transpose()
    }

    /// A root C½ of [`Information::covariance`], one column for each seen direction: C = C½ C½ᵀ and
    /// C½ᵀ H C½ = I.
    #[must_use]
    pub fn covariance_root(&self) -> DMatrix<f64> {
        let rank = self.rank();
        let mut root = DMatrix::zeros(self.dimension, rank);
        for column in 0..rank {
            for (row, &unknown) in self.free.iter().enumerate() {
                root[(unknown, column)] =
                    self.eigenvectors[(row, column)] * self.scale[row] / self.singular_values[column];
            }
        }
        root
    }
}
