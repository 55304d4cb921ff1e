//! The answer of an adjustment: the unknowns, their covariance, and its error budget.

use crate::adjustment::adjust::{Adjusted, Adjustment};
use crate::adjustment::axis_step::{AxisStep, axis_step};
use crate::adjustment::beyond_linear::BeyondLinear;
use crate::adjustment::blocks::{Amplitude, Block, Kind};
use crate::adjustment::clamped::Clamped;
use crate::adjustment::coloured::Coloured;
use crate::adjustment::columns::{Columns, Considered};
use crate::adjustment::error_sizes::Amplitudes;
use crate::adjustment::form::Hats;
use crate::adjustment::frames::{Frame, Scan};
use crate::adjustment::weights::Weights;
use crate::assess::levels::SystematicLevels;
use crate::assess::outliers::Outliers;
use crate::assess::robot_field::{OfRobot, RobotField};
use crate::assess::seam_error::{Share, ShareOf};
use crate::assess::tilt_bias::TiltBias;
use crate::config::ASSUMED_WAVINESS_M;
use crate::models;
use crate::order_statistics::quantile;
use crate::problem::line_problem::LineProblem;
use crate::problem::parameters::Parameters;
use nalgebra::{DMatrix, DVector, Vector3};

/// Spacing (m) of the hats of the long and of the short form of a seam, and the prior share of the waviness in each.
const FORMS: [(f64, f64); 2] = [(0.020, 0.85), (0.005, 0.5)];
/// Largest plausible form of a seam, m.
const LARGEST_FORMS_M: [f64; 2] = [2e-3, 1e-3];
/// Unit of the estimated lag, s.
const UNIT_OF_LAG_S: f64 = 0.03;
/// Prior standard deviation of a lag about each tried value, s.
pub(crate) const LAG_SIGMA_S: f64 = 0.01;
/// Cost of a frame that is left out: that of one at the cut of 5.5 standard deviations.
const LEFT_OUT: f64 = 5.5 * 5.5;
/// Largest robot error, in multiples of its class.
const WORST_ROBOT: f64 = 3.0;
/// Largest robot error of an uncalibrated arm, where the data sheet states less, m.
const WORST_ACCURACY_M: f64 = 1.5e-3;
/// Fraction of a seam's points that may lie beyond each of its ends, as outliers.
const BEYOND: f64 = 0.002;

/// Inputs of an adjustment beside a problem and a state.
#[derive(Clone, Copy)]
pub(crate) struct Settings<'a> {
    /// Components of the tangent that are held.
    pub fixed: &'a [usize],
    /// Held components that are not exactly known, with their standard deviations, SI.
    pub held_sigmas: &'a [(usize, f64)],
    /// Assumed levels of the systematic errors.
    pub levels: SystematicLevels,
    /// Initial RMS of the seam's form beyond its bow, m. 0 for none.
    pub waviness_m: f64,
    /// Ratio of the actual noise to the expected noise by which the problem is whitened.
    pub noise_factor: f64,
    /// A possible step of the clocks: its time, s, and its size, s.
    pub step: Option<(f64, f64)>,
    /// Lag of the robot behind the poses of the problem, as assumed there, s. 0 for none.
    pub lag_s: f64,
    /// Prior standard deviation of the joints' own lags, s. 0 for none.
    pub joint_lags_s: f64,
    /// Passes of a part that moves between them. `None` for a part at rest.
    pub part: Option<&'a Clamped>,
    /// Prior standard deviation of each number of the external axes, SI. Empty without axes.
    pub axis_sigmas: &'a [f64],
    /// Noise of a similar model of the same scan, from which the search of the likeliest noise starts. `None` for a search over all.
    pub noise: Option<[Coloured; 2]>,
    /// Threads that share the work.
    pub threads: usize,
}

impl Settings<'_> {
    /// The same for a similar model of a scan that was adjusted already.
    #[must_use]
    pub(crate) fn near(&self, answer: &Answer) -> Self {
        Self { noise: Some(answer.amplitudes.lasting), ..*self }
    }
}

