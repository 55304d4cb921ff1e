//! Time offset, hand-eye transform and a round target from the cuts of a scan, from nothing.

use super::cut::Cut;
use super::held_out::HeldOut;
use super::model::{Follows, RADIUS, RoundState, SHAPE, SIZE};
use super::problem::{FEWEST, RoundProblem, Scan, converged, rounds};
use super::sheet_frame::SheetFrame;
use super::start;
use super::stop_noise;
use super::target::{RoundTarget, Rows};
use crate::board_hand_eye::lasting_motion::{shared, with_rates_of};
use crate::board_hand_eye::poses::{ONE_OFFSET_S, OtherOffset, PoseFit, REACH_S, paired_z};
use crate::board_hand_eye::stop_noise::scaled;
use crate::board_hand_eye::unknowns::{self, ErrorModel, TIME_OFFSET};
use crate::board_hand_eye::{RobotPath, hidden};
use crate::error::Error;
use nalgebra::{DMatrix, SMatrix, SVector, Vector6};
use trueline_geometry::Pose;
use trueline_geometry::statistics::{lasting, median};
use trueline_lsq::{LeastSquares, NormalEquations};
use trueline_method::input::shape_prior::ShapePrior;

/// Cuts that tell starts apart.
const FEW: usize = 60;
/// Points of each.
const FEW_POINTS: usize = 30;
/// Starts of which all cuts are looked at.
const FITTED: usize = 8;
/// Rounds of a fit to few cuts.
const FEW_ROUNDS: usize = 2;
/// Answers whose hand-eye transforms differ by less than this are one, rad.
const ONE_ATTITUDE_RAD: f64 = 0.1;
/// The radius, where it is not stated, is known to this beforehand, m: it decides nothing.
const ANY_RADIUS_M: f64 = 10.0;

/// What is known beforehand.
#[derive(Clone, Debug)]
pub struct RoundOptions {
    /// What is scanned.
    pub target: RoundTarget,
    /// Where to start a cylinder; a sphere finds its starts itself.
    pub starts: Vec<RoundState>,
    /// The time offset is looked for within plus and minus this, s.
    pub reach_s: f64,
    /// Where to start: time offset, s, and `tool_from_camera`.
    pub guess: Option<(f64, Pose)>,
    /// Radius of the target, m; `None` estimates it.
    pub radius_m: Option<f64>,
    /// The sensor's shape beforehand; `None` holds it.
    pub shape: Option<ShapePrior>,
    /// Covariance of a shape that is held.
    pub held_shape: SMatrix<f64, 5, 5>,
}

impl Default for RoundOptions {
    fn default() -> Self {
        Self {
            target: RoundTarget::Sphere,
            starts: Vec::new(),
            reach_s: REACH_S,
            guess: None,
            radius_m: None,
            shape: None,
            held_shape: SMatrix::zeros(),
        }
    }
}

/// What was found.
#[derive(Clone, Debug)]
pub struct RoundFit {
    /// What was scanned.
    pub target: RoundTarget,
    /// Everything that a sighted target has too. What the target looks the same under is held, and its errors are in its own axes.
    pub pose: PoseFit,
    /// Radius, m: stated or estimated.
    pub radius_m: f64,
    /// Its standard deviation, m; `None` where it is stated.
    pub radius_sigma_m: Option<f64>,
    /// The sensor's shape h₁ … h₅ and its standard deviations; `None` where it is held.
    pub shape: Option<[SVector<f64, 5>; 2]>,
    /// Part of the covariance of a target's unknowns that a shape brings which is held.
    pub of_sensor: SMatrix<f64, { unknowns::SIZE }, { unknowns::SIZE }>,
    /// Errors of cuts that are left out.
    pub held_out: Option<HeldOut>,
    /// Part of the stated errors of the robot at stops that differs from stop to stop, 0 to 1; 1 of a robot that moves.
    pub stop_noise_part: f64,
}

