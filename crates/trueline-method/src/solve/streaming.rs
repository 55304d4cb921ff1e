//! A calibration that grows with the scan: each image moves the estimate and its covariance at once.
//!
//! The sums of the Gauss–Newton step are kept at one linearisation point; a new image adds its part, and the estimate is
//! one step from there. That costs the same however long the scan is. As the estimate moves away from the point it
//! becomes approximate; [`Streaming::relinearise`] solves anew over everything so far, and is then the batch solution.

use crate::assess::observability::RANK_THRESHOLD;
use crate::error::Error;
use crate::input::noise_levels::NoiseLevels;
use crate::input::observations::{Observation, Observations};
use crate::problem::line_problem::{Criterion, LineProblem};
use crate::problem::parameters::Parameters;
use nalgebra::DMatrix;
use std::collections::VecDeque;
use trueline_geometry::trajectory::TrajectoryError;
use trueline_geometry::{Pose, smooth};
use trueline_lsq::{Information, LeastSquares, NormalEquations, SolveOptions, Termination, solve};

/// A growing scan and what it says so far.
pub struct Streaming {
    observations: Observations,
    /// Poses as recorded that have no full window yet, and their neighbours before.
    recent: VecDeque<(f64, Pose)>,
    /// How many of `recent` are in the trajectory.
    settled: usize,
    waiting: VecDeque<Observation>,
    criterion: Criterion,
    noise: NoiseLevels,
    at: Parameters,
    equations: NormalEquations,
}

/// The estimate after an image.
#[derive(Clone, Debug)]
pub struct Current {
    /// The estimate; directions that are not seen yet stay where the linearisation was.
    pub parameters: Parameters,
    /// Its covariance on what is seen, for the expected noise (SI units).
    pub covariance: DMatrix<f64>,
    /// Directions seen, of all unknowns.
    pub rank: usize,
    /// How far the estimate is from the linearisation, in standard deviations of one unknown on average.
    pub step_sigmas: f64,
    /// Observations that wait for the robot's poses.
    pub waiting: usize,
}

/// An image is placed when the poses reach so far beyond its exposure that no step of the offset takes them away, s.
const MARGIN_S: f64 = 0.005;

impl Streaming {
    /// Goes on from the beginning of a scan and an estimate made from it.
    #[must_use]
    pub fn new(observations: Observations, at: Parameters, criterion: Criterion, noise: NoiseLevels) -> Self {
        let equations = NormalEquations::zeros(at.dimension());
        let mut streaming = Self {
            observations,
            recent: VecDeque::new(),
            settled: 0,
            waiting: VecDeque::new(),
            criterion,
            noise,
            at,
            equations,
        };
        streaming.add_from(0);
        streaming
    }

    /// Adds a robot pose as recorded. It enters the trajectory when its window of the local fit is full.
    ///
    /// # Errors
    /// A time that is not after the last.
    pub fn add_pose(&mut self, time_s: f64, base_from_tool: Pose) -> Result<(), TrajectoryError> {
        if time_s.is_nan() || self.recent.back().is_some_and(|(last_s, _)| time_s <= *last_s) {
            return Err(TrajectoryError::TimeRunsBackwards { index: self.recent.len() });
        }
        self.recent.push_back((time_s, base_from_tool));
        let robot = &self.observations.robot;
        let window_s = if robot.smoothed { robot.half_window_s } else { 0.0 };
        let (times, poses): (Vec<f64>, Vec<Pose>) = self.recent.iter().copied().unzip();
        let gap_limit_s = self.observations.robot.trajectory.gap_limit();
        while self.settled < times.len() && time_s - times[self.settled] >= window_s {
            let pose = if window_s > 0.0 {
                smooth::smoothed(&times, &poses, self.settled, [gap_limit_s, window_s])
            } else {
                poses[self.settled]
            };
            let (_, end_s) = self.observations.robot.trajectory.span();
            if times[self.settled] > end_s {
                self.observations.robot.trajectory.push(times[self.settled], &pose)?;
            }
            self.settled += 1;
        }
        // What no window reaches any more is forgotten.
        while self.settled > 0 && self.recent.front().is_some_and(|(t, _)| time_s - t > 3.0 * window_s) {
            self.recent.pop_front();
            self.settled -= 1;
        }
        Ok(())
    }

    /// Adds the features of an image; stamps rise. The estimate with all images that can be placed so far.
    ///
    /// # Errors
    /// [`Error::NoStart`] if the sums are not finite.
    pub fn add_frame(&mut self, features: &[Observation]) -> Result<Current, Error> {
        self.waiting.extend(features);
        let (_, end_s) = self.observations.robot.trajectory.span();
        let from = self.observations.list.len();
        let placed = |o: &Observation| o.stamp_s - self.at.time_offset_s + MARGIN_S <= end_s;
        let ready = self.waiting.iter().take_while(|o| placed(o)).count();
        self.observations.list.extend(self.waiting.drain(..ready));
        self.add_from(from);
        self.current()
    }

    /// The estimate so far.
    ///
    /// # Errors
    /// As [`Streaming::add_frame`].
    pub fn current(&self) -> Result<Current, Error> {
        let information =
            Information::new(&self.equations.hessian, &[], RANK_THRESHOLD).ok_or(Error::NoStart)?;
        let covariance = information.covariance();
        let step = -(&covariance * &self.equations.gradient);
        let length = step.dot(&(&self.equations.hessian * &step)).max(0.0).sqrt();
        Ok(Current {
            parameters: self.at.retract(&step),
            rank: information.rank(),
            covariance,
            step_sigmas: length / (information.rank().max(1) as f64).sqrt(),
            waiting: self.waiting.len(),
        })
    }

    /// Solves anew over everything so far, from the current estimate; takes time in proportion to the scan.
    ///
    /// # Errors
    /// As [`Streaming::add_frame`].
    pub fn relinearise(&mut self) -> Result<Termination, Error> {
        let start = self.current()?.parameters;
        let observations = &self.observations;
        let problem = LineProblem::new(observations, &observations.list, self.criterion, &self.noise, &start);
        let solution = solve(&problem, start, &[], &SolveOptions::default()).map_err(|_| Error::NoStart)?;
        self.at = solution.state;
        self.equations = solution.equations;
        Ok(solution.termination)
    }

    /// Everything so far.
    #[must_use]
    pub fn observations(&self) -> &Observations {
        &self.observations
    }

    fn add_from(&mut self, from: usize) {
        let list = &self.observations.list[from..];
        let problem = LineProblem::new(&self.observations, list, self.criterion, &self.noise, &self.at);
        problem.linearize(&self.at, &mut self.equations);
    }
}
