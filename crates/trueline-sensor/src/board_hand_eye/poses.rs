//! Time offset, hand-eye transform and target from poses that any detector or tracker reports, from nothing.
//!
//! ```text
//! offsets (angles turned) ──▶ starts (closed forms over few) ──▶ joint fit and noise, in turn ──▶ the best, its rival, what is hidden
//! ```
//!
//! If no noise is stated it is estimated with the rest, by restricted maximum likelihood. It is separate for rotation and
//! translation and, with enough sightings, for directions across the camera's view and along it, where a camera is worse
//! \[Patterson1971\].

use super::hidden::{self, Hidden};
use super::joint::{
    ErrorModel, FEWEST, OUTLIER_SQUARED, ROUND_MARGINS_S, SIZE, TargetProblem, Unknowns, converged,
};
use super::lasting_motion;
use super::noise_of_sightings::{Groups, at_start, estimated};
use super::pose_sighting::{PoseSighting, ReportedPose};
use super::robot_path::RobotPath;
use super::scale::{self, Scale, Step};
use super::start::{self, Few};
use crate::error::Error;
use nalgebra::{RowVector6, SMatrix, Vector6};
use trueline_geometry::Pose;
use trueline_geometry::statistics::lasting;
use trueline_lsq::{LeastSquares, NormalEquations};

/// Range of the search for the time offset, s.
pub const REACH_S: f64 = 2.0;
/// Offsets that are fitted.
const CANDIDATES: usize = 4;
/// Rounds of fit and noise: for the choice between candidates, and for the answer.
const ROUNDS: [usize; 2] = [4, 25];
/// Number of sightings for the choice between starts.
const FEW: usize = 60;
/// Steps of the scale: it enters the residuals linearly, so the second is only as long as the noise changed.
const MOST_SCALES: usize = 20;
/// The noise is found once it changes by less than this part.
const SETTLED: f64 = 2e-3;
/// Answers with offsets closer than this are one, s.
pub(crate) const ONE_OFFSET_S: f64 = 0.03;
/// Beyond this z the better of two offsets is better by more than chance.
const DECISIVE_Z: f64 = 5.0;

/// The prior.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseOptions {
    /// The search range of the time offset is plus and minus this, s.
    pub reach_s: f64,
    /// Start: time offset, s, and `tool_from_camera`.
    pub guess: Option<(f64, Pose)>,
}

impl Default for PoseOptions {
    fn default() -> Self {
        Self { reach_s: REACH_S, guess: None }
    }
}

/// Result of the fit. With a camera beside the robot `tool_from_camera` is `base_from_camera`, and `base_from_target`
/// is `tool_from_target`.
#[derive(Clone, Debug)]
pub struct PoseFit {
    /// The estimate.
    pub unknowns: Unknowns,
    /// Covariance from noise, in the order of [`super::joint::TIME_OFFSET`], [`super::joint::HAND_EYE`],
    /// [`super::joint::TARGET`]; zero for an offset held fixed, and very large along hidden directions. If residuals are
    /// larger than stated, or lasting, it is scaled up to them.
    pub covariance: SMatrix<f64, SIZE, SIZE>,
    /// Directions that the motion does not determine.
    pub hidden: Hidden,
    /// Derivative of the estimate by an error of the robot's pose at each counting sighting: rotation and shift in the axes
    /// of the body that the noise turns, rad and m.
    pub d_robot: Vec<Option<SMatrix<f64, SIZE, 6>>>,
    /// Which sightings count.
    pub used: Vec<bool>,
    /// Sightings without a pose of the robot about them.
    pub unplaced: usize,
    /// Whitened length of each residual; `None` without a pose of the robot.
    pub residuals: Vec<Option<f64>>,
    /// Standard deviations of a sighting about and along the camera's axes, rad and m: estimated, or the mean of the stated
    /// ones.
    pub sigma: Vector6<f64>,
    /// Whether they are stated.
    pub sigma_is_stated: bool,
    /// Sum of squared residuals by its freedom: one if the noise is as stated or estimated.
    pub squares_per_freedom: f64,
    /// By how much lasting residuals raise the variance.
    pub lasting: f64,
    /// Root mean square distance of the target from its prediction, m.
    pub rms_m: f64,
    /// Root mean square angle, rad.
    pub rms_rad: f64,
    /// The next best answer.
    pub runner_up: Option<OtherOffset>,
    /// Scale of the sightings, where it is certainly not one. The answer is in the robot's lengths.
    pub scale: Option<Scale>,
}