/// Estimates everything from cuts (in the order of the path's stamps) of a target that stands still, or that the robot carries before a
/// sensor that stands still; then the path is `tool_from_base`.
///
/// # Errors
/// Too few cuts, streams without time in common, or cuts that have nothing to do with each other.
pub fn calibrate(
    cuts: &[Cut],
    sheet: &SheetFrame,
    robot: RobotPath<'_>,
    noise: &ErrorModel,
    options: &RoundOptions,
) -> Result<RoundFit, Error> {
    if cuts.len() < FEWEST {
        return Err(Error::TooFewSightings { found: cuts.len(), needed: FEWEST });
    }
    let row = options.target.row();
    let scan = Scan { row, cuts, sheet, robot, noise, radius_m: options.radius_m, shape: options.shape };
    let answers = answers(&scan, options)?;
    let mut fitted: Vec<RoundState> = Vec::new();
    let mut why = Error::NoCommonTime;
    for start in answers.into_iter().take(FITTED) {
        match converged(&scan, start, rounds()) {
            Ok((state, _)) if fitted.iter().all(|other| !is_same(other, &state)) => fitted.push(state),
            Ok(_) => {}
            Err(error) => why = error,
        }
    }
    fitted.sort_by(|a, b| misfit(&scan, a).total_cmp(&misfit(&scan, b)));
    let best = *fitted.first().ok_or(why)?;
    let others = fitted.iter().skip(1).filter_map(|other| rival(&scan, &best, other));
    let runner_up = others.min_by(|a, b| a.z.total_cmp(&b.z));
    let stop_noise_part = stop_noise::part(&scan, &best)?;
    let noise = scaled(noise, stop_noise_part);
    let mut fit = concluded(&Scan { noise: &noise, ..scan }, &best, options)?;
    fit.pose.runner_up = runner_up;
    Ok(RoundFit { stop_noise_part, ..fit })
}

/// Answers that few cuts give from starts all around, each once, the likeliest first.
fn answers(scan: &Scan<'_>, options: &RoundOptions) -> Result<Vec<RoundState>, Error> {
    let stride = scan.cuts.len().div_ceil(FEW).max(1);
    let cuts: Vec<Cut> = scan.cuts.iter().step_by(stride).map(|cut| cut.thinned(FEW_POINTS)).collect();
    let stamps_s: Vec<f64> = scan.robot.stamps_s().iter().step_by(stride).copied().collect();
    let poses: Vec<Pose> = scan.robot.stops().iter().step_by(stride).copied().collect();
    let few = Scan { cuts: &cuts, robot: scan.robot.at_others(&stamps_s, &poses), ..*scan };
    let starts = match &options.guess {
        _ if options.target != RoundTarget::Sphere => options.starts.clone(),
        Some((offset_s, hand_eye)) => start::with_hand_eye(&few, *offset_s, hand_eye).into_iter().collect(),
        None => start::starts(&few, &start::offsets_s(&few, options.reach_s)),
    };
    let mut found: Vec<(f64, RoundState)> = Vec::new();
    let mut why = Error::NoCommonTime;
    for start in starts {
        match converged(&few, start, &rounds()[..FEW_ROUNDS]) {
            Ok((state, _)) => found.push((misfit(&few, &state), state)),
            Err(error) => why = error,
        }
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut each: Vec<RoundState> = Vec::new();
    for (_, state) in found {
        if each.iter().all(|other| !is_same(other, &state)) {
            each.push(state);
        }
    }
    if each.is_empty() { Err(why) } else { Ok(each) }
}

fn is_same(a: &RoundState, b: &RoundState) -> bool {
    (a.unknowns.time_offset_s - b.unknowns.time_offset_s).abs() < ONE_OFFSET_S
        && turn_between(a, b) < ONE_ATTITUDE_RAD
}

fn turn_between(a: &RoundState, b: &RoundState) -> f64 {
    a.unknowns.tool_from_camera.rotation.angle_to(&b.unknowns.tool_from_camera.rotation)
}

/// Squared whitened residuals, no larger than those of outliers; `None` without a pose of the robot.
fn capped<'a>(
    scan: &'a Scan<'_>,
    state: &'a RoundState,
    scale: f64,
) -> impl Iterator<Item = Option<f64>> + 'a {
    let problem = RoundProblem::whitened(scan, state);
    (0..scan.cuts.len()).map(move |k| {
        Some((problem.residual(k, state)?.norm_squared() / scale).min(scan.row.outlier_squared))
    })
}

/// Sum of capped squares; a cut without a pose of the robot counts as an outlier.
fn misfit(scan: &Scan<'_>, state: &RoundState) -> f64 {
    capped(scan, state, 1.0).map(|square| square.unwrap_or(scan.row.outlier_squared)).sum()
}