/// The answer.
pub(crate) struct Answer {
    /// The unknowns.
    pub at: Parameters,
    /// Covariance of the tangent by noise alone.
    pub noise: DMatrix<f64>,
    /// The error budget beside the noise.
    pub shares: Vec<Share>,
    /// Second-order errors of single unknowns, a column of the tangent. They do not affect a seam point.
    pub bends: Option<DVector<f64>>,
    /// Estimated errors.
    pub amplitudes: Amplitudes,
    /// Corrections of the external axes to their assumed values.
    pub axes: Option<AxisStep>,
    /// The robot's errors; `None` of an ideal robot.
    pub field: Option<RobotField>,
    /// The blocks that were estimated beside the unknowns.
    pub blocks: Vec<models::Block>,
    /// Largest shift of the part beside its place in the first pass, m. `None` of a part at rest.
    pub moved_m: Option<f64>,
    /// The stamp of each frame that was used, s, and whether it was left out.
    pub frames: Vec<(f64, bool)>,
    /// Minus twice the log likelihood.
    pub(crate) twice_negative_log: f64,
}

impl Answer {
    /// Whether most frames between two times, s, were left out.
    #[must_use]
    pub(crate) fn leaves_out(&self, [from_s, to_s]: [f64; 2]) -> bool {
        let there = || self.frames.iter().filter(|(stamp_s, _)| (from_s..=to_s).contains(stamp_s));
        2 * there().filter(|(_, is_out)| *is_out).count() > there().count()
    }

    /// Minus twice the log likelihood, including the cost of the frames left out. Answers of one scan are compared by it.
    #[must_use]
    pub(crate) fn comparable(&self) -> f64 {
        self.twice_negative_log + LEFT_OUT * self.amplitudes.out.count as f64
    }

    /// The part of the robot's errors in it; `None` of an ideal robot.
    #[must_use]
    pub(crate) fn of_robot(&self) -> Option<OfRobot> {
        let is_it = |share: &&Share| matches!(share.of, ShareOf::Robot);
        let columns = self.shares.iter().find(is_it)?.columns.clone();
        Some(OfRobot { field: self.field.clone()?, columns })
    }

    /// The total covariance of the tangent.
    #[must_use]
    pub(crate) fn covariance(&self) -> DMatrix<f64> {
        let bends = self.bends.iter().map(|bends| bends * bends.transpose());
        self.shares
            .iter()
            .map(|share| &share.columns * share.columns.transpose())
            .chain(bends)
            .fold(self.noise.clone(), |sum, share| sum + share)
    }
}

/// Adjusts a scan from a state near its optimum. `None` if the equations have no solution.
#[must_use]
pub(crate) fn adjust(problem: &LineProblem<'_>, at: &Parameters, settings: &Settings<'_>) -> Option<Answer> {
    let scan = Scan::of(problem, at);
    let poses = scan.poses(at);
    let tilt = TiltBias::about(&poses);
    let frames = scan.frames(at, &tilt);
    let mut columns = Columns::of(at, settings.fixed, considered(settings, &frames, at.lines.len()));
    let field = RobotField::new(settings.levels.robot, &poses);
    add_blocks(&mut columns, &frames, at.lines.len(), field, settings);
    let coefficients = DVector::zeros(columns.estimated());
    let mut adjustment = Adjustment {
        scan,
        tilt,
        shape_prior: problem.shape_prior,
        columns,
        at: at.clone(),
        coefficients,
        sigmas: [1.0; 2],
        noise: [Coloured::NONE; 2],
        known_noise: settings.noise,
        weights: Weights::default(),
        threads: settings.threads,
    };
    let adjusted = adjustment.run()?;
    let covariance = adjusted.solved.covariance();
    let mut answer = answer(&adjustment, &adjusted, &covariance, settings);
    if let Some(BeyondLinear { wider, bends }) = adjustment.beyond_linear(&covariance) {
        answer.noise += &wider * wider.transpose();
        answer.bends = Some(bends);
    }
    Some(answer)
}

fn considered(settings: &Settings<'_>, frames: &[Option<Frame>], lines: usize) -> Vec<Considered> {
    let held = settings.held_sigmas.iter().map(|(component, sigma)| Considered::Held(*component, *sigma));
    let shape = settings.levels.held_shape.map(Considered::Shape);
    let sigma_m = settings.levels.edge_radius_m;
    let mean_view = (0..lines).map(|line| mean_view(frames, line)).collect();
    let edge = (sigma_m > 0.0).then_some(Considered::EdgeRadius { sigma_m, mean_view });
    held.chain(shape).chain(edge).chain([Considered::SquaredLag(UNIT_OF_LAG_S.powi(2))]).collect()
}

