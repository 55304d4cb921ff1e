//! Time offset, hand-eye transform and target by maximum likelihood, from the target's pose in every picture.
//!
//! The target is a board, or any other target of a detector or tracker.
//!
//! | symbol | code | meaning |
//! |---|---|---|
//! | C | [`Sighting::camera_from_target`] | measured, ± its covariance |
//! | T(t − t_d) | [`super::robot_path::ToolState::base_from_tool`] | robot, ± its noise |
//! | X, B | [`Unknowns`] | `tool_from_camera`, `base_from_target` |
//!
//! Predicted: P = X⁻¹ T⁻¹ B. The residual is (Log(R_C R_Pᵀ), t_C − t_P), whitened by the noise of sighting, robot and stamp
//! together. Perturbations are on the left, rotation and translation apart.

use super::pose_sighting::Sighting;
use super::robot_path::{RobotPath, ToolState};
use super::sight_model::{derivative, predicted, robot_derivative, whitening};
pub use super::unknowns::{Carried, ErrorModel, HAND_EYE, SIZE, TARGET, TIME_OFFSET, Unknowns};
use crate::error::Error;
use crate::projection::CAMERA_SIZE;
use nalgebra::{DMatrix, DVector, Matrix6, SMatrix, SVector, Vector6};
use trueline_geometry::{Pose, se3};
use trueline_lsq::{Information, LeastSquares, NormalEquations, SolveOptions, solve};

/// Rounds of whitening, outlier rejection and fitting. In each, sightings count if their robot pose is known within this
/// many seconds about the round's first time offset. So none leaves the recording while the offset moves.
pub(crate) const ROUND_MARGINS_S: [f64; 4] = [0.1, 0.05, 0.02, 0.005];
/// Median of the squared length of six whitened numbers.
const MEDIAN_SQUARED: f64 = 5.348;
/// A picture is left out beyond this squared length: by chance one of 300,000.
pub(crate) const OUTLIER_SQUARED: f64 = 36.0;
/// The fewest pictures that leave something over to check.
pub const FEWEST: usize = 4;
/// A direction is not seen below this part of the best seen one.
const SEEN: f64 = 1e-6;

/// Result of the fit.
#[derive(Clone, Debug)]
pub struct BoardFit {
    /// The estimate.
    pub unknowns: Unknowns,
    /// Covariance from noise, in the order of [`TIME_OFFSET`], [`HAND_EYE`], [`TARGET`]; zero for an offset that is held. If
    /// residuals are larger than the noise explains, it is scaled up to them.
    pub covariance: SMatrix<f64, SIZE, SIZE>,
    /// How the estimate follows the camera's parameters fx … k3, which are held.
    pub d_camera: SMatrix<f64, SIZE, CAMERA_SIZE>,
    /// Whitened residual of each picture; `None` where the robot's pose is not known.
    pub residuals: Vec<Option<Vector6<f64>>>,
    /// Pictures with a weight.
    pub used: Vec<bool>,
    /// Sum of squared residuals by its freedom: one if the noise is as it was taken.
    pub squares_per_freedom: f64,
    /// Root mean square distance of the board's origin from its prediction, m.
    pub shift_rms_m: f64,
}

impl BoardFit {
    /// Covariance including the camera's uncertainty; its parameters have this covariance.
    #[must_use]
    pub fn covariance_with(
        &self,
        camera: &SMatrix<f64, CAMERA_SIZE, CAMERA_SIZE>,
    ) -> SMatrix<f64, SIZE, SIZE> {
        self.covariance + self.d_camera * camera * self.d_camera.transpose()
    }
}

/// The problem, whitened at one estimate.
#[derive(Clone, Debug)]
pub struct TargetProblem<'a, S> {
    sightings: &'a [S],
    robot: RobotPath<'a>,
    carries: Carried,
    /// Which sightings count.
    pub(crate) used: Vec<bool>,
    whitening: Vec<Matrix6<f64>>,
}

/// Fits all unknowns from a start; at stops, and if it is held, the time offset stays constant.
///
/// # Errors
/// Too few pictures, or poses that do not fix the hand-eye transform.
pub fn fit<S: Sighting>(
    sightings: &[S],
    robot: RobotPath<'_>,
    noise: &ErrorModel,
    start: Unknowns,
) -> Result<BoardFit, Error> {
    let (state, problem) = converged(sightings, robot, noise, start, &ROUND_MARGINS_S)?;
    problem.concluded(state)
}

/// The estimate from a start, and the problem at it with the sightings that count, after a round for each margin, s.
///
/// # Errors
/// Too few sightings.
pub(crate) fn converged<'a, S: Sighting>(
    sightings: &'a [S],
    robot: RobotPath<'a>,
    noise: &ErrorModel,
    start: Unknowns,
    margins_s: &[f64],
) -> Result<(Unknowns, TargetProblem<'a, S>), Error> {
    let mut state = start;
    let mut scale = f64::INFINITY;
    let mut used = vec![true; sightings.len()];
    for &margin_s in margins_s {
        let problem = TargetProblem::whitened(sightings, robot, noise, &state).within(margin_s, &state);
        (used, scale) = problem.fitting(&state, scale);
        let problem = problem.keeping(&used);
        used.clone_from(&problem.used);
        let count = problem.used.iter().filter(|u| **u).count();
        if count < FEWEST {
            return Err(Error::TooFewPictures { found: count, needed: FEWEST });
        }
        let solved = solve(&problem, state, problem.held(), &SolveOptions::default());
        state = solved.map_err(|_| Error::NoPose)?.state;
    }
    Ok((state, TargetProblem::whitened(sightings, robot, noise, &state).keeping(&used)))
}

