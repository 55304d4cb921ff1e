//! Covariance of the plates' problem: that of the model, as far as the scores of its frames agree with it.
//!
//! As for seam points: a frame's four residuals are one score, so that what they share is in it, and neighbouring frames may be
//! alike.

use crate::solve::covariance::{FrameScores, blend};
use crate::stripe::fit::StripeFit;
use crate::stripe::unknowns::LOCAL_ALL;
use nalgebra::{DMatrix, DVectorViewMut, SVector};
use trueline_lsq::Information;

/// A covariance and how it came about.
#[derive(Clone, Debug)]
pub struct StripeUncertainty {
    /// Covariance of the tangent from noise, SI units; rows of unseen directions hold only what is seen.
    pub covariance: DMatrix<f64>,
    /// Part of it that is the model's, 0 to 1.
    pub model_share: f64,
}

/// Covariance at the optimum.
#[must_use]
pub fn assess(fit: &StripeFit<'_>, information: &Information) -> StripeUncertainty {
    let (problem, at) = (&fit.problem, fit.state());
    let root = information.covariance_root();
    let known = root.transpose() * at.prior_information(problem.shape_prior.as_ref()) * root;
    let expected = DMatrix::identity(root.ncols(), root.ncols()) - &known;
    let (mut frames, mut rows, mut hint) = (FrameScores::new(root.ncols()), 0, 0);
    let root_rows = root.transpose();
    for weighed in &problem.frames {
        let Some((residual, jacobian)) = problem.whitened(weighed, at, &mut hint) else { continue };
        let gradient: SVector<f64, LOCAL_ALL> = jacobian.transpose() * residual;
        let mut score = DVectorViewMut::from_slice(frames.push(), root.ncols());
        for local in 0..problem.unknowns.local() {
            let Some(place) = problem.unknowns.place(local, weighed.frame.joint) else { continue };
            score.axpy(gradient[local], &root_rows.column(place), 1.0);
        }
        rows += weighed.rows;
    }
    // What the priors say is no unknown that the residuals paid for.
    let unknowns = expected.trace();
    let freedom = rows as f64 / (rows as f64 - unknowns).max(1.0);
    let (variance, bend) = fit.moments.variance_and_bend();
    let per_weight = variance * freedom;
    let (middle, model_share) = blend(&frames, &expected, per_weight);
    let covariance = root * (middle * (per_weight / bend.powi(2)) + known) * root.transpose();
    StripeUncertainty { covariance, model_share }
}