fn add_blocks(
    columns: &mut Columns,
    frames: &[Option<Frame>],
    lines: usize,
    field: Option<RobotField>,
    settings: &Settings<'_>,
) {
    let mut add = |kind: Kind, amplitude: Amplitude| {
        let block = Block::new(kind, columns.estimated(), amplitude);
        columns.blocks.push(block);
    };
    if let Some(field) = field {
        let worst = WORST_ROBOT.max(WORST_ACCURACY_M / settings.levels.robot_accuracy_m);
        add(Kind::Robot(field), Amplitude { theta: 1.0, bounds: [1.0, worst.powi(2)] });
    }
    if let Some((at_s, sigma_s)) = settings.step {
        let stamps: Vec<f64> = frames.iter().flatten().map(|frame| frame.stamp_s).collect();
        let before = stamps.iter().filter(|stamp_s| **stamp_s < at_s).count();
        add(Kind::Step { at_s, is_later: 2 * before >= stamps.len(), sigma_s }, Amplitude::HELD);
    }
    if !settings.axis_sigmas.is_empty() {
        add(Kind::Axes { sigmas: settings.axis_sigmas.to_vec() }, Amplitude::HELD);
    }
    if settings.lag_s > 0.0 {
        add(Kind::Lag { taken_s: settings.lag_s, sigma_s: LAG_SIGMA_S }, Amplitude::HELD);
    }
    if settings.joint_lags_s > 0.0 {
        let bounds = [LEAST_JOINT_LAGS.powi(2), MOST_JOINT_LAGS.powi(2)];
        add(Kind::JointLags { sigma_s: settings.joint_lags_s }, Amplitude { theta: 1.0, bounds });
    }
    if let Some(clamped) = settings.part {
        let bounds = [LEAST_MOVES.powi(2), MOST_MOVES.powi(2)];
        add(Kind::Part(clamped.clone()), Amplitude { theta: 1.0, bounds });
    }
    if settings.levels.feature_bias_px > 0.0 {
        add(Kind::Detector { sigma_px: settings.levels.feature_bias_px }, Amplitude::HELD);
    }
    for line in (0..lines).filter(|_| settings.waviness_m > 0.0) {
        let along = || frames.iter().flatten().filter(|frame| frame.line == line).map(|frame| frame.along_m);
        let (Some(from), Some(to)) = (quantile(along(), BEYOND), quantile(along(), 1.0 - BEYOND)) else {
            continue;
        };
        for ((apart_m, part), largest_m) in FORMS.into_iter().zip(LARGEST_FORMS_M) {
            let sigma_m = part * settings.waviness_m;
            let hats = Hats::over([from, to], apart_m, lines);
            let bounds = [LEAST_FORM.powi(2), (largest_m / sigma_m).powi(2)];
            add(Kind::Form { line, hats, sigma_m }, Amplitude { theta: 1.0, bounds });
        }
    }
}

/// Least and largest lags of joints, in multiples of the expected ones.
const LEAST_JOINT_LAGS: f64 = 0.1;
const MOST_JOINT_LAGS: f64 = 5.0;

/// Least and largest moves of a part, in multiples of the expected ones.
const LEAST_MOVES: f64 = 0.1;
const MOST_MOVES: f64 = 10.0;

/// Least form as a fraction of the expected form, because zero has no logarithm.
const LEAST_FORM: f64 = 1e-3;

fn mean_view(frames: &[Option<Frame>], line: usize) -> Vector3<f64> {
    let mut sum = Vector3::zeros();
    let mut count = 0.0;
    for frame in frames.iter().flatten().filter(|frame| frame.line == line) {
        sum += frame.towards_sensor;
        count += 1.0;
    }
    sum / f64::max(count, 1.0)
}

