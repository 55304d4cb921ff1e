//! How far errors that move the measured points move the answer: with r = J x + Z ξ it is off by M⁻¹ Jᵀ W Z ξ, with the prior of the
//! curve in M \[Schmidt1966\].

use crate::curve::arrow::{ArrowRoot, SHARED};
use crate::curve::equations::{self, COLUMNS};
use crate::curve::fit::Fitted;
use nalgebra::{DMatrix, DVector, Matrix2xX, Vector2};

/// How errors of unit variance move the measured points against the predicted ones in the sheet, m.
#[derive(Clone, Debug, Default)]
pub(crate) struct Moves {
    /// Number of errors.
    pub errors: usize,
    /// A column for each error, of some readings.
    pub readings: Vec<(usize, Matrix2xX<f64>)>,
    /// One in so many readings stands for the others.
    pub every: usize,
}

impl Moves {
    /// How far each error moves all unknowns: one column each.
    #[must_use]
    pub(crate) fn columns(&self, fitted: &Fitted, root: &ArrowRoot) -> DMatrix<f64> {
        self.solved(self.sums(fitted), root)
    }

    /// The columns of sums.
    #[must_use]
    pub(crate) fn solved(&self, mut sums: DMatrix<f64>, root: &ArrowRoot) -> DMatrix<f64> {
        for mut column in sums.column_iter_mut() {
            let solved = root.solve(&DVector::from_column_slice(column.as_slice()));
            column.copy_from(&solved);
        }
        sums
    }

    /// Jᵀ W Z: one column for each error.
    #[must_use]
    pub(crate) fn sums(&self, fitted: &Fitted) -> DMatrix<f64> {
        let state = &fitted.state;
        let normals = state.normals();
        let size = 2 * state.spline.control.len() + state.of_place() + SHARED;
        let mut sums = DMatrix::zeros(size, self.errors);
        let mut found = [(0, Vector2::zeros()); COLUMNS];
        for (k, by) in &self.readings {
            let (Some(seen), whitener) = (&fitted.sights[*k], &fitted.whiteners[*k]) else { continue };
            let whitened = whitener * fitted.weights[*k] * by;
            let count = equations::columns(state, &normals, (seen, whitener), &mut found);
            for (column, moved) in whitened.column_iter().enumerate() {
                for (index, own) in &found[..count] {
                    sums[(*index, column)] += own.dot(&moved);
                }
            }
        }
        sums
    }
}