impl<'a, S: Sighting> TargetProblem<'a, S> {
    /// The whitening of a sighting's residual: WᵀW is the inverse of its covariance.
    pub(crate) fn whitening(&self, k: usize) -> &Matrix6<f64> {
        &self.whitening[k]
    }

    /// One sighting.
    pub(crate) fn sighting(&self, k: usize) -> &S {
        &self.sightings[k]
    }

    /// The problem with the noise as it acts at `at`; pictures without a robot pose there do not count.
    #[must_use]
    pub fn whitened(sightings: &'a [S], robot: RobotPath<'a>, noise: &ErrorModel, at: &Unknowns) -> Self {
        let whitening: Vec<Option<Matrix6<f64>>> = (0..sightings.len())
            .map(|k| whitening(&sightings[k], &robot.at(k, at.time_offset_s)?, noise, at))
            .collect();
        Self {
            sightings,
            robot,
            carries: noise.carries,
            used: whitening.iter().map(Option::is_some).collect(),
            whitening: whitening.into_iter().map(Option::unwrap_or_default).collect(),
        }
    }

    pub(crate) fn keeping(mut self, used: &[bool]) -> Self {
        for (own, other) in self.used.iter_mut().zip(used) {
            *own = *own && *other;
        }
        self
    }

    /// Without the sightings that have no known robot pose everywhere within a margin, s, of the offset.
    fn within(mut self, margin_s: f64, at: &Unknowns) -> Self {
        if self.robot.has_time_offset() {
            for (k, used) in self.used.iter_mut().enumerate() {
                let known = |s: f64| self.robot.at(k, at.time_offset_s + s).is_some();
                *used = *used && known(margin_s) && known(-margin_s);
            }
        }
        self
    }

