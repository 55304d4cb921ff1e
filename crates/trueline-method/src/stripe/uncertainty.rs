//! Covariance of the plates' problem: that of the model, as far as the scores of its frames agree with it.
//!
//! As for seam points: a frame's four residuals are one score, so that what they share is in it, and neighbouring frames may be
//! alike. The model knows the correlation of the robot's noise between them: its path is made of many samples; and it knows that the
//! Jacobian trembles with the robot's poses ([`motion_information`](crate::stripe::motion_information)).

use crate::assess::row_table::RowTable;
use crate::solve::covariance::blend;
use crate::stripe::fit::StripeFit;
use crate::stripe::state::StripeState;
use crate::stripe::unknowns::LOCAL_ALL;
use crate::stripe::whitening::SharedNoise;
use nalgebra::DMatrix;
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
    let FrameScores { stamps_s, of_residuals, of_robot, rows } = frame_scores(fit, at, shared);
    let frames = of_residuals.in_root(root);
    // What the priors say is no unknown that the residuals paid for.
    let unknowns = alone.trace();
    let freedom = rows as f64 / (rows as f64 - unknowns).max(1.0);
    let (variance, bend) = fit.moments.variance_and_bend();
    let per_weight = variance * freedom;
    let expected =
        alone + root.transpose() * trembling * root + between_frames(fit, &stamps_s, &of_robot.in_root(root));
    let (middle, model_share) = blend(&frames, &expected, per_weight);
    let covariance = root * (middle * (per_weight / bend.powi(2)) + known) * root.transpose();
    StripeUncertainty { covariance, model_share }
}

/// What the robot's noise adds to the covariance of the sum of all scores between one frame and another: Σ ρ (s_i s_jᵀ + s_j s_iᵀ)
/// over pairs of frames, with the columns s = Jᵀ Σ⁻¹ \[σ_r G, σ_ω T\] in the root's coordinates.
fn between_frames(fit: &StripeFit<'_>, stamps_s: &[f64], of_robot: &RowTable) -> DMatrix<f64> {
    let correlation = &fit.problem.observations.robot.noise_correlation;
    let scores = of_robot.columns();
    // Σ ρ s of the frames before each.
    let mut before = DMatrix::zeros(scores.nrows(), scores.ncols());
    let mut first = 0;
    for (index, stamp_s) in stamps_s.iter().enumerate() {
        let mut sum = before.columns_mut(ERRORS * index, ERRORS);
        first += stamps_s[first..index].iter().take_while(|s| stamp_s - **s > correlation.reach_s()).count();
        for (earlier, earlier_s) in (first..index).zip(&stamps_s[first..]) {
            let alike = correlation.over(stamp_s - earlier_s);
            sum.zip_apply(&scores.columns(ERRORS * earlier, ERRORS), |sum, s| *sum += alike * s);
        }
    }
    let sum = scores * before.transpose();
    &sum + sum.transpose()
}

/// Errors of the robot in a frame: a shift and a turn.
const ERRORS: usize = 6;

/// The scores of the frames over all unknowns, and how they move with what the frames share.
struct FrameScores {
    /// When each was taken, s.
    stamps_s: Vec<f64>,
    /// Jᵀ Σ⁻¹ r.
    of_residuals: RowTable,
    /// By each of the robot's errors of one standard deviation, [`ERRORS`] rows a frame.
    of_robot: RowTable,
    /// Residuals that count.
    rows: usize,
}

fn frame_scores(fit: &StripeFit<'_>, at: &StripeState, shared: &SharedNoise) -> FrameScores {
    let unknowns = &fit.problem.unknowns;
    let shift_m = shared.levels.robot_sigma_m * fit.noise_factor;
    let turn_rad = shared.robot_sigma_rad * fit.noise_factor;
    let [of_residuals, of_robot] = [0, 1].map(|_| RowTable::new(unknowns.dimension()));
    let mut all = FrameScores { stamps_s: Vec::new(), of_residuals, of_robot, rows: 0 };
    for weighed in &fit.problem.frames {
        let Some((parts, gradients)) = fit.problem.linearized(weighed, at) else { continue };
        let joint = weighed.frame.joint;
        let weights = gradients * (weighed.whitener.transpose() * weighed.whitener);
        let score = weights * weighed.residual(&parts);
        unknowns.spread(score.as_slice(), joint, all.of_residuals.push());
        let by_shift = weights * parts.d_displacement * shift_m;
        let by_turn = weights * parts.d_turn * turn_rad;
        for score in by_shift.as_slice().chunks(LOCAL_ALL).chain(by_turn.as_slice().chunks(LOCAL_ALL)) {
            unknowns.spread(score, joint, all.of_robot.push());
        }
        all.stamps_s.push(weighed.frame.stamp_s);
        all.rows += weighed.rows;
    }
    all
}
