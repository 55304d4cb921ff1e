//! Observability of flat plates by the motion of a scan.
//!
//! Which directions are seen is a question to the motion: a target of unknown place hides every shift of the sensor that the
//! attitudes cannot separate from a shift of the target. Of flat plates that holds exactly. Estimated bows break it: a plate that is shifted in its own plane has
//! other surface terms, that have a prior, and a shift of centimetres seems to be known by that alone.
//!
//! Noise of the reported attitudes turns the sensor a little in every frame, which is no motion either. How much of the information it makes follows from
//! what is left unknown of each frame's attitude, P, once its residuals have had their say: N = Σ (∂J/∂ω)ᵀ P (∂J/∂ω) over the whitened
//! Jacobians. Two halves of the path would tell it without a level of the noise, but where stripes show an attitude far better than the robot
//! reports it, the halves are noisier than the poses that the fit takes, and directions that are seen seem to be noise.
//!
//! Of unknowns that have a prior nothing is asked: a direction is one of the others, and these follow.

use crate::assess::observability::RANK_THRESHOLD;
use crate::stripe::frame_residual::{FrameGradients, linearize_frame};
use crate::stripe::frame_sums::FrameSums;
use crate::stripe::motion_information::MOST_NOISE;
use crate::stripe::problem::StripeProblem;
use crate::stripe::state::StripeState;
use crate::stripe::weighed_frame::WeighedFrame;
use crate::thinning::stride;
use nalgebra::{DMatrix, Matrix3, SVector, Vector3};
use trueline_geometry::so3;
use trueline_lsq::{Information, LeastSquares, NormalEquations};

/// Turn by which a derivative by the attitude is taken, rad: Jacobians are smooth over tenths.
const SMALL_TURN_RAD: f64 = 1e-4;

/// Frames that are looked at; of more, one in several represents the rest.
const MOST_FRAMES: usize = 400;

/// The noise of the reported attitudes.
#[derive(Clone, Copy, Debug)]
pub struct AttitudeNoise {
    /// Its standard deviation about each axis, rad.
    pub sigma_rad: f64,
    /// By how much all noise is larger in the weights of the frames.
    pub factor: f64,
}

/// What is seen of a problem's unknowns at its optimum: directions of which less than half is noise of the attitudes. `None` as for
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

/// What of the information is noise of the attitudes that the fit takes, over all unknowns.
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

/// ∂Jᵀ/∂ω of a frame by each column of P½, not whitened.
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
    // P = σ² (1 − σ² Tᵀ Σ⁻¹ T), with weights as they are expected without any misfit.
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

/// An information without the directions of the unknowns that are asked for of which half or more is noise. The last columns of its root are of the
/// `known` ones beside them.
fn without_noise(information: &Information, noise: &DMatrix<f64>, known: usize) -> Information {
    let root = information.covariance_root();
    let asked_for = root.ncols().saturating_sub(known);
    if asked_for == 0 {
        return information.clone();
    }
    let own = root.columns(0, asked_for);
    // With C½ᵀ H C½ = 1 the eigenvalues are parts.
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
