//! Observability of flat plates from the motion of a scan.
//!
//! Observability is a property of the motion. A target of unknown place hides every shift of the sensor that the attitudes cannot separate from a
//! shift of the target. This holds exactly for flat plates. Estimated bows break it: a plate shifted in its own plane has other surface terms, these
//! have a prior, and the prior alone seems to determine a shift of centimetres.
//!
//! Noise of the reported attitudes rotates the sensor a little in every frame, which is not motion either. Its contribution to the information
//! follows from the posterior covariance P of each frame's attitude: N = Σ (∂J/∂ω)ᵀ P (∂J/∂ω) over the whitened Jacobians. Two halves of the path
//! would give N without a noise level. But where stripes determine an attitude far better than the robot reports it, the halves are noisier than the
//! poses of the fit, and observable directions would look like noise.
//!
//! Only unknowns without a prior are tested. The others follow.

use crate::adjustment::pose_noise::MOST_NOISE;
use crate::assess::observability::RANK_THRESHOLD;
use crate::stripe::frame_residual::{FrameGradients, linearize_frame};
use crate::stripe::frame_sums::FrameSums;
use crate::stripe::problem::StripeProblem;
use crate::stripe::state::StripeState;
use crate::stripe::weighed_frame::WeighedFrame;
use crate::thinning::stride;
use nalgebra::{DMatrix, Matrix3, SVector, Vector3};
use trueline_geometry::so3;
use trueline_lsq::{Information, LeastSquares, NormalEquations};

/// Rotation of the differences by the attitude, rad. Jacobians are smooth over tenths.
const SMALL_TURN_RAD: f64 = 1e-4;

/// Maximum number of frames evaluated. Beyond it every n-th frame is used.
const MOST_FRAMES: usize = 400;

/// The noise of the reported attitudes.
#[derive(Clone, Copy, Debug)]
pub struct AttitudeNoise {
    /// Its standard deviation about each axis, rad.
    pub sigma_rad: f64,
    /// Factor on all noise in the weights of the frames.
    pub factor: f64,
}

/// The observable part of a problem's information at its optimum: directions less than half of which is attitude noise. `None` as for
/// [`Information::beside`].
#[must_use]
pub fn shown(
    problem: &StripeProblem<'_>,
    at: &StripeState,
    noise: AttitudeNoise,
    fixed: &[usize],
) -> Option<Information> {
    let flat = at.flattened();
    let mut equations = NormalEquations::zeros(problem.dimension());
    problem.linearize(&flat, &mut equations);
    let known = problem.unknowns.known_before();
    let all = Information::beside(&equations.hessian, fixed, known.clone(), RANK_THRESHOLD)?;
    Some(without_noise(&all, &of_attitudes(problem, &flat, noise), known.len()))
}

/// The part of the information, over all unknowns, that comes from attitude noise.
fn of_attitudes(problem: &StripeProblem<'_>, at: &StripeState, noise: AttitudeNoise) -> DMatrix<f64> {
    let every = stride(problem.frames.len(), MOST_FRAMES);
    let mut sums = FrameSums::new(problem.unknowns);
    for weighed in problem.frames.iter().step_by(every) {
        for pose_noise in pose_noise_gradients(problem, weighed, at, noise).into_iter().flatten() {
            sums.add(weighed, &SVector::zeros(), &pose_noise);
        }
    }
    sums.hessian() * every as f64
}

/// ∂Jᵀ/∂ω of a frame along each column of P½, not whitened.
fn pose_noise_gradients(
    problem: &StripeProblem<'_>,
    weighed: &WeighedFrame,
    at: &StripeState,
    noise: AttitudeNoise,
) -> Option<[FrameGradients; 3]> {
    let here = weighed.placement(problem.observations, at)?;
    let turned = |turn: &Vector3<f64>| {
        let mut there = here;
        there.base_from_tool.rotation = so3::exp(turn) * here.base_from_tool.rotation;
        linearize_frame(problem.observations, &weighed.frame, at, &there)
    };
    // P = σ² (1 − σ² Tᵀ Σ⁻¹ T), with the weights expected without a misfit.
    let (parts, _) = turned(&Vector3::zeros())?;
    let by_turn = weighed.whitener * parts.d_turn * (noise.factor * noise.sigma_rad);
    let left = (Matrix3::identity() - by_turn.transpose() * by_turn).symmetric_eigen();
    let mut gradients = [FrameGradients::zeros(); 3];
    for (k, gradient) in gradients.iter_mut().enumerate() {
        let axis = left.eigenvectors.column(k).into_owned();
        let [more, less] = [1.0, -1.0].map(|sign| turned(&(axis * (sign * SMALL_TURN_RAD))));
        let change = (more?.1 - less?.1) * (0.5 / SMALL_TURN_RAD);
        *gradient = change * (noise.sigma_rad * left.eigenvalues[k].max(0.0).sqrt());
    }
    Some(gradients)
}

/// The information without tested directions half or more of which is noise. The last columns of its root belong to the `known` unknowns.
fn without_noise(information: &Information, noise: &DMatrix<f64>, known: usize) -> Information {
    let root = information.covariance_root();
    let asked_for = root.ncols().saturating_sub(known);
    if asked_for == 0 {
        return information.clone();
    }
    let own = root.columns(0, asked_for);
    // With C½ᵀ H C½ = 1 the eigenvalues are the noise shares.
    let eigen = (own.transpose() * noise * own).symmetric_eigen();
    let motion: Vec<usize> = (0..asked_for).filter(|k| eigen.eigenvalues[*k] < MOST_NOISE).collect();
    if motion.len() == asked_for {
        return information.clone();
    }
    let mut kept = DMatrix::zeros(root.ncols(), motion.len() + known);
    kept.view_mut((0, 0), (asked_for, motion.len())).copy_from(&eigen.eigenvectors.select_columns(&motion));
    kept.view_mut((asked_for, motion.len()), (known, known)).fill_with_identity();
    information.keeping(&kept)
}
