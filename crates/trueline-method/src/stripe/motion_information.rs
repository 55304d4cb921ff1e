//! Shares of motion and of robot noise in the information of the stripes.
//!
//! Residuals are evaluated at noisy poses, and their Jacobian J contains that noise: JᵀWJ exceeds the information of the motion alone. The pose
//! noise in J is uncorrelated with the residuals in the mean, because derivatives are taken at the most likely poses
//! ([`PoseError`](crate::stripe::weighed_frame::PoseError)). The score Jᵀ W r therefore has mean zero at the truth and variance H = H₀ + N, with N
//! from that noise. Its derivative by the unknowns is H₀ alone: the gain of J from a pose error is cancelled by the curvature of the residual. The
//! covariance of the estimate is H₀⁻¹ (H₀ + N) H₀⁻¹ \[Fuller1987\], which is larger than both inverses.
//!
//! H₀ is the common part of the Jacobians of two paths, one by every other sample and one by those between. Both have the same motion and
//! independent noise.

use crate::adjustment::pose_noise::MOST_NOISE;
use crate::assess::observability::RANK_THRESHOLD;
use crate::problem::placement::placement_at;
use crate::stripe::fit::StripeFit;
use crate::stripe::frame_residual::{FrameGradients, linearize_frame};
use crate::stripe::frame_sums::FrameSums;
use crate::stripe::problem::StripeProblem;
use crate::stripe::state::StripeState;
use crate::stripe::weighed_frame::WeighedFrame;
use crate::thinning::stride;
use nalgebra::{DMatrix, DVector, SVector};
use trueline_geometry::Trajectory;
use trueline_lsq::Information;
use trueline_model::Placement;

/// Maximum number of frames evaluated. Beyond it every n-th frame is used.
const MOST_FRAMES: usize = 800;

/// The times at which the halves of the robot's path are evaluated, s, rising.
#[must_use]
pub fn times_looked_at_s(problem: &StripeProblem<'_>, at: &StripeState) -> Vec<f64> {
    let late_s = at.time_offset_s;
    looked_at(problem).map(|weighed| weighed.frame.stamp_s - late_s).collect()
}

fn every(problem: &StripeProblem<'_>) -> usize {
    stride(problem.frames.len(), MOST_FRAMES)
}

fn looked_at<'a>(problem: &'a StripeProblem<'_>) -> impl Iterator<Item = &'a WeighedFrame> {
    problem.frames.iter().step_by(every(problem))
}

/// N over all unknowns, from the halves of the robot's path.
#[must_use]
pub(crate) fn of_noise(fit: &StripeFit<'_>, halves: &[Trajectory; 2]) -> DMatrix<f64> {
    noise_beside(&fit.problem, fit.state(), |weighed| {
        let exposure_s = weighed.frame.stamp_s - fit.state().time_offset_s;
        let [one, other] =
            halves.each_ref().map(|half| placement_at(half, exposure_s, &fit.state().tool_from_camera));
        Some([one?, other?])
    })
}

/// The part of a problem's information at a state that two placements of each frame do not share.
#[must_use]
pub(crate) fn noise_beside(
    problem: &StripeProblem<'_>,
    at: &StripeState,
    two: impl Fn(&WeighedFrame) -> Option<[Placement; 2]>,
) -> DMatrix<f64> {
    // The symmetric part of J₁ᵀ J₂ is the square of their half sum minus that of their half difference.
    let [mut all, mut shared] = [0, 1].map(|_| FrameSums::new(problem.unknowns));
    let none = SVector::zeros();
    for weighed in looked_at(problem) {
        let Some(two) = two(weighed) else { continue };
        if let Some((own, [one, other])) = gradients(problem, weighed, at, &two) {
            all.add(weighed, &none, &own);
            all.add(weighed, &none, &((one - other) * 0.5));
            shared.add(weighed, &none, &((one + other) * 0.5));
        }
    }
    (all.hessian() - shared.hessian()) * every(problem) as f64
}

/// Gradients of a frame's weighted residuals in the problem, and at two other placements.
fn gradients(
    problem: &StripeProblem<'_>,
    weighed: &WeighedFrame,
    at: &StripeState,
    two: &[Placement; 2],
) -> Option<(FrameGradients, [FrameGradients; 2])> {
    let (_, own) = problem.linearized(weighed, at)?;
    let there =
        |placement: &Placement| Some(linearize_frame(problem.observations, &weighed.frame, at, placement)?.1);
    Some((own, [there(&two[0])?, there(&two[1])?]))
}

