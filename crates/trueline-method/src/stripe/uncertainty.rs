//! Covariance of the plates' problem: that of the model, unless the scores of its frames disagree.
//!
//! As for seam points, a frame's four residuals form one score, which includes their shared errors. Neighbouring frames may be correlated. The model
//! includes the correlation of the robot's noise between frames, because the path consists of many samples. It also accounts for pose noise in the
//! Jacobian ([`motion_information`](crate::stripe::motion_information)).

use crate::input::path_noise::NoiseCorrelation;
use crate::problem::layout::Layout;
use crate::problem::row_table::RowTable;
use crate::solve::covariance::blend;
use crate::stripe::fit::StripeFit;
use crate::stripe::frame_residual::{FrameGradients, FrameResidual};
use crate::stripe::unknowns::LOCAL_ALL;
use crate::stripe::whitening::SharedNoise;
use nalgebra::{DMatrix, SMatrix};
use std::collections::VecDeque;
use trueline_lsq::Information;

/// A covariance and its origin.
#[derive(Clone, Debug)]
pub struct StripeUncertainty {
    /// Covariance of the tangent from noise, SI units. Unobservable directions are left out.
    pub covariance: DMatrix<f64>,
    /// Share of the model in it, 0 to 1.
    pub model_share: f64,
}

/// Covariance at the optimum, with noise shared between frames. It uses the information from motion, and the pose noise in the scores beside it.
#[must_use]
pub fn assess(
    fit: &StripeFit<'_>,
    (information, pose_noise): (&Information, &DMatrix<f64>),
    shared: &SharedNoise,
) -> StripeUncertainty {
    let (problem, at) = (&fit.problem, fit.state());
    let root = information.covariance_root();
    let known = at.known(problem.shape_prior.as_ref()).information(root.nrows());
    let known = root.transpose() * known * root;
    let alone = DMatrix::identity(root.ncols(), root.ncols()) - &known;
    let (mut scores, mut rows) = (RowTable::new(root.nrows()), 0);
    let mut between = BetweenFrames::new(&problem.observations.robot.noise_correlation, root.ncols());
    for some in problem.frames.chunks(TOGETHER) {
        let (mut stamps_s, mut of_robot) = (Vec::new(), RowTable::new(root.nrows()));
        for weighed in some {
            let Some((parts, gradients)) = problem.linearized(weighed, at) else { continue };
            let joint = weighed.frame.joint;
            let weights = gradients * (weighed.whitener.transpose() * weighed.whitener);
            let score = weights * weighed.residual(&parts);
            problem.unknowns.add(joint, score.as_slice(), scores.push());
            for score in by_robot(fit, &weights, &parts, shared).as_slice().chunks(LOCAL_ALL) {
                problem.unknowns.add(joint, score, of_robot.push());
            }
            stamps_s.push(weighed.frame.stamp_s);
            rows += weighed.rows;
        }
        between.add(&stamps_s, &of_robot.in_root(root));
    }
    let frames = scores.in_root(root);
    // Directions that the prior determines use up no degrees of freedom of the residuals.
    let unknowns = alone.trace();
    let freedom = rows as f64 / (rows as f64 - unknowns).max(1.0);
    let (variance, bend) = fit.moments.variance_and_bend();
    let per_weight = variance * freedom;
    let expected = alone + root.transpose() * pose_noise * root + between.sum();
    let (middle, model_share) = blend(&frames, &expected, per_weight);
    let covariance = root * (middle * (per_weight / bend.powi(2)) + known) * root.transpose();
    StripeUncertainty { covariance, model_share }
}

/// Number of frames whose scores are converted to the root's coordinates together.
const TOGETHER: usize = 64;
/// Errors of the robot in a frame: a shift and a turn.
const ERRORS: usize = 6;

/// Derivative of a frame's score by the robot's errors, each scaled by its standard deviation.
fn by_robot(
    fit: &StripeFit<'_>,
    weights: &FrameGradients,
    parts: &FrameResidual,
    shared: &SharedNoise,
) -> SMatrix<f64, LOCAL_ALL, ERRORS> {
    let mut columns = SMatrix::<f64, LOCAL_ALL, ERRORS>::zeros();
    let shift_m = shared.levels.robot_sigma_m * fit.noise_factor;
    let turn_rad = shared.robot_sigma_rad * fit.noise_factor;
    columns.fixed_columns_mut::<3>(0).copy_from(&(weights * parts.d_displacement * shift_m));
    columns.fixed_columns_mut::<3>(3).copy_from(&(weights * parts.d_turn * turn_rad));
    columns
}

