//! What is known of bows and shape before the scan.

use crate::problem::parameters::Parameters;
use nalgebra::{DMatrix, SMatrix, SVector, Vector2};
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
    let unknowns = at.unknowns();
    let information = information(shape_prior, at);
    equations.hessian += &information;
    for (line, curvature) in at.curvatures.iter().enumerate() {
        for (k, bow) in unknowns.bow(line).zip(curvature.bow_m) {
            equations.gradient[k] += information[(k, k)] * bow;
        }
    }
    if let Some((shape, prior)) = at.shape.zip(shape_prior) {
        let gradient = prior.information * SVector::from(shape.h);
        let mut block = equations.gradient.rows_mut(unknowns.shape().start, gradient.len());
        block += gradient;
    }
    equations.cost += cost(shape_prior, at);
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