/// The part of an information H that comes from motion: H₀ on directions dominated by motion, and zero on the others. `None` as for
/// [`Information::beside`].
#[must_use]
pub(crate) fn shown_by_motion(
    fit: &StripeFit<'_>,
    (all, noise): (&Information, &DMatrix<f64>),
    fixed: &[usize],
) -> Option<Information> {
    let root = all.covariance_root();
    if root.ncols() == 0 {
        return Some(all.clone());
    }
    let eigen = (root.transpose() * noise * root).symmetric_eigen();
    let motion = DVector::from_iterator(
        root.ncols(),
        eigen.eigenvalues.iter().map(|noise| if *noise < MOST_NOISE { 1.0 - noise } else { 0.0 }),
    );
    // With C½ᵀ H C½ = 1 the columns of H C½ are dual to those of C½.
    let dual = &fit.solution.equations.hessian * root * eigen.eigenvectors;
    let of_motion = &dual * DMatrix::from_diagonal(&motion) * dual.transpose();
    Information::beside(&of_motion, fixed, fit.problem.unknowns.known_before(), RANK_THRESHOLD)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::config::{Config, Measurements};
    use crate::input::noise_levels::NoiseLevels;
    use crate::input::observations::{Observations, observe, origin_ns};
    use crate::input::timestamps::{Dejittered, Sampling};
    use crate::problem::parameters::Parameters;
    use crate::stripe::fit::StripeSolver;
    use crate::stripe::frames::frames;
    use crate::stripe::start;
    use crate::stripe::weighed_frame::PoseError;
    use crate::stripe::whitening::SharedNoise;
    use trueline_dataset::Recording;
    use trueline_lsq::{LeastSquares, NormalEquations};
    use trueline_sim::{PlatePair, Plates, Preset, Scenario, scan_plates};

    const ROBOT_NOISE_M: f64 = 5e-5;

    fn observed(recording: &Recording) -> (Observations, Vec<f64>) {
        let sampling = Sampling::of(recording, origin_ns(recording));
        let observations = observe(recording, &sampling, &Config::noise_only()).unwrap();
        (observations, sampling.robot_times_s(Dejittered::default()).to_vec())
    }

    /// Along the true path of the same scan all information comes from motion. One plate with its edge hardly determines a rotation about its
    /// stripe: 25 % of its apparent information from the reported path is noise.
    #[test]
    fn information_from_motion_equals_that_along_the_true_path() {
        let scenario = |robot_position_noise_m: f64| {
            let mut scenario = Preset::Paper.scenario();
            scenario.disturbance.robot_position_noise_m = robot_position_noise_m;
            scenario
        };
        let plates = Plates { pair: PlatePair::Edge, ..Plates::default() };
        let scan = |scenario: &Scenario| scan_plates(scenario, &plates, 2).unwrap();
        let (noisy, still) = (scan(&scenario(ROBOT_NOISE_M)), scan(&scenario(0.0)));
        let ((observations, robot_times_s), (along_true_path, _)) = (observed(&noisy), observed(&still));
        let frames = frames(&noisy, &observations, Measurements::Stripe, &Config::noise_only()).unwrap();
        let truth = noisy.truth.as_ref().unwrap();
        let like = Parameters::straight(&truth.parameters, truth.lines.clone());
        let begin = start::start(&observations, &frames, &like, None).unwrap();
        let fixed = start::held(&begin, &frames.without_plates);
        let levels =
            NoiseLevels { robot_sigma_m: observations.robot.noise_m, stamp_sigma_s: 1e-4, factor: 1.0 };
        let shared = SharedNoise { levels, robot_sigma_rad: 1e-5 };
        let solver = StripeSolver {
            observations: &observations,
            frames: &frames.list,
            shared,
            shape_prior: None,
            fixed: &fixed,
            loss: crate::Config::default().final_loss(),
        };
        let fit = solver.fit(begin).unwrap();
        let all = fit.information(&fixed, RANK_THRESHOLD).unwrap();
        let about_s = times_looked_at_s(&fit.problem, fit.state());
        let halves = observations.robot.halves(&noisy, &robot_times_s, &about_s).unwrap();
        let noise = of_noise(&fit, &halves);
        let shown = shown_by_motion(&fit, (&all, &noise), &fixed).unwrap();
        assert_eq!(shown.rank(), all.rank());

        let exact = |weighed: &WeighedFrame| WeighedFrame { pose_error: PoseError::NONE, ..*weighed };
        let along = StripeProblem {
            observations: &along_true_path,
            frames: fit.problem.frames.iter().map(exact).collect(),
            unknowns: fit.problem.unknowns,
            shape_prior: None,
        };
        let mut equations = NormalEquations::zeros(along.dimension());
        along.linearize(fit.state(), &mut equations);
        // Eigenvalues of the true information in coordinates in which the estimated one is the identity.
        let least = |said: &Information| {
            let root = said.covariance_root();
            (root.transpose() * &equations.hessian * root).symmetric_eigenvalues().min()
        };
        println!("least {} of all, {} of motion", least(&all), least(&shown));
        assert!(least(&all) < 0.85);
        // A noise share a from n frames has the standard deviation 2 √(a/n): 0.04 for a quarter of 660, and 0.05 of a share of 0.75.
        assert!((least(&shown) - 1.0).abs() < 0.12);
    }
}
