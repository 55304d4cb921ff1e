//! Maps the local unknowns of a frame of a target to all unknowns of a problem.

use nalgebra::{DMatrix, DVectorViewMut, Dim, Matrix, Storage};

/// The order of a problem's unknowns. A frame depends on its *local* unknowns, which have an order of their own.
pub(crate) trait Layout {
    /// Number of local unknowns of a frame.
    fn count(&self) -> usize;

    /// Index among all unknowns of a local one of a frame of a target. `None` if it is not estimated.
    fn index(&self, local: usize, target: usize) -> Option<usize>;

    /// Local unknowns of a frame of a target with their indices among all.
    fn indices(&self, target: usize) -> impl Iterator<Item = (usize, usize)> {
        (0..self.count()).filter_map(move |local| Some((local, self.index(local, target)?)))
    }

    /// Adds numbers over the local unknowns to numbers over all.
    fn add(&self, target: usize, by_local: &[f64], all: &mut [f64]) {
        self.indices(target).for_each(|(local, index)| all[index] += by_local[local]);
    }

    /// Adds rows over the local unknowns to rows over all.
    fn add_rows<R: Dim, C: Dim, S: Storage<f64, R, C>>(
        &self,
        target: usize,
        by_local: &Matrix<f64, R, C, S>,
        all: &mut DMatrix<f64>,
    ) {
        for column in 0..by_local.ncols() {
            self.indices(target).for_each(|(local, index)| all[(index, column)] += by_local[(local, column)]);
        }
    }

    /// Adds a square matrix over the local unknowns to that over all.
    fn add_square<R: Dim, S: Storage<f64, R, R>>(
        &self,
        target: usize,
        by_local: &Matrix<f64, R, R, S>,
        all: &mut DMatrix<f64>,
    ) {
        for (column, of_all) in self.indices(target) {
            self.indices(target).for_each(|(row, index)| all[(index, of_all)] += by_local[(row, column)]);
        }
    }

    /// Adds a derivative by the local unknowns, times a factor, in the coordinates of a root. `root_rows` has a column for each unknown.
    fn add_in_root(
        &self,
        target: usize,
        (by_local, factor): (&[f64], f64),
        root_rows: &DMatrix<f64>,
        slopes: &mut DVectorViewMut<'_, f64>,
    ) {
        for (local, index) in self.indices(target) {
            slopes.axpy(by_local[local] * factor, &root_rows.column(index), 1.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DVector, Matrix3, Matrix3x2};

    /// Two targets of three local unknowns among five: the first is shared, the second belongs to each target, the third is held.
    struct Two;

    impl Layout for Two {
        fn count(&self) -> usize {
            3
        }

        fn index(&self, local: usize, target: usize) -> Option<usize> {
            [Some(4), Some(1 + target), None][local]
        }
    }

    #[test]
    fn numbers_go_to_the_places_of_their_target() {
        let mut all = [0.0; 5];
        Two.add(1, &[1.0, 2.0, 3.0], &mut all);
        Two.add(0, &[10.0, 20.0, 30.0], &mut all);
        assert_eq!(all, [0.0, 20.0, 2.0, 0.0, 11.0]);
        let mut rows = DMatrix::zeros(5, 2);
        Two.add_rows(1, &Matrix3x2::new(1.0, 2.0, 3.0, 4.0, 5.0, 6.0), &mut rows);
        assert_eq!((rows[(4, 0)], rows[(4, 1)], rows[(2, 1)], rows.sum()), (1.0, 2.0, 4.0, 10.0));
        let mut square = DMatrix::zeros(5, 5);
        Two.add_square(0, &Matrix3::new(1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0), &mut square);
        assert_eq!((square[(4, 4)], square[(4, 1)], square[(1, 4)], square[(1, 1)]), (1.0, 2.0, 4.0, 5.0));
        assert_eq!(square.sum(), 12.0);
        let root_rows = DMatrix::from_fn(2, 5, |i, j| (10 * i + j) as f64);
        let mut slopes = DVector::zeros(2);
        Two.add_in_root(1, (&[1.0, 3.0, 5.0], 2.0), &root_rows, &mut slopes.rows_mut(0, 2));
        assert_eq!(slopes.as_slice(), [2.0 * (4.0 + 3.0 * 2.0), 2.0 * (14.0 + 3.0 * 12.0)]);
    }
}