fn answer(
    adjustment: &Adjustment<'_>,
    adjusted: &Adjusted,
    covariance: &DMatrix<f64>,
    settings: &Settings<'_>,
) -> Answer {
    let free = &adjustment.columns.free;
    // The rows of the unknowns, over all tangent components.
    let mut rows = DMatrix::zeros(adjustment.at.dimension(), covariance.ncols());
    for (column, index) in free.iter().enumerate() {
        rows.set_row(*index, &covariance.row(column));
    }
    let noise = &rows * &adjusted.equations.of_scan * rows.transpose();
    let mut shares = of_known(adjustment, &rows);
    for block in &adjustment.columns.blocks {
        let mut columns = rows.columns(block.columns.start, block.columns.len()).into_owned();
        for (k, mut column) in columns.column_iter_mut().enumerate() {
            column /= block.variance(k).sqrt();
        }
        let of = match block.kind {
            Kind::Form { .. } | Kind::Part(_) => ShareOf::SeamForm,
            Kind::Robot(_) => ShareOf::Robot,
            Kind::Detector { .. } => ShareOf::Detector,
            Kind::Lag { .. } | Kind::JointLags { .. } => ShareOf::PoseLag,
            Kind::Axes { .. } => ShareOf::Axes,
            Kind::Step { .. } => ShareOf::Stamps,
        };
        shares.push(Share { of, columns, shape: None });
    }
    shares.extend(of_considered(adjustment, &rows, &adjusted.equations.considered));
    Answer {
        at: adjustment.at.clone(),
        noise,
        shares,
        bends: None,
        axes: axis_step(adjustment, adjusted, covariance),
        field: adjustment.columns.blocks.iter().find_map(Block::robot_field).cloned(),
        moved_m: adjustment.columns.blocks.iter().find_map(|block| {
            let own = &adjustment.coefficients.as_slice()[block.columns.clone()];
            Some(block.clamped()?.largest_m(own))
        }),
        frames: stamps(adjustment),
        blocks: adjustment.columns.blocks.iter().filter_map(Block::name).collect(),
        amplitudes: Amplitudes {
            squared_lag_s2: squared_lag(adjustment, adjusted),
            step_s: step(adjustment, adjusted),
            ..amplitudes(adjustment, settings)
        },
        twice_negative_log: adjusted.solved.twice_negative_log,
    }
}

fn stamps(adjustment: &Adjustment<'_>) -> Vec<(f64, bool)> {
    let frames = adjustment.scan.frames(&adjustment.at, &adjustment.tilt);
    let of = |(frame, weight): (&Option<Frame>, &f64)| Some((frame.as_ref()?.stamp_s, *weight == 0.0));
    frames.iter().zip(&adjustment.weights.of).filter_map(of).collect()
}

/// Contributions of the priors of bows and shape to the covariance.
fn of_known(adjustment: &Adjustment<'_>, rows: &DMatrix<f64>) -> Vec<Share> {
    let unknowns = adjustment.at.unknowns();
    let known = adjustment.at.known(adjustment.shape_prior.as_ref()).information(adjustment.at.dimension());
    let bows = unknowns.bow(0).start..unknowns.bow(unknowns.lines).start;
    [(ShareOf::SeamForm, bows), (ShareOf::Sensor, unknowns.shape())]
        .into_iter()
        .filter_map(|(of, places)| {
            let free = &adjustment.columns.free;
            let kept: Vec<(usize, usize)> =
                places.filter_map(|index| Some((free.binary_search(&index).ok()?, index))).collect();
            let own = DMatrix::from_fn(kept.len(), kept.len(), |i, j| known[(kept[i].1, kept[j].1)]);
            let root = own.cholesky()?.l();
            let moved = DMatrix::from_fn(rows.nrows(), kept.len(), |i, j| rows[(i, kept[j].0)]);
            Some(Share { of, columns: moved * root, shape: None })
        })
        .collect()
}

fn of_considered(adjustment: &Adjustment<'_>, rows: &DMatrix<f64>, with: &DMatrix<f64>) -> Vec<Share> {
    let mut next = 0;
    let mut shares = Vec::new();
    for considered in &adjustment.columns.considered {
        let count = considered.columns();
        let mut columns = -(rows * with.columns(next, count));
        next += count;
        shares.extend(match considered {
            Considered::Held(component, sigma) => {
                columns[(*component, 0)] = *sigma;
                Some(Share { of: ShareOf::Held, columns, shape: None })
            }
            Considered::Shape(covariance) => {
                let root = covariance.cholesky().map(|factor| factor.l());
                let shape = root.map(|l| DMatrix::from_column_slice(5, 5, l.as_slice()));
                Some(Share { of: ShareOf::Sensor, columns, shape })
            }
            Considered::EdgeRadius { .. } => Some(Share { of: ShareOf::EdgeRadius, columns, shape: None }),
            Considered::SquaredLag(_) => None,
        });
    }
    shares
}

