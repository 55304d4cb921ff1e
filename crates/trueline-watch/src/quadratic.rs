//! A Gaussian in information form: b ~ N(H x, H).
//!
//! H is the information about x, b its score. Evidence adds up, unneeded unknowns are marginalised by the Schur complement,
//! and a change of unknowns x = T y gives Tᵀ H T and Tᵀ b. All of the detector is made of these three.

use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// Information and score about a vector of unknowns.
#[derive(Clone, Debug, PartialEq)]
pub struct Quadratic {
    /// H.
    pub matrix: DMatrix<f64>,
    /// b.
    pub vector: DVector<f64>,
}

/// Eigenvalues below this part of the largest are zero to the precision of sums over a thousand features.
const RELATIVE_ZERO: f64 = 1e-10;

impl Quadratic {
    /// Nothing known of `size` unknowns.
    #[must_use]
    pub fn nothing(size: usize) -> Self {
        Self { matrix: DMatrix::zeros(size, size), vector: DVector::zeros(size) }
    }

    /// Number of unknowns.
    #[must_use]
    pub fn size(&self) -> usize {
        self.vector.len()
    }

    /// Adds independent evidence about the same unknowns.
    pub fn add(&mut self, other: &Self) {
        self.matrix += &other.matrix;
        self.vector += &other.vector;
    }

    /// The evidence without a part that was added before.
    #[must_use]
    pub fn without(&self, other: &Self) -> Self {
        Self { matrix: &self.matrix - &other.matrix, vector: &self.vector - &other.vector }
    }

    /// The same evidence about y where x = T y.
    #[must_use]
    pub(crate) fn of_unknowns(&self, x_from_y: &DMatrix<f64>) -> Self {
        Self {
            matrix: x_from_y.transpose() * &self.matrix * x_from_y,
            vector: x_from_y.transpose() * &self.vector,
        }
    }

    /// The same evidence with unknown k counted in units of `units[k]`.
    #[must_use]
    pub(crate) fn in_units(&self, units: &[f64]) -> Self {
        let matrix =
            DMatrix::from_fn(self.size(), self.size(), |i, j| self.matrix[(i, j)] * units[i] * units[j]);
        Self { matrix, vector: DVector::from_fn(self.size(), |i, _| self.vector[i] * units[i]) }
    }

    /// The same evidence with all unknowns but these held at zero, in this order.
    #[must_use]
    pub fn restricted(&self, kept: &[usize]) -> Self {
        let n = kept.len();
        Self {
            matrix: DMatrix::from_fn(n, n, |i, j| self.matrix[(kept[i], kept[j])]),
            vector: DVector::from_fn(n, |i, _| self.vector[kept[i]]),
        }
    }

    /// Evidence about the first `kept` unknowns for any value of the others: the Schur complement. Directions of the
    /// others without information cannot be used.
    #[must_use]
    pub fn marginal(&self, kept: usize) -> Self {
        let other = self.size() - kept;
        if other == 0 {
            return self.clone();
        }
        let cross = self.matrix.view((0, kept), (kept, other)).into_owned();
        let own = self.matrix.view((kept, kept), (other, other)).into_owned();
        let score = self.vector.rows(kept, other).into_owned();
        let (solved_cross, solved_score) = solved(own, &cross.transpose(), &score);
        let mut matrix = self.matrix.view((0, 0), (kept, kept)) - &cross * solved_cross;
        symmetrise(&mut matrix);
        Self { matrix, vector: self.vector.rows(0, kept) - cross * solved_score }
    }

    /// The indices of a range, for [`Self::restricted`].
    #[must_use]
    pub(crate) fn indices(ranges: &[Range<usize>]) -> Vec<usize> {
        ranges.iter().flat_map(Clone::clone).collect()
    }
}

/// H⁺ C and H⁺ b, by eigenvectors: directions without information stay zero.
fn solved(own: DMatrix<f64>, cross: &DMatrix<f64>, score: &DVector<f64>) -> (DMatrix<f64>, DVector<f64>) {
    // Unknowns of different units are brought to one scale first.
    let scale = DVector::from_fn(own.nrows(), |i, _| {
        let diagonal = own[(i, i)];
        if diagonal > 0.0 { diagonal.sqrt().recip() } else { 0.0 }
    });
    let scaled = DMatrix::from_fn(own.nrows(), own.nrows(), |i, j| own[(i, j)] * scale[i] * scale[j]);
    let eigen = scaled.symmetric_eigen();
    let limit = RELATIVE_ZERO * eigen.eigenvalues.amax();
    let inverse = eigen.eigenvalues.map(|value| if value > limit { value.recip() } else { 0.0 });
    let root = DMatrix::from_diagonal(&scale) * &eigen.eigenvectors;
    let pseudo_inverse = &root * DMatrix::from_diagonal(&inverse) * root.transpose();
    (&pseudo_inverse * cross, &pseudo_inverse * score)
}

fn symmetrise(matrix: &mut DMatrix<f64>) {
    let transposed = matrix.transpose();
    *matrix += transposed;
    *matrix *= 0.5;
}
