//! The prior of the columns of an adjustment: of the unknowns at a state, and of the blocks.

use crate::adjustment::blocks::Block;
use crate::adjustment::equations::Prior;
use crate::adjustment::sights::State;
use crate::input::shape_prior::ShapePrior;
use nalgebra::{DMatrix, DVector};

/// What is known of the unknowns at a state.
pub(crate) struct KnownBefore<'a, P> {
    /// The state.
    pub at: &'a P,
    /// Components of the tangent that are estimated.
    pub free: &'a [usize],
    /// Prior of the sensor's shape, if it is estimated.
    pub shape_prior: Option<&'a ShapePrior>,
    /// Directions that the scan does not determine. The length of each is the root of the information by which it is held.
    pub unseen: &'a DMatrix<f64>,
}

impl<P: State> KnownBefore<'_, P> {
    /// The prior of the free unknowns and of blocks.
    #[must_use]
    pub(crate) fn prior(&self, blocks: &[Block]) -> Prior {
        let (free, dimension) = (self.free, self.at.dimension());
        let known = self.at.known(self.shape_prior);
        let (of_all, by_all) = (known.information(dimension), known.gradient(dimension));
        let of_all = of_all + self.unseen * self.unseen.transpose();
        let count = blocks.last().map_or(free.len(), |block| block.columns.end);
        let mut information = DMatrix::zeros(count, count);
        let mut gradient = DVector::zeros(count);
        for (column, index) in free.iter().enumerate() {
            gradient[column] = by_all[*index];
            for (row, other) in free.iter().enumerate() {
                information[(row, column)] = of_all[(*other, *index)];
            }
        }
        let mut log_determinant = 0.0;
        for block in blocks {
            for (k, column) in block.columns.clone().enumerate() {
                let variance = block.variance(k);
                information[(column, column)] = variance.recip();
                log_determinant += variance.ln();
            }
        }
        Prior { information, gradient, square: 2.0 * known.cost(), log_determinant }
    }
}
