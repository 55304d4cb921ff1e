//! The noise of sightings, estimated from their residuals if none is stated.

use super::joint::{ErrorModel, SIZE, TargetProblem, Unknowns};
use super::pose_sighting::PoseSighting;
use super::robot_path::RobotPath;
use super::start::quantile;
use nalgebra::{Matrix6, SMatrix, Vector6};
use trueline_lsq::{Information, LeastSquares, NormalEquations};

/// Number of sightings from which the noise along the camera's view is estimated separately. Each of four variances then
/// has at least 10 numbers and is known to a half, and a camera measures depth ten times worse than across.
const MANY: usize = 10;
/// Least noise, rad and m: rounding of files.
const LEAST: [f64; 2] = [1e-7, 1e-8];
/// Part of the squared residuals with a largest value equal to their median if three of ten are wrong.
const MEDIAN_PART: f64 = 0.4;
/// Median of the squared length of three numbers of unit variance.
const MEDIAN_SQUARED: f64 = 2.366;
/// A direction is not seen below this part of the best seen one.
const SEEN: f64 = 1e-7;

/// Which components of a sighting have one noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Groups {
    /// All of its rotation, all of its translation.
    Two,
    /// Each about, or across, the view and along it.
    Four,
}

impl Groups {
    /// Number of variances that a number of sightings can separate.
    pub(crate) fn for_count(count: usize) -> Self {
        if count >= MANY { Self::Four } else { Self::Two }
    }

    fn members(self) -> &'static [&'static [usize]] {
        match self {
            Self::Two => &[&[0, 1, 2], &[3, 4, 5]],
            Self::Four => &[&[0, 1], &[2], &[3, 4], &[5]],
        }
    }
}

/// A first value, from all residuals at a start; `None` if no sighting has a pose of the robot.
pub(crate) fn at_start(
    sightings: &[PoseSighting],
    robot: RobotPath<'_>,
    at: &Unknowns,
) -> Option<Vector6<f64>> {
    let exact = ErrorModel { position_m: 0.0, rotation_rad: 0.0, stamp_s: 0.0, ..ErrorModel::default() };
    let problem = TargetProblem::whitened(sightings, robot, &exact, at);
    let differences: Vec<Vector6<f64>> =
        (0..sightings.len()).filter_map(|k| problem.difference(k, at)).collect();
    let mut sigma = Vector6::zeros();
    for (part, least) in LEAST.into_iter().enumerate() {
        let squares = differences.iter().map(|d| d.fixed_rows::<3>(3 * part).norm_squared()).collect();
        let value = (quantile(squares, MEDIAN_PART)? / MEDIAN_SQUARED).sqrt().max(least);
        sigma.fixed_rows_mut::<3>(3 * part).fill(value);
    }
    Some(sigma)
}

/// The next value: each variance times Σ |S⁻¹r|² over Σ tr P of its components, with S the covariance of a residual r and
/// P = S⁻¹ − S⁻¹ J C Jᵀ S⁻¹. It converges at the largest restricted likelihood \[Patterson1971\].
pub(crate) fn estimated(
    problem: &TargetProblem<'_, PoseSighting>,
    at: &Unknowns,
    sigma: &Vector6<f64>,
    groups: Groups,
) -> Option<Vector6<f64>> {
    let mut equations = NormalEquations::zeros(SIZE);
    problem.linearize(at, &mut equations);
    let inverse = Information::new(&equations.hessian, problem.held(), SEEN)?.covariance();
    let covariance = SMatrix::<f64, SIZE, SIZE>::from_fn(|i, j| inverse[(i, j)]);
    let (mut squares, mut expected) = (Vector6::<f64>::zeros(), Vector6::<f64>::zeros());
    for k in (0..problem.used.len()).filter(|k| problem.used[*k]) {
        let Some((residual, jacobian)) = problem.linearized(k, at) else { continue };
        let whitening = problem.whitening(k);
        let weighted = whitening.transpose() * residual;
        let left = Matrix6::identity() - jacobian * covariance * jacobian.transpose();
        squares += weighted.component_mul(&weighted);
        expected += (whitening.transpose() * left * whitening).diagonal();
    }
    let mut next = *sigma;
    for members in groups.members() {
        let sum = |of: &Vector6<f64>| members.iter().map(|k| of[*k]).sum::<f64>();
        let ratio = (sum(&squares) / sum(&expected).max(f64::MIN_POSITIVE)).sqrt();
        for k in *members {
            next[*k] = (sigma[*k] * ratio).max(LEAST[k / 3]);
        }
    }
    next.iter().all(|x| x.is_finite()).then_some(next)
}