fn rival(scan: &Scan<'_>, best: &RoundState, other: &RoundState) -> Option<OtherOffset> {
    let scale = [best, other].map(|state| RoundProblem::whitened(scan, state).scale(state));
    let scale = scale[0].min(scale[1]);
    let squares = [best, other].map(|state| capped(scan, state, scale).collect::<Vec<_>>());
    let [of_best, of_other] = &squares;
    let differences: Vec<f64> =
        of_best.iter().zip(of_other).filter_map(|(best, other)| Some((*other)? - (*best)?)).collect();
    let explained = |all: &[Option<f64>]| {
        all.iter().flatten().filter(|square| **square < scan.row.outlier_squared).count() as f64
            / all.len() as f64
    };
    Some(OtherOffset {
        time_offset_s: other.unknowns.time_offset_s,
        turn_rad: turn_between(best, other),
        explains: explained(of_other),
        best_explains: explained(of_best),
        z: paired_z(&differences)?,
    })
}

/// The covariance of all that is estimated, in units of the whitening; zero for what is held.
fn covariance(hessian: &DMatrix<f64>, held: &[usize]) -> Option<SMatrix<f64, SIZE, SIZE>> {
    let free: Vec<usize> = (0..SIZE).filter(|k| !held.contains(k)).collect();
    // A radian, a metre and a shape differ by orders: scaled to a unit diagonal first.
    let scale: Vec<f64> =
        free.iter().map(|k| hessian[(*k, *k)].max(f64::MIN_POSITIVE).sqrt().recip()).collect();
    let scaled = DMatrix::from_fn(free.len(), free.len(), |i, j| {
        hessian[(free[i], free[j])] * scale[i] * scale[j] + if i == j { LEAST_INFORMATION } else { 0.0 }
    });
    let inverse = scaled.cholesky()?.inverse();
    let mut covariance = SMatrix::<f64, SIZE, SIZE>::zeros();
    for (i, row) in free.iter().enumerate() {
        for (j, column) in free.iter().enumerate() {
            covariance[(*row, *column)] = inverse[(i, j)] * scale[i] * scale[j];
        }
    }
    Some(covariance)
}

/// Part of an unknown's own information that is added to it: what is hidden has a covariance that is very large, and finite.
const LEAST_INFORMATION: f64 = 1e-12;

/// Information about what a sighted target has, where radius and shape are estimated with it.
fn of_target(
    hessian: &DMatrix<f64>,
    held: &[usize],
) -> Option<SMatrix<f64, { unknowns::SIZE }, { unknowns::SIZE }>> {
    let beside: Vec<usize> = (RADIUS..SIZE).filter(|k| !held.contains(k)).collect();
    let own = DMatrix::from_fn(beside.len(), beside.len(), |i, j| hessian[(beside[i], beside[j])]);
    let shares = DMatrix::from_fn(beside.len(), unknowns::SIZE, |i, j| hessian[(beside[i], j)]);
    let taken = if beside.is_empty() {
        DMatrix::zeros(unknowns::SIZE, unknowns::SIZE)
    } else {
        shares.transpose() * own.cholesky()?.solve(&shares)
    };
    Some(SMatrix::from_fn(|i, j| hessian[(i, j)] - taken[(i, j)]))
}

