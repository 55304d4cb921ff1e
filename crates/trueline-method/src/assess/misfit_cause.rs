//! What residuals that are no noise are made of: each usual cause leaves a pattern over the motion, and the one that
//! explains nearly all of what any of them explains is named, with its size.
//!
//! A cause c adds J_c c to the whitened residuals. Beside all other unknowns, whose covariance is C₀, it explains
//! uᵀ S⁻¹ u of their squares, with u = J_cᵀ W r and S = J_cᵀ W J_c − J_cᵀ W J C₀ Jᵀ W J_c (the score test, \[Rao1948\]); its
//! size is S⁻¹ u. Residuals that are alike from one to the next make that look more than it is, by (1 + ρ)/(1 − ρ).

use crate::assess::lens;
use crate::assess::tilt_bias::{BIAS, TiltBias, sheet_per_px};
use crate::input::noise_levels::Whitener;
use crate::input::observations::Observation;
use crate::problem::line_problem::{LineProblem, LocalJacobian};
use crate::problem::parameters::{Parameters, TIME_OFFSET};
use nalgebra::{DMatrix, DVector, Point3, SMatrix, SVector, Vector2, Vector3};
use std::ops::Range;
use trueline_dataset::{Measured, Recording, Sensor};
use trueline_geometry::Pose;
use trueline_model::Placement;

/// A usual cause.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CauseKind {
    /// The arm gives way: the tool lags behind by so many metres for each m/s² (s²).
    Flex,
    /// Play in the robot: the tool follows only after the motion has taken it up (m).
    Backlash,
    /// The attitude is reported later than the position (s).
    AttitudeLag,
    /// The rows of a picture are exposed one after the other (s from the first to the last).
    RollingShutter,
    /// The detector errs to different sides on the two sides of the picture (px).
    SideBias,
    /// What is reported is the commanded pose, and the arm follows it as a first-order lag (the square of its time constant, s²).
    CommandedPose,
    /// The camera's distortion is not what its file states: k1, and k2 where the scan shows it (true minus stated).
    Lens,
    /// The detector's point moves with the tilt (px per 10°): what the robot's errors look like too, so that it is said only
    /// where it was estimated beside them.
    TiltBias,
}

/// A cause that was found.
#[derive(Clone, Debug, PartialEq)]
pub struct MisfitCause {
    /// Which.
    pub kind: CauseKind,
    /// Its size, in the unit of its kind; of several numbers the clearest.
    pub size: f64,
    /// Standard deviation of that by noise.
    pub sigma: f64,
    /// All its numbers, and their standard deviations by noise; a number that the scan does not show is zero.
    pub numbers: Vec<(f64, f64)>,
    /// Correlation of neighbours that it leaves.
    pub left: f64,
    /// How the unknowns move if it is allowed for, and the covariance that this adds.
    pub step: DVector<f64>,
    /// See `step`.
    pub added_covariance: DMatrix<f64>,
}

impl CauseKind {
    const ALL: [Self; 8] = [
        Self::Flex,
        Self::Backlash,
        Self::AttitudeLag,
        Self::RollingShutter,
        Self::SideBias,
        Self::CommandedPose,
        Self::Lens,
        Self::TiltBias,
    ];

    /// Whether only a size above zero has a meaning: nothing gives way towards what pushes it, play has no sign, and no arm
    /// runs ahead of its command.
    fn is_one_sided(self) -> bool {
        matches!(self, Self::Flex | Self::Backlash | Self::CommandedPose)
    }

    /// Its columns among [`COLUMNS`].
    fn columns(self) -> Range<usize> {
        match self {
            Self::Flex => 0..1,
            Self::Backlash => 1..4,
            Self::AttitudeLag => 4..5,
            Self::RollingShutter => 5..6,
            Self::SideBias => 6..8,
            Self::CommandedPose => 8..9,
            Self::Lens => LENS..LENS + 2,
            Self::TiltBias => LENS + 2..COLUMNS,
        }
    }
}

