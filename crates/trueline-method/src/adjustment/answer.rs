//! The answer of an adjustment: the unknowns, their covariance, and its error budget.

use crate::adjustment::adjust::{Adjusted, Adjustment};
use crate::adjustment::axis_step::{AxisStep, axis_step};
use crate::adjustment::beyond_linear::BeyondLinear;
use crate::adjustment::blocks::{Block, Kind};
use crate::adjustment::coloured::Coloured;
use crate::adjustment::columns::{Columns, Considered};
use crate::adjustment::error_sizes::Amplitudes;
use crate::adjustment::expected::{UNIT_OF_LAG_S, add_blocks, considered};
use crate::adjustment::seam_points::SeamPoints;
use crate::adjustment::settings::Settings;
use crate::adjustment::sights::{Frame, Sights, State};
use crate::adjustment::weights::Weights;
use crate::assess::outliers::Outliers;
use crate::assess::robot_field::{OfRobot, RobotField};
use crate::assess::share::{Share, ShareOf};
use crate::config::ASSUMED_WAVINESS_M;
use crate::input::shape_prior::ShapePrior;
use crate::models;
use crate::problem::line_problem::LineProblem;
use crate::problem::parameters::Parameters;
use nalgebra::{DMatrix, DVector};

/// Cost of a frame that is left out: that of one at the cut of 5.5 standard deviations.
const LEFT_OUT: f64 = 5.5 * 5.5;

/// The stamp of each frame of an adjustment, s, and whether it was left out.
#[derive(Clone, Debug)]
pub(crate) struct FramesUsed(Vec<(f64, bool)>);

impl FramesUsed {
    /// Whether at least half of the frames between two times, s, were left out. Of two seams in a frame, one may be.
    #[must_use]
    pub(crate) fn leave_out(&self, [from_s, to_s]: [f64; 2]) -> bool {
        let there = || self.0.iter().filter(|(stamp_s, _)| (from_s..=to_s).contains(stamp_s));
        2 * there().filter(|(_, is_out)| *is_out).count() >= there().count()
    }

    /// Counts the frames.
    #[must_use]
    pub(crate) fn outliers(&self) -> Outliers {
        Outliers { count: self.0.iter().filter(|(_, is_out)| *is_out).count(), of: self.0.len() }
    }

    /// The same with frames that were left out, in whole or in part, before the adjustment: their stamps, s, rising.
    #[must_use]
    pub(crate) fn without(mut self, left_out_s: &[f64]) -> Self {
        let is_out = |stamp_s: &f64| left_out_s.binary_search_by(|out_s| out_s.total_cmp(stamp_s)).is_ok();
        self.0.retain(|(stamp_s, _)| !is_out(stamp_s));
        self.0.extend(left_out_s.iter().map(|stamp_s| (*stamp_s, true)));
        self
    }
}

/// The answer.
pub(crate) struct Answer<P = Parameters> {
    /// The unknowns.
    pub at: P,
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
    /// Its frames.
    pub frames: FramesUsed,
    /// Minus twice the log likelihood.
    pub(crate) twice_negative_log: f64,
}

impl<P> Answer<P> {
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

/// Adjusts the seam points of a scan from a state near its optimum. `None` if the equations have no solution.
#[must_use]
pub(crate) fn adjust(problem: &LineProblem<'_>, at: &Parameters, settings: &Settings<'_>) -> Option<Answer> {
    let scan = SeamPoints::of(problem, at);
    adjust_sights(scan, (at, problem.shape_prior), settings, settings.noise)
}

/// Adjusts the sights of a scan from a state near its optimum, with the prior of the sensor's shape. `None` if the equations have no solution.
#[must_use]
pub(crate) fn adjust_sights<S: Sights<ROWS, LOCAL>, const ROWS: usize, const LOCAL: usize>(
    scan: S,
    (at, shape_prior): (&S::State, Option<ShapePrior>),
    settings: &Settings<'_>,
    known_noise: Option<[Coloured; ROWS]>,
) -> Option<Answer<S::State>> {
    let frames = scan.frames(at);
    let mut columns = Columns::of(at, settings.fixed, considered(settings, &frames, at.targets()));
    let of_poses = || RobotField::new(settings.levels.robot, &scan.poses(at));
    let field = settings.field.cloned().or_else(of_poses);
    add_blocks(&mut columns, &frames, (at.targets(), scan.directions()), field, settings);
    let coefficients = DVector::zeros(columns.estimated());
    let mut adjustment = Adjustment {
        scan,
        shape_prior,
        columns,
        at: at.clone(),
        coefficients,
        unseen: DMatrix::zeros(at.dimension(), 0),
        sigmas: [1.0; ROWS],
        noise: [Coloured::NONE; ROWS],
        known_noise,
        weights: Weights::default(),
        threads: settings.threads,
    };
    let adjusted = adjustment.run()?;
    let covariance = adjustment.covariance(&adjusted);
    let mut answer = answer(&adjustment, &adjusted, &covariance, settings);
    if let Some(BeyondLinear { wider, bends }) = adjustment.beyond_linear(&covariance) {
        answer.noise += &wider * wider.transpose();
        answer.bends = Some(bends);
    }
    Some(answer)
}

fn answer<S: Sights<ROWS, LOCAL>, const ROWS: usize, const LOCAL: usize>(
    adjustment: &Adjustment<S, ROWS, LOCAL>,
    adjusted: &Adjusted,
    covariance: &DMatrix<f64>,
    settings: &Settings<'_>,
) -> Answer<S::State> {
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
        frames: frames_used(adjustment),
        blocks: adjustment.columns.blocks.iter().filter_map(Block::name).collect(),
        amplitudes: Amplitudes {
            squared_lag_s2: squared_lag(adjustment, adjusted),
            step_s: step(adjustment, adjusted),
            ..amplitudes(adjustment, settings)
        },
        twice_negative_log: adjusted.solved.twice_negative_log,
    }
}

