//! Priors of blocks of unknowns: a Gaussian about zero for each.
//!
//! Bows of seams, forms of plates and the shape of the sensor's sheet have a prior. Time offset, hand-eye transform, lines and planes have none.

use crate::input::shape_prior::ShapePrior;
use nalgebra::{DMatrix, DVector};
use std::ops::Range;
use trueline_lsq::NormalEquations;
use trueline_model::SheetShape;

/// Precision of the numbers of a block, 1/σ².
#[derive(Clone, Debug, PartialEq)]
enum Precision {
    /// Equal for each number, and independent.
    Each(f64),
    /// Joint.
    Joint(DMatrix<f64>),
}

/// A block of unknowns with its prior.
#[derive(Clone, Debug, PartialEq)]
struct Block {
    places: Range<usize>,
    values: DVector<f64>,
    precision: Precision,
}

impl Block {
    /// Precision times a vector of the block's size.
    fn weighed(&self) -> DVector<f64> {
        match &self.precision {
            Precision::Each(precision) => &self.values * *precision,
            Precision::Joint(precision) => precision * &self.values,
        }
    }
}

/// The priors of a problem, at a state of its unknowns.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Known {
    blocks: Vec<Block>,
}

impl Known {
    /// Adds a block of numbers with one independent standard deviation, in their unit.
    #[must_use]
    pub(crate) fn each(mut self, places: Range<usize>, values: &[f64], sigma: f64) -> Self {
        let precision = Precision::Each(sigma.powi(-2));
        self.blocks.push(Block { places, values: DVector::from_column_slice(values), precision });
        self
    }

    /// Adds the shape of the sensor, if it is estimated and has a prior.
    #[must_use]
    pub(crate) fn shape(
        mut self,
        places: Range<usize>,
        shape: Option<&SheetShape>,
        prior: Option<&ShapePrior>,
    ) -> Self {
        if let (Some(shape), Some(prior)) = (shape, prior) {
            let precision = DMatrix::from_column_slice(5, 5, prior.information.as_slice());
            let values = DVector::from_column_slice(&shape.h);
            self.blocks.push(Block { places, values, precision: Precision::Joint(precision) });
        }
        self
    }

    /// ½ vᵀ P v.
    #[must_use]
    pub(crate) fn cost(&self) -> f64 {
        0.5 * self.blocks.iter().map(|block| block.values.dot(&block.weighed())).sum::<f64>()
    }

    /// P over a number of unknowns.
    #[must_use]
    pub(crate) fn information(&self, dimension: usize) -> DMatrix<f64> {
        let mut all = DMatrix::zeros(dimension, dimension);
        self.add_information(&mut all);
        all
    }

    /// P v over a number of unknowns.
    #[must_use]
    pub(crate) fn gradient(&self, dimension: usize) -> DVector<f64> {
        let mut all = DVector::zeros(dimension);
        self.add_gradient(&mut all);
        all
    }

    /// Adds cost, gradient and information.
    pub(crate) fn add_to(&self, equations: &mut NormalEquations) {
        self.add_information(&mut equations.hessian);
        self.add_gradient(&mut equations.gradient);
        equations.cost += self.cost();
    }

    fn add_information(&self, all: &mut DMatrix<f64>) {
        for Block { places, precision, .. } in &self.blocks {
            match precision {
                Precision::Each(precision) => places.clone().for_each(|k| all[(k, k)] += precision),
                Precision::Joint(precision) => {
                    let mut own = all.view_mut((places.start, places.start), precision.shape());
                    own += precision;
                }
            }
        }
    }

    fn add_gradient(&self, all: &mut DVector<f64>) {
        for block in &self.blocks {
            let mut own = all.rows_mut(block.places.start, block.places.len());
            own += block.weighed();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::SMatrix;

    /// Two blocks among eight unknowns, one with independent and one with joint precision: against the plain quadratic form.
    #[test]
    fn blocks_add_up_to_one_quadratic_form() {
        let shape = SheetShape { h: [0.1, -0.2, 0.3, 1.5, -2.5], origin_m: [0.0; 2] };
        let root = SMatrix::<f64, 5, 5>::from_fn(|i, j| ((3 * i + 7 * j) as f64).sin());
        let information = root * root.transpose();
        let prior = ShapePrior { information };
        let known = Known::default().each(1..3, &[0.4, -0.6], 0.5).shape(3..8, Some(&shape), Some(&prior));
        let values = DVector::from_column_slice(&[0.0, 0.4, -0.6, 0.1, -0.2, 0.3, 1.5, -2.5]);
        let mut plain = DMatrix::zeros(8, 8);
        (plain[(1, 1)], plain[(2, 2)]) = (4.0, 4.0);
        plain.view_mut((3, 3), (5, 5)).copy_from(&information);
        let mut equations = NormalEquations::zeros(8);
        known.add_to(&mut equations);
        // Sums of some ten products of numbers of about one.
        assert!((&equations.hessian - &plain).amax() < 1e-14);
        assert!((&equations.gradient - &plain * &values).amax() < 1e-14);
        assert!((equations.cost - 0.5 * values.dot(&(&plain * &values))).abs() < 1e-13);
        assert_eq!((known.information(8), known.gradient(8)), (equations.hessian, equations.gradient));
        assert_eq!(Known::default().shape(0..5, Some(&shape), None), Known::default());
    }
}