/// Numbers of all causes together.
const COLUMNS: usize = LENS + 2 + BIAS;
/// The first of the lens.
const LENS: usize = 9;
/// Half of what k2 of a camera is known to beforehand: a scan that shows it no better does not tell it from k1.
const SHOWS_K2: f64 = 0.025;
/// Observations that are looked at.
const SAMPLE: usize = 3000;
/// Fewer tell nothing.
const LEAST: usize = 100;
/// A cause must explain so much of the squares: 30 of χ²₃ is one scan in a million.
const LEAST_GAIN: f64 = 30.0;
/// … and this part of what all causes together explain: else it is something that is not among them.
const LEAST_SHARE: f64 = 0.7;
/// A pattern of which the other unknowns leave less than this part cannot be told from them.
const LEAST_OWN: f64 = 1e-3;
/// Accelerations are taken from poses so long before and after, s: long against the robot's noise, short against a weave, and none
/// near the exposure, for that one's noise is in the residual and would look like an acceleration.
const NEAR_S: f64 = 0.06;
/// See [`NEAR_S`].
const FAR_S: f64 = 0.12;
/// The same for the direction of motion, s.
const HALF_STEP_S: f64 = 0.04;
/// Slower than this an axis stands still as far as play goes, m/s.
const STANDS_M_S: f64 = 2e-3;

/// Finds it at a solution whose covariance's root is `root`; `None` where nothing is left to explain, or none of them
/// explains it.
#[must_use]
pub fn find(
    recording: &Recording,
    problem: &LineProblem<'_>,
    at: &Parameters,
    root: &DMatrix<f64>,
) -> Option<MisfitCause> {
    let rows = rows(recording, problem, at, root);
    if rows.len() < LEAST {
        return None;
    }
    let sums = Sums::of(&rows, root.ncols());
    // The corners that a smoothed path cuts off look like an arm that runs ahead of its acceleration: no arm does.
    let is_possible = |kind: &CauseKind| {
        !kind.is_one_sided()
            || sums.solve(kind.columns()).is_some_and(|solved| clearest(&solved, kind.columns()).0 > 0.0)
    };
    let possible: Vec<CauseKind> = CauseKind::ALL.into_iter().filter(is_possible).collect();
    let gain = |kinds: &[CauseKind]| {
        let columns = kinds.iter().flat_map(|kind| kind.columns());
        sums.solve(columns).map_or(0.0, |solved| solved.gain)
    };
    let kind = possible.iter().copied().max_by(|a, b| gain(&[*a]).total_cmp(&gain(&[*b])))?;
    let mut columns = kind.columns();
    let mut solved = sums.solve(columns.clone())?;
    if kind == CauseKind::Lens && solved.covariance[(LENS + 1, LENS + 1)].sqrt() > SHOWS_K2 {
        columns = LENS..LENS + 1;
        solved = sums.solve(columns.clone())?;
    }
    if solved.gain < LEAST_GAIN || solved.gain < LEAST_SHARE * gain(&possible) {
        return None;
    }
    let alike = neighbours(&rows, &solved, &sums).max(0.0);
    let inflation = (1.0 + alike) / (1.0 - alike).max(0.02);
    if solved.gain < LEAST_GAIN * inflation {
        return None;
    }
    let (size, variance) = clearest(&solved, columns);
    let by_cause = root * &sums.cross;
    let covariance = DMatrix::from_column_slice(COLUMNS, COLUMNS, (solved.covariance * inflation).as_slice());
    Some(MisfitCause {
        kind,
        size,
        sigma: (variance * inflation).sqrt(),
        numbers: kind
            .columns()
            .map(|k| (solved.size[k], (solved.covariance[(k, k)] * inflation).sqrt()))
            .collect(),
        left: alike,
        step: &by_cause * solved.size,
        added_covariance: &by_cause * covariance * by_cause.transpose(),
    })
}

/// The number that is clearest beside its standard deviation, and its variance.
fn clearest(solved: &Solved, columns: Range<usize>) -> (f64, f64) {
    let numbers = columns.map(|k| (solved.size[k], solved.covariance[(k, k)]));
    let clear = |(size, variance): &(f64, f64)| size * size / variance;
    numbers.max_by(|a, b| clear(a).total_cmp(&clear(b))).unwrap_or((0.0, 0.0))
}

/// One observation: whitened and weighted.
struct Row {
    residual: Vector2<f64>,
    /// In the root's coordinates (2 × their number).
    slopes: DMatrix<f64>,
    causes: SMatrix<f64, 2, COLUMNS>,
}

