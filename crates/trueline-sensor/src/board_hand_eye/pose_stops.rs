//! Pose sightings at stops, with the noise of the robot that explains the residuals.

use super::joint::{SIZE, TargetProblem};
use super::pose_sighting::{PoseSighting, ReportedPose};
use super::poses::{PoseFit, PoseOptions, calibrate};
use super::robot_path::RobotPath;
use super::scale;
use super::stop_noise::{FEWEST_FREE, ROUNDS, least_part, scaled};
use super::unknowns::ErrorModel;
use crate::error::Error;
use nalgebra::{Matrix6, SMatrix, Vector6};
use trueline_geometry::Pose;
use trueline_lsq::{Information, LeastSquares, NormalEquations};

/// A direction is not seen below this part of the best seen one.
const SEEN: f64 = 1e-7;

/// The answer of sightings at stops.
#[derive(Clone, Debug)]
pub struct FitAtStops {
    /// The answer.
    pub fit: PoseFit,
    /// Part of the stated errors of the robot that differs from stop to stop, 0 to 1.
    pub stop_noise_part: f64,
}

/// Estimates all unknowns from sightings at stops; `stated` bounds all errors of the robot there.
///
/// # Errors
/// As [`calibrate`].
pub fn calibrate_at_stops(
    reported: &[ReportedPose],
    poses: &[Pose],
    stated: &ErrorModel,
    options: &PoseOptions,
) -> Result<FitAtStops, Error> {
    let path = RobotPath::Stops(poses);
    let fitted = |part: f64, options: &PoseOptions| calibrate(reported, path, &scaled(stated, part), options);
    let mut fit = fitted(1.0, options)?;
    let runner_up = fit.runner_up;
    let mut stop_noise_part = 1.0;
    if stated.position_m <= 0.0 || freedom(&fit) < FEWEST_FREE {
        return Ok(FitAtStops { fit, stop_noise_part });
    }
    for _ in 0..ROUNDS {
        let near = PoseOptions { guess: Some((0.0, fit.unknowns.tool_from_camera)), ..*options };
        let explains = |part: f64| {
            fitted(part, &near).ok().and_then(|fit| is_enough(reported, path, &scaled(stated, part), &fit))
        };
        stop_noise_part = least_part(|part| explains(part).unwrap_or(false));
        fit = fitted(stop_noise_part, &near)?;
    }
    Ok(FitAtStops { fit: PoseFit { runner_up, ..fit }, stop_noise_part })
}

/// Numbers of the counting sightings less unknowns.
fn freedom(fit: &PoseFit) -> f64 {
    6.0 * fit.used.iter().filter(|used| **used).count() as f64 - (SIZE - 1) as f64
}

/// Whether errors of the robot of this size are at least as large as the residuals show, beside the noise of the sightings: the slope of the
/// restricted likelihood by their variance is not positive \[Patterson1971\].
fn is_enough(
    reported: &[ReportedPose],
    path: RobotPath<'_>,
    noise: &ErrorModel,
    fit: &PoseFit,
) -> Option<bool> {
    let factor = fit.scale.as_ref().map_or(1.0, |scale| scale.factor);
    let sightings: Vec<PoseSighting> = scale::scaled(reported, factor)
        .iter()
        .map(|reported| PoseSighting::of(reported, &fit.sigma))
        .collect();
    let at = &fit.unknowns;
    let problem = TargetProblem::whitened(&sightings, path, noise, at).keeping(&fit.used);
    let mut equations = NormalEquations::zeros(SIZE);
    problem.linearize(at, &mut equations);
    let inverse = Information::new(&equations.hessian, problem.held(), SEEN)?.covariance();
    let covariance = SMatrix::<f64, SIZE, SIZE>::from_fn(|i, j| inverse[(i, j)]);
    let (turn, shift) = (noise.rotation_rad, noise.position_m);
    let sizes = Matrix6::from_diagonal(&Vector6::new(turn, turn, turn, shift, shift, shift));
    let (mut squares, mut expected) = (0.0, 0.0);
    for k in (0..sightings.len()).filter(|k| problem.used[*k]) {
        let (residual, jacobian) = problem.linearized(k, at)?;
        let by_robot = problem.whitened_robot(k, at)? * sizes;
        let left = Matrix6::identity() - jacobian * covariance * jacobian.transpose();
        squares += by_robot.tr_mul(&residual).norm_squared();
        expected += (by_robot.transpose() * left * by_robot).trace();
    }
    Some(squares <= expected)
}