fn concluded(scan: &Scan<'_>, best: &RoundState, options: &RoundOptions) -> Result<RoundFit, Error> {
    let (state, problem) = converged(scan, *best, rounds())?;
    let mut equations = NormalEquations::zeros(SIZE);
    problem.linearize(&state, &mut equations);
    if scan.radius_m.is_none() {
        equations.hessian[(RADIUS, RADIUS)] += ANY_RADIUS_M.powi(-2);
    }
    let held = scan.held();
    let held_of_target: Vec<usize> = held.iter().copied().filter(|k| *k < RADIUS).collect();
    let residuals: Vec<Option<Rows>> = (0..scan.cuts.len()).map(|k| problem.residual(k, &state)).collect();
    let counting: Vec<Rows> = problem.counting().filter_map(|k| residuals[k]).collect();
    let freedom = scan.freedom(counting.len());
    let squares_per_freedom = 2.0 * equations.cost / freedom;
    let lasting = if scan.robot.stamps_s().is_empty() { 1.0 } else { lasting(&counting, Rows::dot) };
    let factor = squares_per_freedom.max(1.0) * lasting;
    let information = of_target(&equations.hessian, &held).ok_or(Error::NotFixed)? / factor;
    let with_rates = |k: usize, shift_s: f64| {
        let tool = scan.robot.at(k, state.unknowns.time_offset_s)?;
        let tool = with_rates_of(&tool, &scan.robot.at(k, state.unknowns.time_offset_s + shift_s)?);
        Some(problem.whitening[k] * scan.follows(k, &tool, &state).unknowns.column(TIME_OFFSET))
    };
    let of_time = shared(problem.counting(), with_rates) / factor;
    let (hidden, of_noise) =
        hidden::assess(&information, of_time, &held_of_target).ok_or(Error::HandEyeNotFixed)?;
    let all = covariance(&equations.hessian, &held).ok_or(Error::HandEyeNotFixed)?;
    let sigma = |k: usize| (all[(k, k)] * factor).sqrt();
    let shape_sigma = SVector::<f64, 5>::from_fn(|k, _| sigma(SHAPE + k));
    let held_out = HeldOut::of(&problem, &state, &all, factor);
    let pose = PoseFit {
        unknowns: state.unknowns,
        covariance: of_noise,
        hidden,
        d_robot: (0..scan.cuts.len()).map(|k| d_robot(&problem, k, &state, &all)).collect(),
        unplaced: residuals.iter().filter(|residual| residual.is_none()).count(),
        residuals: residuals.iter().map(|r| r.map(|r| r.norm())).collect(),
        sigma: noise(scan.cuts),
        sigma_is_stated: false,
        squares_per_freedom,
        lasting,
        rms_m: held_out.map_or(0.0, |held_out| held_out.fitted_rms_m),
        rms_rad: 0.0,
        runner_up: None,
        scale: None,
        used: problem.used,
    };
    Ok(RoundFit {
        target: options.target,
        pose,
        radius_m: state.radius_m,
        radius_sigma_m: scan.radius_m.is_none().then(|| sigma(RADIUS)),
        shape: scan.shape.map(|_| [state.shape, shape_sigma]),
        of_sensor: of_held_shape(&equations.hessian, &all, &options.held_shape),
        held_out,
        stop_noise_part: 1.0,
    })
}

/// What the target's unknowns owe to a shape that is held and uncertain: S P Sᵀ with S = −C JᵀJ_s.
fn of_held_shape(
    hessian: &DMatrix<f64>,
    covariance: &SMatrix<f64, SIZE, SIZE>,
    held: &SMatrix<f64, 5, 5>,
) -> SMatrix<f64, { unknowns::SIZE }, { unknowns::SIZE }> {
    let shares = SMatrix::<f64, SIZE, 5>::from_fn(|i, j| hessian[(i, SHAPE + j)]);
    let follows = covariance.fixed_rows::<{ unknowns::SIZE }>(0) * shares;
    follows * held * follows.transpose()
}

/// How the estimate follows an error of the robot's pose at a cut; `None` of one that does not count.
fn d_robot(
    problem: &RoundProblem<'_>,
    k: usize,
    at: &RoundState,
    covariance: &SMatrix<f64, SIZE, SIZE>,
) -> Option<SMatrix<f64, { unknowns::SIZE }, 6>> {
    if !problem.used[k] {
        return None;
    }
    let scan = &problem.scan;
    let tool = scan.tool(k, at)?;
    let Follows { unknowns, robot, .. } = scan.follows(k, &tool, at);
    let information = problem.whitening[k].transpose() * problem.whitening[k];
    let follows = -covariance * unknowns.transpose() * information * robot;
    Some(follows.fixed_rows::<{ unknowns::SIZE }>(0).into_owned())
}

/// Medians of the noise of cuts in the place of a sighting's: across the sheet's first axis, its second, and the radius, m.
fn noise(cuts: &[Cut]) -> Vector6<f64> {
    let of = |k: usize| median(cuts.iter().map(|cut| cut.sigma_m()[k])).unwrap_or(0.0);
    Vector6::new(0.0, 0.0, 0.0, of(0), of(1), of(2))
}