fn rows(recording: &Recording, problem: &LineProblem<'_>, at: &Parameters, root: &DMatrix<f64>) -> Vec<Row> {
    let every = problem.list.len().div_ceil(SAMPLE).max(1);
    let mut hint = 0;
    let sample = problem.selected().step_by(every);
    let placed: Vec<_> =
        sample.filter_map(|pair| Some((pair, problem.placement(pair.0, at, &mut hint)?))).collect();
    let poses: Vec<Pose> = placed.iter().map(|(_, placement)| placement.base_from_tool).collect();
    let tilt = TiltBias::about(&poses);
    let mut rows = Vec::new();
    for (pair, placement) in &placed {
        let Some((residual, jacobian)) = problem.whitened_where(*pair, at, placement) else { continue };
        let Some(mut causes) = causes(recording, problem, *pair, at, (placement, &jacobian)) else {
            continue;
        };
        causes
            .fixed_columns_mut::<BIAS>(CauseKind::TiltBias.columns().start)
            .copy_from(&(pair.1.matrix() * tilt.slopes(pair.0, at, placement)));
        let weight = problem.loss.weight(residual.norm_squared()).sqrt();
        let mut slopes = DMatrix::zeros(2, root.ncols());
        for local in 0..problem.unknowns.local() {
            let row = root.row(problem.unknowns.place(local, pair.0.line as usize));
            slopes.ger(weight, &jacobian.column(local), &row.transpose(), 1.0);
        }
        rows.push(Row { residual: residual * weight, slopes, causes: causes * weight });
    }
    rows
}

/// What a unit of each cause does to a whitened residual.
fn causes(
    recording: &Recording,
    problem: &LineProblem<'_>,
    pair: (&Observation, &Whitener),
    at: &Parameters,
    (placement, jacobian): (&Placement, &LocalJacobian),
) -> Option<SMatrix<f64, 2, COLUMNS>> {
    let onto = problem.whitened_displacement(pair, at, placement)?;
    let exposure_s = pair.0.stamp_s - at.time_offset_s;
    let trajectory = &problem.observations.robot.trajectory;
    let place = |time_s: f64| Some(trajectory.pose_at(time_s)?.translation.vector);
    let acceleration = acceleration(exposure_s, place)?;
    let velocity =
        (place(exposure_s + HALF_STEP_S)? - place(exposure_s - HALF_STEP_S)?) / (2.0 * HALF_STEP_S);
    let measured = at.corrected(&problem.observations.sheet, &pair.0.point_in_camera);
    let lever: Vector3<f64> =
        placement.point_in_base(&measured) - placement.base_from_tool.translation.vector;
    let point_in_tool = at.tool_from_camera * Point3::from(measured);
    let carried = |time_s: f64| Some((trajectory.pose_at(time_s)? * point_in_tool).coords);
    let of_point = self::acceleration(exposure_s, carried)?;
    let (side, row) = in_picture(recording, pair.0);
    let mut columns = SMatrix::<f64, 2, COLUMNS>::zeros();
    // The tool is −c a beside its reported place, so what is measured seems +c a beside the seam.
    columns.set_column(0, &(onto * acceleration));
    for axis in 0..3 {
        let towards = (velocity[axis] / STANDS_M_S).clamp(-1.0, 1.0);
        columns.set_column(1 + axis, &(onto.column(axis) * (0.5 * towards)));
    }
    columns.set_column(4, &(onto * -placement.angular_velocity.cross(&lever)));
    // An exposure that is later than thought is a time offset that is smaller.
    columns.set_column(5, &(jacobian.column(TIME_OFFSET) * row));
    columns.fixed_columns_mut::<2>(6).copy_from(&(pair.1.matrix() * sheet_per_px(pair.0) * side));
    // Of 1/(1 + τ s) = exp(−τ s) + τ² s²/2 + … the delay is the time offset's: the tool is τ²/2 of its acceleration ahead.
    columns.set_column(8, &(onto * of_point * -0.5));
    // The stated lens leaves the point where the true one would not: that much before it.
    let by_lens = lens::moves(recording, &problem.observations.sheet, pair.0.row as usize);
    columns.fixed_columns_mut::<2>(LENS).copy_from(&(pair.1.matrix() * -by_lens.unwrap_or_default()));
    Some(columns)
}