    /// Unknowns that are not estimated.
    pub(crate) fn held(&self) -> &'static [usize] {
        if self.robot.has_time_offset() { &[] } else { &[TIME_OFFSET] }
    }

    /// Which pictures fit, and the scale of their squares; the scale only falls from round to round.
    pub(crate) fn fitting(&self, at: &Unknowns, last_scale: f64) -> (Vec<bool>, f64) {
        let squares: Vec<f64> = (0..self.sightings.len())
            .map(|k| self.residual(k, at).map_or(f64::INFINITY, |r| r.norm_squared()))
            .collect();
        let counting = (0..squares.len()).filter(|k| self.used[*k]).map(|k| squares[k]);
        let mut sorted: Vec<f64> = counting.filter(|s| s.is_finite()).collect();
        sorted.sort_by(f64::total_cmp);
        let median = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
        let scale = (median / MEDIAN_SQUARED).max(1.0).min(last_scale);
        (squares.iter().map(|s| *s <= OUTLIER_SQUARED * scale).collect(), scale)
    }

    /// Seen less predicted, rad and m; `None` where the robot's pose is not known.
    pub(crate) fn difference(&self, k: usize, at: &Unknowns) -> Option<Vector6<f64>> {
        let tool = self.robot.at(k, at.time_offset_s)?;
        let predicted = predicted(&tool, at);
        let seen = self.sightings[k].camera_from_target();
        let (turn, shift) = se3::difference_decoupled(seen, &predicted);
        Some(Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z))
    }

    /// The same, whitened.
    pub(crate) fn residual(&self, k: usize, at: &Unknowns) -> Option<Vector6<f64>> {
        Some(self.whitening[k] * self.difference(k, at)?)
    }

    fn concluded(self, state: Unknowns) -> Result<BoardFit, Error> {
        let mut equations = NormalEquations::zeros(SIZE);
        self.linearize(&state, &mut equations);
        let information = Information::new(&equations.hessian, self.held(), SEEN).ok_or(Error::NotFixed)?;
        if information.rank() < information.size() {
            let without = Information::new(&equations.hessian, &[TIME_OFFSET], SEEN);
            let is_offset = without.is_some_and(|without| without.rank() == without.size());
            return Err(if is_offset { Error::TimeOffsetNotFixed } else { Error::HandEyeNotFixed });
        }
        let inverse = information.covariance();
        let inverse = SMatrix::<f64, SIZE, SIZE>::from_fn(|i, j| inverse[(i, j)]);
        // Residuals move with the sightings, these with the camera.
        let mut pull = SMatrix::<f64, SIZE, CAMERA_SIZE>::zeros();
        for k in (0..self.sightings.len()).filter(|k| self.used[*k]) {
            let Some((_, jacobian)) = self.linearized(k, &state) else { continue };
            if let Some(d_camera) = self.sightings[k].d_camera() {
                pull += jacobian.transpose() * self.whitening[k] * d_camera;
            }
        }
        let freedom = (6 * self.used.iter().filter(|u| **u).count()) as f64 - information.size() as f64;
        let squares_per_freedom = 2.0 * equations.cost / freedom;
        let shifts: Vec<f64> = (0..self.sightings.len())
            .filter(|k| self.used[*k])
            .filter_map(|k| Some(self.difference(k, &state)?.fixed_rows::<3>(3).norm_squared()))
            .collect();
        let shift_rms_m = (shifts.iter().sum::<f64>() / shifts.len().max(1) as f64).sqrt();
        Ok(BoardFit {
            unknowns: state,
            covariance: inverse * squares_per_freedom.max(1.0),
            d_camera: -inverse * pull,
            residuals: (0..self.sightings.len()).map(|k| self.residual(k, &state)).collect(),
            used: self.used,
            squares_per_freedom,
            shift_rms_m,
        })
    }

    /// The tool at the exposure of a picture; `None` without a recorded pose.
    pub(super) fn tool(&self, k: usize, time_offset_s: f64) -> Option<ToolState> {
        self.robot.at(k, time_offset_s)
    }

    /// How the whitened residual of a picture follows the time offset, with the tool in this state.
    pub(super) fn whitened_time_derivative(
        &self,
        k: usize,
        tool: &ToolState,
        at: &Unknowns,
    ) -> Option<Vector6<f64>> {
        let seen = self.sightings.get(k)?.camera_from_target();
        Some(self.whitening[k] * derivative(seen, tool, at).column(TIME_OFFSET))
    }

    /// Whitened residual of a picture and its derivative.
    pub(crate) fn linearized(
        &self,
        k: usize,
        at: &Unknowns,
    ) -> Option<(Vector6<f64>, SMatrix<f64, 6, SIZE>)> {
        let tool = self.robot.at(k, at.time_offset_s)?;
        let seen = self.sightings[k].camera_from_target();
        let jacobian = derivative(seen, &tool, at);
        Some((self.residual(k, at)?, self.whitening[k] * jacobian))
    }

    /// Derivative of the estimate with a covariance (in units of the whitening) by an error of the robot's pose at a
    /// sighting; `None` if the sighting does not count.
    pub(crate) fn d_robot(
        &self,
        k: usize,
        at: &Unknowns,
        covariance: &SMatrix<f64, SIZE, SIZE>,
    ) -> Option<SMatrix<f64, SIZE, 6>> {
        let (_, jacobian) = self.linearized(k, at)?;
        Some(covariance * jacobian.transpose() * self.whitened_robot(k, at)?)
    }

    /// Effect of an error of the robot's pose at a sighting on the prediction, whitened; `None` if the sighting does not count. A tool that
    /// moves sees the target move the other way.
    pub(crate) fn whitened_robot(&self, k: usize, at: &Unknowns) -> Option<Matrix6<f64>> {
        let tool = self.robot.at(k, at.time_offset_s).filter(|_| self.used[k])?;
        Some(-self.whitening[k] * robot_derivative(&tool, self.carries, at))
    }
}

impl<S: Sighting> LeastSquares for TargetProblem<'_, S> {
    type State = Unknowns;

    fn dimension(&self) -> usize {
        SIZE
    }

    fn retract(&self, state: &Unknowns, step: &DVector<f64>) -> Unknowns {
        let moved = |pose: &Pose, first: usize| {
            let (turn, shift) = (step.fixed_rows::<3>(first).into(), step.fixed_rows::<3>(first + 3).into());
            se3::retract_decoupled(pose, &turn, &shift)
        };
        Unknowns {
            time_offset_s: state.time_offset_s + step[TIME_OFFSET],
            tool_from_camera: moved(&state.tool_from_camera, HAND_EYE),
            base_from_target: moved(&state.base_from_target, TARGET),
        }
    }

    fn cost(&self, state: &Unknowns) -> f64 {
        let counting = (0..self.sightings.len()).filter(|k| self.used[*k]);
        counting.map(|k| self.residual(k, state).map_or(f64::INFINITY, |r| 0.5 * r.norm_squared())).sum()
    }

    fn linearize(&self, state: &Unknowns, equations: &mut NormalEquations) {
        let (mut hessian, mut gradient) =
            (SMatrix::<f64, SIZE, SIZE>::zeros(), SVector::<f64, SIZE>::zeros());
        for k in (0..self.sightings.len()).filter(|k| self.used[*k]) {
            let Some((residual, jacobian)) = self.linearized(k, state) else {
                equations.cost = f64::INFINITY;
                return;
            };
            hessian += jacobian.transpose() * jacobian;
            gradient += jacobian.transpose() * residual;
            equations.cost += 0.5 * residual.norm_squared();
        }
        equations.hessian += DMatrix::from_iterator(SIZE, SIZE, hessian.iter().copied());
        equations.gradient += DVector::from_column_slice(gradient.as_slice());
    }
}