/// Contribution of the robot's noise to the covariance of the summed scores between different frames: Σ ρ (s_i s_jᵀ + s_j s_iᵀ) over pairs of
/// frames, with the columns s = Jᵀ Σ⁻¹ \[σ_r G, σ_ω T\] in the root's coordinates.
struct BetweenFrames<'a> {
    correlation: &'a NoiseCorrelation,
    /// Σ ρ s_i s_jᵀ with j before i.
    sum: DMatrix<f64>,
    /// sᵀ of frames that may be correlated with the next one, with their stamps, s.
    recent: VecDeque<(f64, DMatrix<f64>)>,
}

impl<'a> BetweenFrames<'a> {
    fn new(correlation: &'a NoiseCorrelation, size: usize) -> Self {
        Self { correlation, sum: DMatrix::zeros(size, size), recent: VecDeque::new() }
    }

    /// Adds the next frames, of [`ERRORS`] rows each.
    fn add(&mut self, stamps_s: &[f64], of_robot: &RowTable) {
        let size = self.sum.nrows();
        // Without observable directions there are no columns.
        for (frame, stamp_s) in stamps_s.iter().enumerate().filter(|_| size > 0) {
            let columns = of_robot.columns().columns(ERRORS * frame, ERRORS).into_owned();
            let reach_s = self.correlation.reach_s();
            while self.recent.front().is_some_and(|(earlier_s, _)| stamp_s - earlier_s > reach_s) {
                self.recent.pop_front();
            }
            let mut alike = DMatrix::zeros(ERRORS, size);
            for (earlier_s, earlier) in &self.recent {
                let correlation = self.correlation.over(stamp_s - earlier_s);
                alike.zip_apply(earlier, |sum, s| *sum += correlation * s);
            }
            if !self.recent.is_empty() {
                self.sum.gemm(1.0, &columns, &alike, 1.0);
            }
            self.recent.push_back((*stamp_s, columns.transpose()));
        }
    }

    fn sum(self) -> DMatrix<f64> {
        &self.sum + self.sum.transpose()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use trueline_geometry::{Trajectory, smooth};

    /// Three rows of frames, some of one stamp and one that goes back, against the sum over all pairs.
    #[test]
    fn sums_between_frames_are_those_of_all_pairs_that_are_alike() {
        let correlation = NoiseCorrelation::of(0.004, 0.02, |times, poses| {
            Trajectory::new(times.to_vec(), &smooth::local_quadratic(times, poses, 1.0, 0.02)).ok()
        });
        let correlation = correlation.unwrap_or_default();
        let stamps_s: Vec<f64> =
            (0..150).map(|k| 0.011 * f64::from(k / 2) - if k == 77 { 0.005 } else { 0.0 }).collect();
        let score = |frame: usize, row: usize, k: usize| ((17 * frame + 5 * row + k) as f64).sin();
        let mut between = BetweenFrames::new(&correlation, 3);
        for first in (0..stamps_s.len()).step_by(TOGETHER) {
            let frames = first..(first + TOGETHER).min(stamps_s.len());
            let mut table = RowTable::new(3);
            for (frame, row) in frames.clone().flat_map(|frame| (0..ERRORS).map(move |row| (frame, row))) {
                table.push().copy_from_slice(&[0, 1, 2].map(|k| score(frame, row, k)));
            }
            between.add(&stamps_s[frames], &table);
        }
        let found = between.sum();
        let mut plain = DMatrix::<f64>::zeros(3, 3);
        for (one, other) in (0..stamps_s.len()).flat_map(|one| (0..one).map(move |other| (one, other))) {
            let alike = correlation.over(stamps_s[one] - stamps_s[other]);
            for (row, i, j) in (0..ERRORS).flat_map(|row| (0..9).map(move |k| (row, k / 3, k % 3))) {
                let product = score(one, row, i) * score(other, row, j);
                plain[(i, j)] += alike * product;
                plain[(j, i)] += alike * product;
            }
        }
        assert!(plain.amax() > 10.0);
        // Some thousand products of at most one.
        assert!((found - plain).amax() < 1e-9);
    }

    #[test]
    fn unobservable_frames_have_no_covariance_between_them() {
        let correlation = NoiseCorrelation::default();
        let mut between = BetweenFrames::new(&correlation, 0);
        between.add(&[0.0, 0.1], &RowTable::new(0));
        assert_eq!(between.sum().len(), 0);
    }
}