/// The last consider parameter.
fn squared_lag(adjustment: &Adjustment<'_>, adjusted: &Adjusted) -> (f64, f64) {
    let Some(last) = adjusted.equations.considered.ncols().checked_sub(1) else { return (0.0, 0.0) };
    debug_assert!(matches!(adjustment.columns.considered.last(), Some(Considered::SquaredLag(_))));
    let (units, sigma) = adjusted.equations.estimate_of(last, &adjusted.solved);
    (units * UNIT_OF_LAG_S.powi(2), sigma * UNIT_OF_LAG_S.powi(2))
}

/// The estimated step of the clock.
fn step(adjustment: &Adjustment<'_>, adjusted: &Adjusted) -> Option<(f64, f64)> {
    let block = |block: &Block| match block.kind {
        Kind::Step { sigma_s, .. } => Some((block.columns.start, sigma_s)),
        _ => None,
    };
    let (column, unit_s) = adjustment.columns.blocks.iter().find_map(block)?;
    let sigma_s = unit_s * adjusted.solved.variances()[column].sqrt();
    Some((unit_s * adjustment.coefficients[column], sigma_s))
}

fn amplitudes(adjustment: &Adjustment<'_>, settings: &Settings<'_>) -> Amplitudes {
    let frames = adjustment.scan.frames(&adjustment.at, &adjustment.tilt);
    let (mut form, mut robot, mut joints, mut count) = (0.0, 0.0, 0.0, 0.0);
    for (frame, weight) in frames.iter().zip(&adjustment.weights.of) {
        let Some(frame) = frame.as_ref().filter(|_| *weight > 0.0) else { continue };
        count += 1.0;
        let mut off = [0.0; 2];
        for block in &adjustment.columns.blocks {
            let own = block.offset_m(frame, &adjustment.coefficients);
            match block.kind {
                Kind::Form { .. } => off = [off[0] + own[0], off[1] + own[1]],
                Kind::Robot(_) => robot += own[0].powi(2) + own[1].powi(2),
                Kind::JointLags { .. } => joints += own[0].powi(2) + own[1].powi(2),
                _ => {}
            }
        }
        form += off[0].powi(2) + off[1].powi(2);
    }
    let blocks = &adjustment.columns.blocks;
    let thetas = |of: fn(&Kind) -> bool| {
        blocks.iter().filter(move |block| of(&block.kind)).map(|block| block.amplitude.theta.sqrt())
    };
    let lines = adjustment.at.lines.len().max(1);
    let is_robot = |kind: &Kind| matches!(kind, Kind::Robot(_));
    // A seam that is stated to be nearly straight may still have the usual waviness.
    let of_usual = (settings.waviness_m / ASSUMED_WAVINESS_M).min(1.0);
    let there = || frames.iter().zip(&adjustment.weights.of).filter(|(frame, _)| frame.is_some());
    let out = there().filter(|(_, weight)| **weight == 0.0).count();
    Amplitudes {
        white: adjustment.sigmas.map(|sigma| sigma * settings.noise_factor),
        lasting: adjustment.noise,
        form_m: (form / f64::max(count, 1.0)).sqrt(),
        form_sigma_m: (blocks.iter().map(Block::form_variance_m2).sum::<f64>() / lines as f64).sqrt(),
        forms: thetas(|kind| matches!(kind, Kind::Form { .. })).map(|form| form * of_usual).collect(),
        robot_m: (robot / f64::max(count, 1.0)).sqrt(),
        robot: thetas(is_robot).next(),
        robot_is_worst: blocks.iter().any(|block| is_robot(&block.kind) && block.amplitude.is_largest()),
        squared_lag_s2: (0.0, 0.0),
        step_s: None,
        lag_s: blocks.iter().find_map(|block| block.lag_s()).unwrap_or(0.0),
        joint_lags_m: (settings.joint_lags_s > 0.0).then(|| (joints / f64::max(count, 1.0)).sqrt()),
        out: Outliers { count: out, of: there().count() },
        outliers: adjustment.weights.outliers,
    }
}