impl PoseFit {
    /// The same with the scale estimated beside everything else.
    fn beside_scale(
        mut self,
        factor: f64,
        step: &Step,
        d_robot: impl Fn(usize) -> Option<RowVector6<f64>>,
    ) -> Self {
        let widened = self.squares_per_freedom.max(1.0) * self.lasting;
        self.covariance += step.follows * step.follows.transpose() * (step.variance * widened);
        let by_robot: Vec<Option<RowVector6<f64>>> = (0..self.d_robot.len()).map(d_robot).collect();
        for (all, of_scale) in self.d_robot.iter_mut().zip(&by_robot) {
            if let (Some(all), Some(of_scale)) = (all, of_scale) {
                *all += step.follows * of_scale;
            }
        }
        let d_robot = by_robot.into_iter().map(|row| row.map(|row| row * factor)).collect();
        self.scale = Some(Scale { factor, sigma: factor * (step.variance * widened).sqrt(), d_robot });
        self
    }
}

/// Another answer, which explains the sightings less well.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OtherOffset {
    /// The offset, s.
    pub time_offset_s: f64,
    /// How far its hand-eye transform is turned from the best, rad.
    pub turn_rad: f64,
    /// Part of the sightings that it explains.
    pub explains: f64,
    /// The same of the best.
    pub best_explains: f64,
    /// Sum of the differences of capped squares, in its standard deviations.
    pub z: f64,
}

impl OtherOffset {
    /// Whether it is worse by more than chance.
    #[must_use]
    pub fn is_decided(&self) -> bool {
        self.z > DECISIVE_Z
    }
}

/// Estimates all unknowns from sightings (in the order of the path's stamps) of a fixed target. If the robot carries the
/// target before a fixed camera, the path is `tool_from_base`. The scale of the sightings is estimated too where it is certainly not one.
///
/// # Errors
/// Too few sightings, streams without time in common, or poses that have nothing to do with each other.
pub fn calibrate(
    reported: &[ReportedPose],
    robot: RobotPath<'_>,
    noise: &ErrorModel,
    options: &PoseOptions,
) -> Result<PoseFit, Error> {
    let scan = Scan { reported, robot, noise: *noise };
    if reported.len() < FEWEST {
        return Err(Error::TooFewSightings { found: reported.len(), needed: FEWEST });
    }
    let as_reported = scan.best(options);
    let offset_s = match &as_reported {
        Ok((best, _)) => best.state.time_offset_s,
        Err(_) => scan.offsets_s(options)?.first().copied().unwrap_or(0.0),
    };
    if let Some(fit) = scan.with_scale(offset_s, options) {
        return Ok(fit);
    }
    let (best, runner_up) = as_reported?;
    Ok(PoseFit { runner_up, ..scan.concluded(&best)? })
}

/// An answer with the noise of sightings that it was found with.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    state: Unknowns,
    sigma: Vector6<f64>,
}

#[derive(Clone, Copy)]
struct Scan<'a> {
    reported: &'a [ReportedPose],
    robot: RobotPath<'a>,
    noise: ErrorModel,
}

