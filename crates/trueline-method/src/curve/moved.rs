//! Effect on the answer of errors that move the measured points. With r = J x + Z ξ the answer is off by M⁻¹ Jᵀ W Z ξ, with the
//! prior of the curve in M \[Schmidt1966\].

use crate::curve::arrow::ArrowRoot;
use crate::curve::equations::Columns;
use crate::curve::fit::Fitted;
use crate::curve::rows::Moved;
use nalgebra::{DMatrix, DVector};

/// Displacement of the measured points against the predicted ones in the sheet, m, by errors of unit variance.
#[derive(Clone, Debug, Default)]
pub(crate) struct Moves {
    /// Number of errors.
    pub errors: usize,
    /// A column for each error, for some readings.
    pub readings: Vec<(usize, Moved)>,
    /// Every n-th reading represents the others.
    pub every: usize,
}

impl Moves {
    /// Displacement of all unknowns: one column for each error.
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
        let mut sums = DMatrix::zeros(state.size(), self.errors);
        let mut columns = Columns::new();
        for (k, by) in &self.readings {
            let (Some(seen), whitener) = (&fitted.sights[*k], &fitted.whiteners[*k]) else { continue };
            let whitened = whitener * fitted.weights[*k] * by;
            columns.fill(state, &normals, (seen, whitener));
            for (column, moved) in whitened.column_iter().enumerate() {
                for (index, own) in columns.found() {
                    sums[(*index, column)] += own.dot(&moved);
                }
            }
        }
        sums
    }
}
