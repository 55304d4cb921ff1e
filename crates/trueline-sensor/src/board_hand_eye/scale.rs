//! The scale of the sightings: how many times longer the target's distances are than reported.
//!
//! A marker of another size than stated, another unit, or a single camera that measures its own path reports directions rightly and lengths
//! by one wrong factor. The motion of a robot that turns shows it: (R_A − 1) t = k R_X t_B − t_A is linear in the factor k.
//!
//! The factor is an unknown beside the others. All others are estimated at a fixed factor; its own step and its share of the covariance
//! follow from the Schur complement of the same normal equations.

use super::joint::{SIZE, TargetProblem, Unknowns};
use super::pose_sighting::{PoseSighting, ReportedPose};
use nalgebra::{DVector, RowVector6, SVector, Vector6};
use trueline_lsq::{Information, LeastSquares, NormalEquations};

/// Lengths of sightings are usually right to this part: a printed marker, and a focal length.
const USUAL: f64 = 0.01;
/// Beyond this many standard deviations of that and of its own, a scale is not chance.
const CERTAIN: f64 = 4.0;
/// A direction is not seen below this part of the best seen one.
const SEEN: f64 = 1e-9;

/// Scale of the sightings.
#[derive(Clone, Debug, PartialEq)]
pub struct Scale {
    /// Length over reported length.
    pub factor: f64,
    /// Its standard deviation from noise.
    pub sigma: f64,
    /// Derivative of the factor by an error of the robot's pose at each counting sighting, as that of the answer.
    pub d_robot: Vec<Option<RowVector6<f64>>>,
}

impl Scale {
    /// Whether the sightings have another scale by more than usual errors and chance.
    #[must_use]
    pub fn is_certain(&self) -> bool {
        is_far(self.factor, self.sigma / self.factor)
    }
}

/// Whether a start is so far from one that it is worth a fit.
pub(crate) fn is_worth_a_fit(factor: f64) -> bool {
    is_far(factor, 0.0)
}

fn is_far(factor: f64, relative_sigma: f64) -> bool {
    factor.ln().abs() > CERTAIN * relative_sigma.hypot(USUAL)
}

/// The sightings with their lengths multiplied. Stated uncertainties are lengths too.
pub(crate) fn scaled(reported: &[ReportedPose], factor: f64) -> Vec<ReportedPose> {
    let scaled = |of: &ReportedPose| {
        let mut camera_from_target = of.camera_from_target;
        camera_from_target.translation.vector *= factor;
        ReportedPose { camera_from_target, sigma: of.sigma.map(|[turn, shift]| [turn, shift * factor]) }
    };
    reported.iter().map(scaled).collect()
}

/// The step of the logarithm of the factor at the optimum of all else, its variance, and how all else follows it.
pub(crate) struct Step {
    pub by: f64,
    pub variance: f64,
    pub follows: SVector<f64, SIZE>,
}

/// The step at the optimum of everything else; `None` if the sightings do not show the scale.
pub(crate) fn step(problem: &TargetProblem<'_, PoseSighting>, at: &Unknowns) -> Option<Step> {
    let mut equations = NormalEquations::zeros(SIZE);
    problem.linearize(at, &mut equations);
    let information = Information::new(&equations.hessian, problem.held(), SEEN)?;
    let (mut across, mut own, mut gradient) = (SVector::<f64, SIZE>::zeros(), 0.0, 0.0);
    for k in (0..problem.used.len()).filter(|k| problem.used[*k]) {
        let Some((residual, jacobian)) = problem.linearized(k, at) else { continue };
        let Some(column) = derivative(problem, k, at) else { continue };
        across += jacobian.transpose() * column;
        own += column.norm_squared();
        gradient += column.dot(&residual);
    }
    let follows = -(information.covariance() * DVector::from_column_slice(across.as_slice()));
    let follows = SVector::<f64, SIZE>::from_column_slice(follows.as_slice());
    let left = own + across.dot(&follows);
    (left > SEEN * own).then(|| Step { by: -gradient / left, variance: 1.0 / left, follows })
}

/// d residual / d logarithm of the factor, whitened: the predicted translation. That of the sighting itself has the residual's own noise, and
/// would make the factor too small.
fn derivative(problem: &TargetProblem<'_, PoseSighting>, k: usize, at: &Unknowns) -> Option<Vector6<f64>> {
    let seen = problem.sighting(k).camera_from_target.translation.vector;
    let predicted = seen - problem.difference(k, at)?.fixed_rows::<3>(3);
    Some(problem.whitening(k).fixed_columns::<3>(3) * predicted)
}

/// Derivative of the logarithm by an error of the robot's pose at a sighting, all else following; `None` if the sighting does not count.
pub(crate) fn d_robot(
    problem: &TargetProblem<'_, PoseSighting>,
    at: &Unknowns,
    step: &Step,
    k: usize,
) -> Option<RowVector6<f64>> {
    let (_, jacobian) = problem.linearized(k, at)?;
    let along = derivative(problem, k, at)? + jacobian * step.follows;
    Some(along.transpose() * problem.whitened_robot(k, at)? * step.variance)
}
