//! Effect of each usual cause on the residuals: its pattern over the motion.
//!
//! A cause c adds J_c c to the whitened residuals. Beside all other unknowns, whose covariance is C₀, it explains uᵀ S⁻¹ u of their squares, with u
//! = J_cᵀ W r and S = J_cᵀ W J_c − J_cᵀ W J C₀ Jᵀ W J_c (the score test, \[Rao1948\]). Its size is S⁻¹ u.

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

/// Maximum number of observations evaluated.
const MOST_OBSERVATIONS: usize = 3000;
/// Least remaining fraction of a pattern beside the other unknowns. Below it they are not separable.
const LEAST_OWN: f64 = 1e-3;
/// Distances in time of the poses that give accelerations, s: long compared with the robot's noise, short compared with a weave. No pose is near the
/// exposure, because its noise is in the residual and would look like an acceleration.
const NEAR_S: f64 = 0.06;
/// See [`NEAR_S`].
const FAR_S: f64 = 0.12;
/// The same for the direction of motion, s.
const HALF_STEP_S: f64 = 0.04;
/// Speed below which an axis counts as standing for play, m/s.
const STANDS_M_S: f64 = 2e-3;

/// Effect of a unit of each cause on the residuals of a scan at a solution.
pub(crate) struct Patterns {
    rows: Vec<Row>,
    sums: Sums,
    /// Root of the covariance of the unknowns from the observations evaluated.
    root: DMatrix<f64>,
}

/// A cause that is estimated with a prior of its usual size.
pub(crate) struct Allowed {
    /// Its most likely numbers.
    pub size: DVector<f64>,
    /// Their covariance.
    pub covariance: DMatrix<f64>,
    /// Change of the unknowns for a unit of each.
    pub unknowns_per_size: DMatrix<f64>,
}

impl Patterns {
    /// At a solution whose covariance has the root `root`.
    #[must_use]
    pub(crate) fn of(
        recording: &Recording,
        problem: &LineProblem<'_>,
        at: &Parameters,
        root: &DMatrix<f64>,
    ) -> Self {
        let every = stride(problem.list.len(), MOST_OBSERVATIONS);
        // With every n-th observation the variance of the unknowns is n times larger.
        let root = root * (every as f64).sqrt();
        let rows = rows(recording, problem, at, &root, every);
        let sums = Sums::of(&rows, root.ncols(), every > 1);
        Self { rows, sums, root }
    }

    /// Number of observations evaluated.
    #[must_use]
    pub(crate) fn len(&self) -> usize {
        self.rows.len()
    }

    /// The most likely sizes of some numbers beside the other unknowns. Patterns that these can reproduce are left out.
    #[must_use]
    pub(crate) fn solve(&self, columns: impl IntoIterator<Item = usize>) -> Option<Solved> {
        self.sums.solve(columns)
    }

    /// Change of the unknowns for a unit of each number.
    #[must_use]
    pub(crate) fn unknowns_per_size(&self) -> DMatrix<f64> {
        &self.root * &self.sums.cross
    }

    /// The numbers of a cause with the prior standard deviations `sigmas`, even if the other unknowns can reproduce them. `None` without such
    /// numbers.
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

    /// Correlation of neighbours that remains beside a cause.
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

/// Effect of a unit of each cause on a whitened residual.
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
    // The tool is at −c a from its reported place, so the measured point appears at +c a from the seam.
    columns.set_column(0, &(onto * acceleration));
    for axis in 0..3 {
        let towards = (velocity[axis] / STANDS_M_S).clamp(-1.0, 1.0);
        columns.set_column(1 + axis, &(onto.column(axis) * (0.5 * towards)));
    }
    columns.set_column(4, &(onto * -placement.angular_velocity.cross(&lever)));
    // A later exposure than stated is a smaller time offset.
    columns.set_column(5, &(jacobian.column(TIME_OFFSET) * row));
    columns.fixed_columns_mut::<2>(6).copy_from(&(pair.1.matrix() * pair.0.sheet_per_px() * side));
    // In 1/(1 + τ s) = exp(−τ s) + τ² s²/2 + … the delay belongs to the time offset. The tool is ahead by τ²/2 times its acceleration.
    columns.set_column(8, &(onto * of_point * -0.5));
    // The stated lens leaves the point displaced by the opposite amount.
    let by_lens = lens::moves(recording, &problem.observations.sheet, pair.0.row as usize);
    columns.fixed_columns_mut::<2>(LENS).copy_from(&(pair.1.matrix() * -by_lens.unwrap_or_default()));
    Some(columns)
}

/// The second derivative of a place, from four neighbouring times.
fn acceleration(time_s: f64, place: impl Fn(f64) -> Option<Vector3<f64>>) -> Option<Vector3<f64>> {
    let [before, near_before, near_after, after] =
        [-FAR_S, -NEAR_S, NEAR_S, FAR_S].map(|by| place(time_s + by));
    Some((before? - near_before? - near_after? + after?) / (FAR_S * FAR_S - NEAR_S * NEAR_S))
}

/// The half of the image in which a feature is (−1, 1), and its row from −½ to ½. 0 without an image.
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

/// Sizes of some causes, and zero for the others.
pub(crate) struct Solved {
    /// The sizes.
    pub size: SVector<f64, COLUMNS>,
    /// Their covariance from white noise.
    pub covariance: SMatrix<f64, COLUMNS, COLUMNS>,
    /// Part of the squares that they explain.
    pub gain: f64,
}

impl Sums {
    /// A subset of a scan's rows is not at its own optimum, so the unknowns are moved there.
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

    /// The most likely sizes of some causes beside the other unknowns. Patterns that these can reproduce are left out.
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

/// Correlation of neighbours that remains beside a cause.
fn neighbours(rows: &[Row], solved: &Solved, sums: &Sums) -> f64 {
    let step = &sums.cross * solved.size;
    let left: Vec<Vector2<f64>> =
        rows.iter().map(|row| row.residual - row.causes * solved.size + &row.slopes * &step).collect();
    let power: f64 = left.iter().map(Vector2::norm_squared).sum();
    let product: f64 = left.windows(2).map(|two| two[0].dot(&two[1])).sum();
    if power > 0.0 { product / power } else { 0.0 }
}
