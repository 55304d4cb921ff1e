//! What each usual cause does to the residuals: its pattern over the motion.
//!
//! A cause c adds J_c c to the whitened residuals. Beside all other unknowns, whose covariance is C₀, it explains
//! uᵀ S⁻¹ u of their squares, with u = J_cᵀ W r and S = J_cᵀ W J_c − J_cᵀ W J C₀ Jᵀ W J_c (the score test, \[Rao1948\]); its
//! size is S⁻¹ u.

use crate::assess::cause_kind::{COLUMNS, CauseKind, LENS};
use crate::assess::lens;
use crate::assess::tilt_bias::{BIAS, TiltBias};
use crate::input::noise_levels::Whitener;
use crate::input::observations::Observation;
use crate::problem::line_problem::{LineProblem, LocalJacobian};
use crate::problem::parameters::{Parameters, TIME_OFFSET};
use crate::thinning::stride;
use nalgebra::{DMatrix, DVector, Point3, SMatrix, SVector, Vector2, Vector3};
use trueline_dataset::{Measured, Recording, Sensor};
use trueline_geometry::Pose;
use trueline_model::Placement;

/// Observations that are looked at.
const MOST_OBSERVATIONS: usize = 3000;
/// A pattern whose remainder beside the other unknowns is less than this part cannot be separated from them.
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

/// What a unit of each cause does to the residuals of a scan at a solution.
pub(crate) struct Patterns {
    rows: Vec<Row>,
    sums: Sums,
    /// Of the covariance of the unknowns by the observations that are looked at.
    root: DMatrix<f64>,
}

/// A cause that is allowed for, as large as such causes are.
pub(crate) struct Allowed {
    /// Its most likely numbers.
    pub size: DVector<f64>,
    /// Their covariance.
    pub covariance: DMatrix<f64>,
    /// How a unit of each moves the unknowns.
    pub unknowns_per_size: DMatrix<f64>,
}

impl Patterns {
    /// At a solution whose covariance's root is `root`.
    #[must_use]
    pub(crate) fn of(
        recording: &Recording,
        problem: &LineProblem<'_>,
        at: &Parameters,
        root: &DMatrix<f64>,
    ) -> Self {
        let every = stride(problem.list.len(), MOST_OBSERVATIONS);
        // Of one in so many observations the unknowns are known that much worse.
        let root = root * (every as f64).sqrt();
        let rows = rows(recording, problem, at, &root, every);
        let sums = Sums::of(&rows, root.ncols(), every > 1);
        Self { rows, sums, root }
    }

    /// Observations that are looked at.
    #[must_use]
    pub(crate) fn len(&self) -> usize {
        self.rows.len()
    }

    /// The most likely sizes of some numbers beside the other unknowns; patterns that these can make are left out.
    #[must_use]
    pub(crate) fn solve(&self, columns: impl IntoIterator<Item = usize>) -> Option<Solved> {
        self.sums.solve(columns)
    }

    /// How a unit of each number moves the unknowns.
    #[must_use]
    pub(crate) fn unknowns_per_size(&self) -> DMatrix<f64> {
        &self.root * &self.sums.cross
    }

    /// The numbers of a cause that are known beforehand to standard deviations of `sigmas`, however alike the other unknowns are;
    /// `None` where no such numbers are given.
    #[must_use]
    pub(crate) fn allowed_for(&self, kind: CauseKind, sigmas: &[f64]) -> Option<Allowed> {
        let first = kind.columns().start;
        let cross = self.sums.cross.columns(first, sigmas.len());
        let own = self.sums.own.view((first, first), (sigmas.len(), sigmas.len()));
        let known =
            DMatrix::from_diagonal(&DVector::from_iterator(sigmas.len(), sigmas.iter().map(|s| s.powi(-2))));
        let covariance =
            (own - cross.transpose() * cross + known).cholesky().filter(|_| !sigmas.is_empty())?.inverse();
        let size = &covariance * self.sums.score.rows(first, sigmas.len());
        Some(Allowed { size, covariance, unknowns_per_size: &self.root * cross })
    }

    /// Correlation of neighbours in what a cause leaves.
    #[must_use]
    pub(crate) fn neighbours(&self, solved: &Solved) -> f64 {
        neighbours(&self.rows, solved, &self.sums)
    }
}

/// One observation: whitened and weighted.
struct Row {
    residual: Vector2<f64>,
    /// In the root's coordinates (2 × their number).
    slopes: DMatrix<f64>,
    causes: SMatrix<f64, 2, COLUMNS>,
}

fn rows(
    recording: &Recording,
    problem: &LineProblem<'_>,
    at: &Parameters,
    root: &DMatrix<f64>,
    every: usize,
) -> Vec<Row> {
    let sample = problem.selected().step_by(every);
    let placed: Vec<_> = sample.filter_map(|pair| Some((pair, problem.placement(pair.0, at)?))).collect();
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
    columns.fixed_columns_mut::<2>(6).copy_from(&(pair.1.matrix() * pair.0.sheet_per_px() * side));
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
pub(crate) struct Solved {
    /// The sizes.
    pub size: SVector<f64, COLUMNS>,
    /// Their covariance by white noise.
    pub covariance: SMatrix<f64, COLUMNS, COLUMNS>,
    /// How much of the squares they explain.
    pub gain: f64,
}

impl Sums {
    /// Some of a scan's rows are not at the optimum of their own, which the unknowns are moved to.
    fn of(rows: &[Row], unknowns: usize, are_some: bool) -> Self {
        let mut sums =
            Self { cross: DMatrix::zeros(unknowns, COLUMNS), own: SMatrix::zeros(), score: SVector::zeros() };
        for row in rows {
            sums.cross.gemm_tr(1.0, &row.slopes, &row.causes, 1.0);
            sums.own.gemm_tr(1.0, &row.causes, &row.causes, 1.0);
            sums.score.gemv_tr(1.0, &row.causes, &row.residual, 1.0);
        }
        if are_some {
            let gradient: DVector<f64> =
                rows.iter().fold(DVector::zeros(unknowns), |sum, row| sum + row.slopes.tr_mul(&row.residual));
            sums.score -= sums.cross.tr_mul(&gradient);
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