impl Scan<'_> {
    /// The best answer, and the next best at another time offset.
    fn best(&self, options: &PoseOptions) -> Result<(Candidate, Option<OtherOffset>), Error> {
        let mut candidates: Vec<Candidate> = Vec::new();
        let mut why = Error::NoPose;
        for offset_s in self.offsets_s(options)? {
            match self.candidate(offset_s, options.guess) {
                Ok(candidate) => candidates.push(candidate),
                Err(error) => why = error,
            }
        }
        let better = |a, b| if self.is_better(&b, &a) { b } else { a };
        let best = candidates.iter().copied().reduce(better).ok_or(why)?;
        let best = self.settled(best.state, Some(best.sigma), ROUNDS[1])?;
        let is_other =
            |other: &&Candidate| (other.state.time_offset_s - best.state.time_offset_s).abs() > ONE_OFFSET_S;
        let others = candidates.iter().filter(is_other);
        let runner_up =
            others.filter_map(|other| self.other_offset(&best, other)).min_by(|a, b| a.z.total_cmp(&b.z));
        Ok((best, runner_up))
    }

    /// The answer with another scale of the sightings; `None` if it is not certain that they have one.
    fn with_scale(&self, offset_s: f64, options: &PoseOptions) -> Option<PoseFit> {
        let few = Few::of(&self.sightings(&Vector6::repeat(1.0)), &self.robot, offset_s);
        let mut factor = few.scale().filter(|factor| scale::is_worth_a_fit(*factor))?;
        let reported = scale::scaled(self.reported, factor);
        let (mut best, runner_up) = Scan { reported: &reported, ..*self }.best(options).ok()?;
        for _ in 0..MOST_SCALES {
            let reported = scale::scaled(self.reported, factor);
            let scan = Scan { reported: &reported, ..*self };
            best = scan.settled(best.state, Some(best.sigma), ROUNDS[1]).ok()?;
            let sightings = scan.sightings(&best.sigma);
            let (state, problem) =
                converged(&sightings, self.robot, &self.noise, best.state, &ROUND_MARGINS_S[3..]).ok()?;
            let step = scale::step(&problem, &state)?;
            if step.by.abs() < SETTLED * step.variance.sqrt() {
                let fit = PoseFit { runner_up, ..scan.concluded(&best).ok()? };
                let fit = fit.beside_scale(factor, &step, |k| scale::d_robot(&problem, &state, &step, k));
                return fit.scale.as_ref().is_some_and(Scale::is_certain).then_some(fit);
            }
            factor *= step.by.exp();
        }
        None
    }

    fn is_stated(&self) -> bool {
        self.reported.iter().all(|reported| reported.sigma.is_some())
    }

    fn sightings(&self, sigma: &Vector6<f64>) -> Vec<PoseSighting> {
        self.reported.iter().map(|reported| PoseSighting::of(reported, sigma)).collect()
    }

    /// The offsets to start from.
    fn offsets_s(&self, options: &PoseOptions) -> Result<Vec<f64>, Error> {
        match options.guess {
            Some((guessed_s, _)) => return Ok(vec![guessed_s]),
            None if !self.robot.has_time_offset() => return Ok(vec![0.0]),
            None => {}
        }
        let sightings = self.sightings(&Vector6::repeat(1.0));
        let found = start::offsets_s(&sightings, &self.robot, options.reach_s, CANDIDATES);
        if found.is_empty() { Err(Error::NoCommonTime) } else { Ok(found) }
    }

    /// The answer that is reached from an offset.
    fn candidate(&self, offset_s: f64, guess: Option<(f64, Pose)>) -> Result<Candidate, Error> {
        let few = Few::of(&self.sightings(&Vector6::repeat(1.0)), &self.robot, offset_s);
        let mut starts: Vec<Unknowns> = match guess {
            Some((_, tool_from_camera)) => few.with_hand_eye(tool_from_camera).into_iter().collect(),
            None => few.by_closed_form().into_iter().collect(),
        };
        if guess.is_none() && (starts.is_empty() || few.turn_about_one_axis()) {
            starts.extend(self.best_of(few.anywhere()));
        }
        let mut best: Option<Candidate> = None;
        let mut why = Error::NoCommonTime;
        for start in starts {
            match self.settled(start, None, ROUNDS[0]) {
                Ok(found) if best.as_ref().is_none_or(|best| self.is_better(&found, best)) => {
                    best = Some(found);
                }
                Ok(_) => {}
                Err(error) => why = error,
            }
        }
        best.ok_or(why)
    }

    /// Of starts all around the one that leads to the smallest residuals over some of the sightings.
    fn best_of(&self, starts: Vec<Unknowns>) -> Option<Unknowns> {
        let stride = self.reported.len().div_ceil(FEW).max(1);
        let reported: Vec<ReportedPose> = self.reported.iter().step_by(stride).copied().collect();
        let stamps_s: Vec<f64> = self.robot.stamps_s().iter().step_by(stride).copied().collect();
        let poses: Vec<Pose> = self.robot.stops().iter().step_by(stride).copied().collect();
        let scan =
            Scan { reported: &reported, robot: self.robot.at_others(&stamps_s, &poses), noise: self.noise };
        let reached = |start: Unknowns| {
            let unit = scan.sightings(&Vector6::repeat(1.0));
            let sightings = scan.sightings(&at_start(&unit, scan.robot, &start)?);
            let fitted = converged(&sightings, scan.robot, &scan.noise, start, &ROUND_MARGINS_S[..1]);
            let (state, _) = fitted.ok()?;
            Some((at_start(&unit, scan.robot, &state)?.map(f64::ln).sum(), state))
        };
        let all = starts.into_iter().filter_map(reached);
        all.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, state)| state)
    }

    /// Fit and noise in turn.
    fn settled(
        &self,
        start: Unknowns,
        sigma: Option<Vector6<f64>>,
        rounds: usize,
    ) -> Result<Candidate, Error> {
        let mut state = start;
        let mut sigma = match sigma {
            Some(sigma) => sigma,
            None => at_start(&self.sightings(&Vector6::repeat(1.0)), self.robot, &state)
                .ok_or(Error::NoCommonTime)?,
        };
        let groups = Groups::for_count(self.reported.len());
        for round in 0..rounds {
            let sightings = self.sightings(&sigma);
            let margins_s = if round == 0 { &ROUND_MARGINS_S[..] } else { &ROUND_MARGINS_S[3..] };
            let fitted = converged(&sightings, self.robot, &self.noise, state, margins_s);
            let (found, problem) = fitted.map_err(Error::of_sightings)?;
            state = found;
            if self.is_stated() {
                break;
            }
            let next = estimated(&problem, &state, &sigma, groups).ok_or(Error::NotFixed)?;
            let change = next.component_div(&sigma).map(|ratio| (ratio - 1.0).abs()).max();
            sigma = next;
            if change < SETTLED {
                break;
            }
        }
        Ok(Candidate { state, sigma })
    }

    /// Squared whitened residuals at an answer, at most those of outliers; `None` without a pose of the robot.
    fn capped(&self, state: &Unknowns, sigma: &Vector6<f64>) -> Vec<Option<f64>> {
        let sightings = self.sightings(sigma);
        let problem = TargetProblem::whitened(&sightings, self.robot, &self.noise, state);
        let capped = |k| Some(problem.residual(k, state)?.norm_squared().min(OUTLIER_SQUARED));
        (0..sightings.len()).map(capped).collect()
    }

    /// Differences of capped squares, `b` less `a`, where both have a pose of the robot; by the noise of whichever has less.
    fn differences(&self, a: &Candidate, b: &Candidate) -> Vec<f64> {
        let size = |candidate: &Candidate| candidate.sigma.map(f64::ln).sum();
        let sigma = if size(a) <= size(b) { &a.sigma } else { &b.sigma };
        let pair = (self.capped(&a.state, sigma), self.capped(&b.state, sigma));
        pair.0.into_iter().zip(pair.1).filter_map(|(a, b)| Some(b? - a?)).collect()
    }

    fn is_better(&self, a: &Candidate, b: &Candidate) -> bool {
        self.differences(a, b).iter().sum::<f64>() > 0.0
    }

    fn other_offset(&self, best: &Candidate, other: &Candidate) -> Option<OtherOffset> {
        let differences = self.differences(best, other);
        let explained = |candidate: &Candidate| {
            let all = self.capped(&candidate.state, &best.sigma);
            all.iter().flatten().filter(|s| **s < OUTLIER_SQUARED).count() as f64 / all.len() as f64
        };
        Some(OtherOffset {
            time_offset_s: other.state.time_offset_s,
            turn_rad: best.state.tool_from_camera.rotation.angle_to(&other.state.tool_from_camera.rotation),
            explains: explained(other),
            best_explains: explained(best),
            z: paired_z(&differences)?,
        })
    }

    fn concluded(&self, best: &Candidate) -> Result<PoseFit, Error> {
        let sightings = self.sightings(&best.sigma);
        let (state, problem) =
            converged(&sightings, self.robot, &self.noise, best.state, &ROUND_MARGINS_S[3..])
                .map_err(Error::of_sightings)?;
        let mut equations = NormalEquations::zeros(SIZE);
        problem.linearize(&state, &mut equations);
        let residuals: Vec<Option<Vector6<f64>>> =
            (0..sightings.len()).map(|k| problem.residual(k, &state)).collect();
        let counting: Vec<Vector6<f64>> =
            (0..sightings.len()).filter(|k| problem.used[*k]).filter_map(|k| residuals[k]).collect();
        let freedom = (6 * counting.len()) as f64 - (SIZE - problem.held().len()) as f64;
        let squares_per_freedom = 2.0 * equations.cost / freedom;
        let lasting = lasting(&counting, Vector6::dot);
        let factor = squares_per_freedom.max(1.0) * lasting;
        let information = SMatrix::<f64, SIZE, SIZE>::from_fn(|i, j| equations.hessian[(i, j)] / factor);
        let of_time = lasting_motion::time_information(&problem, &state) / factor;
        let (hidden, covariance) =
            hidden::assess(&information, of_time, problem.held()).ok_or(Error::NotFixed)?;
        let differences: Vec<Vector6<f64>> = (0..sightings.len())
            .filter(|k| problem.used[*k])
            .filter_map(|k| problem.difference(k, &state))
            .collect();
        let rms = |first: usize| {
            let sum: f64 = differences.iter().map(|d| d.fixed_rows::<3>(first).norm_squared()).sum();
            (sum / differences.len().max(1) as f64).sqrt()
        };
        let (rms_rad, rms_m) = (rms(0), rms(3));
        Ok(PoseFit {
            d_robot: (0..sightings.len())
                .map(|k| problem.d_robot(k, &state, &(covariance / factor)))
                .collect(),
            unknowns: state,
            covariance,
            hidden,
            unplaced: residuals.iter().filter(|residual| residual.is_none()).count(),
            residuals: residuals.iter().map(|r| r.map(|r| r.norm())).collect(),
            sigma: self.sigma_of(best),
            sigma_is_stated: self.is_stated(),
            squares_per_freedom,
            lasting,
            rms_m,
            rms_rad,
            runner_up: None,
            scale: None,
            used: problem.used,
        })
    }

    /// The noise of a sighting: the estimated one, or the root mean square of the stated ones.
    fn sigma_of(&self, best: &Candidate) -> Vector6<f64> {
        if !self.is_stated() {
            return best.sigma;
        }
        let mean = |part: usize| {
            let squares = self.reported.iter().filter_map(|r| r.sigma).map(|s| s[part].powi(2)).sum::<f64>();
            (squares / self.reported.len() as f64).sqrt()
        };
        let (turn, shift) = (mean(0), mean(1));
        Vector6::new(turn, turn, turn, shift, shift, shift)
    }
}

/// The sum of differences in its standard deviations. `None` without differences. Correlated neighbours count as fewer.
pub(crate) fn paired_z(differences: &[f64]) -> Option<f64> {
    let count = differences.len() as f64;
    let sum: f64 = differences.iter().sum();
    let deviations: Vec<f64> = differences.iter().map(|d| d - sum / count).collect();
    let variance: f64 = deviations.iter().map(|d| d * d).sum();
    let lasting = lasting(&deviations, |a, b| a * b);
    (count > 0.0).then(|| sum / (variance * lasting).sqrt().max(f64::MIN_POSITIVE))
}