/// The second derivative of a place, from four times around.
fn acceleration(time_s: f64, place: impl Fn(f64) -> Option<Vector3<f64>>) -> Option<Vector3<f64>> {
    let [before, near_before, near_after, after] =
        [-FAR_S, -NEAR_S, NEAR_S, FAR_S].map(|by| place(time_s + by));
    Some((before? - near_before? - near_after? + after?) / (FAR_S * FAR_S - NEAR_S * NEAR_S))
}

/// On which side of the picture's middle a feature is (−1, 1), and how far down it, from −½ to ½; 0 where there is no picture.
fn in_picture(recording: &Recording, o: &Observation) -> (f64, f64) {
    let Some(feature) = recording.features.get(o.row as usize) else { return (0.0, 0.0) };
    match (feature.measured, &recording.sensor) {
        (Measured::Pixel([u, v]), Sensor::CameraLaser { camera, .. }) => {
            ((u - camera.centre.x).signum(), (v + 0.5) / f64::from(camera.size[1]) - 0.5)
        }
        (Measured::Profile([x, _]) | Measured::Point([x, _, _]), _) => (x.signum(), 0.0),
        (Measured::Pixel(_), _) => (0.0, 0.0),
    }
}

/// Products over all rows.
struct Sums {
    /// Jᵀ W J_c in the root's coordinates.
    cross: DMatrix<f64>,
    own: SMatrix<f64, COLUMNS, COLUMNS>,
    score: SVector<f64, COLUMNS>,
}

/// Sizes of some causes, zero for the others.
struct Solved {
    size: SVector<f64, COLUMNS>,
    covariance: SMatrix<f64, COLUMNS, COLUMNS>,
    gain: f64,
}

impl Sums {
    fn of(rows: &[Row], unknowns: usize) -> Self {
        let mut sums =
            Self { cross: DMatrix::zeros(unknowns, COLUMNS), own: SMatrix::zeros(), score: SVector::zeros() };
        for row in rows {
            sums.cross += row.slopes.transpose() * row.causes;
            sums.own += row.causes.transpose() * row.causes;
            sums.score += row.causes.transpose() * row.residual;
        }
        sums
    }

    /// The most likely sizes of some of the causes beside the other unknowns; patterns that these can make are left out.
    fn solve(&self, columns: impl IntoIterator<Item = usize>) -> Option<Solved> {
        let left = self.own
            - SMatrix::<f64, COLUMNS, COLUMNS>::from_iterator(
                (self.cross.transpose() * &self.cross).iter().copied(),
            );
        let told: Vec<usize> = columns
            .into_iter()
            .filter(|k| left[(*k, *k)] > LEAST_OWN * self.own[(*k, *k)] && left[(*k, *k)] > 0.0)
            .collect();
        if told.is_empty() {
            return None;
        }
        let scale: Vec<f64> = told.iter().map(|k| left[(*k, *k)].sqrt().recip()).collect();
        let scaled =
            DMatrix::from_fn(told.len(), told.len(), |i, j| left[(told[i], told[j])] * scale[i] * scale[j]);
        let score = DVector::from_fn(told.len(), |i, _| self.score[told[i]] * scale[i]);
        let inverse = scaled.pseudo_inverse(LEAST_OWN).ok()?;
        let size = &inverse * &score;
        let mut solved =
            Solved { size: SVector::zeros(), covariance: SMatrix::zeros(), gain: score.dot(&size) };
        for (i, row) in told.iter().enumerate() {
            solved.size[*row] = size[i] * scale[i];
            for (j, column) in told.iter().enumerate() {
                solved.covariance[(*row, *column)] = inverse[(i, j)] * scale[i] * scale[j];
            }
        }
        Some(solved)
    }
}

/// Correlation of neighbours in what a cause leaves.
fn neighbours(rows: &[Row], solved: &Solved, sums: &Sums) -> f64 {
    let step = &sums.cross * solved.size;
    let left: Vec<Vector2<f64>> =
        rows.iter().map(|row| row.residual - row.causes * solved.size + &row.slopes * &step).collect();
    let power: f64 = left.iter().map(Vector2::norm_squared).sum();
    let product: f64 = left.windows(2).map(|two| two[0].dot(&two[1])).sum();
    if power > 0.0 { product / power } else { 0.0 }
}
