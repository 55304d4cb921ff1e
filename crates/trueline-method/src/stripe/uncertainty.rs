//! Covariance of the plates' problem: that of the model, as far as the scores of its frames agree with it.
//!
//! As for seam points: a frame's four residuals are one score, so that what they share is in it, and neighbouring frames may be
//! alike. The model knows the correlation of the robot's noise between them: its path is made of many samples; and it knows that the
//! Jacobian trembles with the robot's poses ([`motion_information`](crate::stripe::motion_information)).

use crate::assess::row_table::RowTable;
use crate::input::path_noise::NoiseCorrelation;
use crate::solve::covariance::blend;
use crate::stripe::fit::StripeFit;
use crate::stripe::problem::linearize_frame;
use crate::stripe::state::StripeState;
use crate::stripe::unknowns::LOCAL_ALL;
use crate::stripe::whitening::SharedNoise;
use nalgebra::{DMatrix, DVectorViewMut, SVector};
use std::collections::VecDeque;
use trueline_lsq::Information;

/// A covariance and how it came about.
#[derive(Clone, Debug)]
pub struct StripeUncertainty {
    /// Covariance of the tangent from noise, SI units; rows of unseen directions hold only what is seen.
    pub covariance: DMatrix<f64>,
    /// Part of it that is the model's, 0 to 1.
    pub model_share: f64,
}

/// Covariance at the optimum, for the noise that frames share; of what motion shows, and what the scores have beside it of noise of the
/// robot's poses.
#[must_use]
pub fn assess(
    fit: &StripeFit<'_>,
    (information, trembling): (&Information, &DMatrix<f64>),
    shared: &SharedNoise,
) -> StripeUncertainty {
    let (problem, at) = (&fit.problem, fit.state());
    let root = information.covariance_root();
    let known = root.transpose() * at.prior_information(problem.shape_prior.as_ref()) * root;
    let alone = DMatrix::identity(root.ncols(), root.ncols()) - &known;
    let (mut frames, mut rows) = (RowTable::new(root.ncols()), 0);
    let root_rows = root.transpose();
    for weighed in &problem.frames {
        let Some((residual, jacobian)) = problem.whitened(weighed, at) else { continue };
        let gradient: SVector<f64, LOCAL_ALL> = jacobian.transpose() * residual;
        let mut score = DVectorViewMut::from_slice(frames.push(), root.ncols());
        for local in 0..problem.unknowns.local() {
            let Some(place) = problem.unknowns.place(local, weighed.frame.joint) else { continue };
            score.axpy(gradient[local], &root_rows.column(place), 1.0);
        }
        rows += weighed.rows;
    }
    // What the priors say is no unknown that the residuals paid for.
    let unknowns = alone.trace();
    let freedom = rows as f64 / (rows as f64 - unknowns).max(1.0);
    let (variance, bend) = fit.moments.variance_and_bend();
    let per_weight = variance * freedom;
    let expected = alone + root.transpose() * trembling * root + between_frames(fit, at, root, shared);
    let (middle, model_share) = blend(&frames, &expected, per_weight);
    let covariance = root * (middle * (per_weight / bend.powi(2)) + known) * root.transpose();
    StripeUncertainty { covariance, model_share }
}

/// What the robot's noise adds to the covariance of the sum of all scores between one frame and another: Σ ρ (s_i s_jᵀ + s_j s_iᵀ)
/// over pairs of frames, with the columns s = Jᵀ Σ⁻¹ \[σ_r G, σ_ω T\] in the root's coordinates.
fn between_frames(
    fit: &StripeFit<'_>,
    at: &StripeState,
    root: &DMatrix<f64>,
    shared: &SharedNoise,
) -> DMatrix<f64> {
    let correlation = &fit.problem.observations.robot.noise_correlation;
    let mut sum = DMatrix::zeros(root.ncols(), root.ncols());
    let mut recent: VecDeque<(f64, DMatrix<f64>)> = VecDeque::new();
    for index in 0..fit.problem.frames.len() {
        let Some(columns) = by_robot(fit, at, root, (shared, index)) else { continue };
        let stamp_s = fit.problem.frames[index].frame.stamp_s;
        while recent.front().is_some_and(|(earlier_s, _)| stamp_s - earlier_s > correlation.reach_s()) {
            recent.pop_front();
        }
        if let Some(alike) = alike_before(&recent, stamp_s, correlation) {
            sum.gemm(1.0, &columns, &alike.transpose(), 1.0);
        }
        recent.push_back((stamp_s, columns));
    }
    &sum + sum.transpose()
}

/// Σ ρ s of the frames before one; `None` where there are none.
fn alike_before(
    recent: &VecDeque<(f64, DMatrix<f64>)>,
    stamp_s: f64,
    correlation: &NoiseCorrelation,
) -> Option<DMatrix<f64>> {
    let parts = recent.iter().map(|(earlier_s, columns)| columns * correlation.over(stamp_s - earlier_s));
    parts.reduce(|sum, part| sum + part)
}

/// How a frame's score moves with the robot's errors, each of one standard deviation, in the root's coordinates.
fn by_robot(
    fit: &StripeFit<'_>,
    at: &StripeState,
    root: &DMatrix<f64>,
    (shared, index): (&SharedNoise, usize),
) -> Option<DMatrix<f64>> {
    let problem = &fit.problem;
    let weighed = &problem.frames[index];
    let placement = weighed.placement(problem.observations, at)?;
    let parts = linearize_frame(problem.observations, &weighed.frame, at, &placement)?;
    let precision = weighed.whitener.transpose() * weighed.whitener;
    let weights = parts.jacobian.transpose() * precision;
    let by_shift = weights * parts.d_displacement * (shared.levels.robot_sigma_m * fit.noise_factor);
    let by_turn = weights * parts.d_turn * (shared.robot_sigma_rad * fit.noise_factor);
    let mut columns = DMatrix::zeros(root.ncols(), 6);
    for local in 0..problem.unknowns.local() {
        let Some(place) = problem.unknowns.place(local, weighed.frame.joint) else { continue };
        let row = root.row(place).transpose();
        for axis in 0..3 {
            columns.column_mut(axis).axpy(by_shift[(local, axis)], &row, 1.0);
            columns.column_mut(3 + axis).axpy(by_turn[(local, axis)], &row, 1.0);
        }
    }
    Some(columns)
}