fn frames_used<S: Sights<ROWS, LOCAL>, const ROWS: usize, const LOCAL: usize>(
    adjustment: &Adjustment<S, ROWS, LOCAL>,
) -> FramesUsed {
    let frames = adjustment.scan.frames(&adjustment.at);
    let of = |(frame, weight): (&Option<Frame<ROWS, LOCAL>>, &f64)| {
        Some((frame.as_ref()?.stamp_s, *weight == 0.0))
    };
    FramesUsed(frames.iter().zip(&adjustment.weights.of).filter_map(of).collect())
}

/// Contributions of the priors of bows and shape to the covariance.
fn of_known<S: Sights<ROWS, LOCAL>, const ROWS: usize, const LOCAL: usize>(
    adjustment: &Adjustment<S, ROWS, LOCAL>,
    rows: &DMatrix<f64>,
) -> Vec<Share> {
    let known = adjustment.at.known(adjustment.shape_prior.as_ref()).information(adjustment.at.dimension());
    [(ShareOf::SeamForm, adjustment.at.bends()), (ShareOf::Sensor, adjustment.at.shape())]
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

fn of_considered<S: Sights<ROWS, LOCAL>, const ROWS: usize, const LOCAL: usize>(
    adjustment: &Adjustment<S, ROWS, LOCAL>,
    rows: &DMatrix<f64>,
    with: &DMatrix<f64>,
) -> Vec<Share> {
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
fn squared_lag<S: Sights<ROWS, LOCAL>, const ROWS: usize, const LOCAL: usize>(
    adjustment: &Adjustment<S, ROWS, LOCAL>,
    adjusted: &Adjusted,
) -> (f64, f64) {
    let Some(last) = adjusted.equations.considered.ncols().checked_sub(1) else { return (0.0, 0.0) };
    debug_assert!(matches!(adjustment.columns.considered.last(), Some(Considered::SquaredLag(_))));
    let (units, sigma) = adjusted.equations.estimate_of(last, &adjusted.solved);
    (units * UNIT_OF_LAG_S.powi(2), sigma * UNIT_OF_LAG_S.powi(2))
}

/// The estimated step of the clock.
fn step<S: Sights<ROWS, LOCAL>, const ROWS: usize, const LOCAL: usize>(
    adjustment: &Adjustment<S, ROWS, LOCAL>,
    adjusted: &Adjusted,
) -> Option<(f64, f64)> {
    let block = |block: &Block| match block.kind {
        Kind::Step { sigma_s, .. } => Some((block.columns.start, sigma_s)),
        _ => None,
    };
    let (column, unit_s) = adjustment.columns.blocks.iter().find_map(block)?;
    let sigma_s = unit_s * adjusted.solved.variances()[column].sqrt();
    Some((unit_s * adjustment.coefficients[column], sigma_s))
}

fn amplitudes<S: Sights<ROWS, LOCAL>, const ROWS: usize, const LOCAL: usize>(
    adjustment: &Adjustment<S, ROWS, LOCAL>,
    settings: &Settings<'_>,
) -> Amplitudes {
    let frames = adjustment.scan.frames(&adjustment.at);
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
    let is_robot = |kind: &Kind| matches!(kind, Kind::Robot(_));
    // A seam that is stated to be nearly straight may still have the usual waviness.
    let of_usual = (settings.waviness_m / ASSUMED_WAVINESS_M).min(1.0);
    let there = || frames.iter().zip(&adjustment.weights.of).filter(|(frame, _)| frame.is_some());
    let out = there().filter(|(_, weight)| **weight == 0.0).count();
    let is_there = |row: &usize| frames.iter().flatten().any(|frame| frame.is_there[*row]);
    let rows = || (0..ROWS).filter(is_there);
    Amplitudes {
        white: rows().map(|row| adjustment.sigmas[row] * settings.noise_factor).collect(),
        lasting: rows().map(|row| adjustment.noise[row]).collect(),
        form_m: (form / f64::max(count, 1.0)).sqrt(),
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
