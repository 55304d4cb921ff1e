//! What is known of bows and shape before the scan.

use crate::problem::parameters::Parameters;
use nalgebra::{DMatrix, DVector, SMatrix, SVector, Vector2};
use trueline_lsq::NormalEquations;

/// What is known of the sensor's shape before the scan, about h = 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapePrior {
    /// Inverse of its covariance.
    pub information: SMatrix<f64, 5, 5>,
}

/// Cost ½ xᵀ P⁻¹ x of bows and shape.
#[must_use]
pub fn cost(shape_prior: Option<&ShapePrior>, at: &Parameters) -> f64 {
    let bows =
        at.curvatures.iter().map(|c| Vector2::from(c.bow_m).norm_squared() / c.prior_sigma_m().powi(2));
    let shape = at.shape.zip(shape_prior).map_or(0.0, |(shape, prior)| {
        let h = SVector::from(shape.h);
        h.dot(&(prior.information * h))
    });
    0.5 * (bows.sum::<f64>() + shape)
}

/// Adds cost, gradient and Hessian.
pub fn add_to(shape_prior: Option<&ShapePrior>, at: &Parameters, equations: &mut NormalEquations) {
    equations.hessian += &information(shape_prior, at);
    equations.gradient += gradient(shape_prior, at);
    equations.cost += cost(shape_prior, at);
}

/// P⁻¹ x over all unknowns.
#[must_use]
pub fn gradient(shape_prior: Option<&ShapePrior>, at: &Parameters) -> DVector<f64> {
    let mut values = DVector::zeros(at.dimension());
    let unknowns = at.unknowns();
    for (line, curvature) in at.curvatures.iter().enumerate() {
        unknowns.bow(line).zip(curvature.bow_m).for_each(|(k, bow)| values[k] = bow);
    }
    if let Some(shape) = at.shape {
        unknowns.shape().zip(shape.h).for_each(|(k, h)| values[k] = h);
    }
    information(shape_prior, at) * values
}

/// The information of the priors over all unknowns.
#[must_use]
pub fn information(shape_prior: Option<&ShapePrior>, at: &Parameters) -> DMatrix<f64> {
    let unknowns = at.unknowns();
    let mut all = DMatrix::zeros(unknowns.dimension(), unknowns.dimension());
    for (line, curvature) in at.curvatures.iter().enumerate() {
        for k in unknowns.bow(line) {
            all[(k, k)] = curvature.prior_sigma_m().powi(-2);
        }
    }
    if let Some(prior) = shape_prior.filter(|_| at.shape.is_some()) {
        let first = unknowns.shape().start;
        all.view_mut((first, first), (5, 5)).copy_from(&prior.information);
    }
    all
}
