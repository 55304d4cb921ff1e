//! Systematic errors of the estimate: from the robot, from a sensor that is held fixed, and from the feature.
//!
//! With whitened residuals r = J x + Z ξ and ξ of unit variance, an estimate that ignores ξ is off by −C₀ Jᵀ W Z ξ: the consider covariance
//! \[Schmidt1966\]. Each kind of error is a set of such columns C₀ Jᵀ W Z. The bias of the feature can be considered, or be estimated beside x. If
//! it is estimated, x has the remaining error of the bias, and the effects of the other errors on x and on the bias together.

use crate::assess::levels::SystematicLevels;
use crate::assess::robot_field::RobotField;
use crate::assess::share::{Share, ShareOf};
use crate::assess::tilt_bias::{BIAS, TiltBias};
use crate::input::noise_levels::Whitener;
use crate::input::observations::Observation;
use crate::problem::layout::Layout;
use crate::problem::line_problem::LineProblem;
use crate::problem::parameters::Parameters;
use crate::problem::simd::WhitenedRow;
use crate::problem::unknowns::{LOCAL_ALL, LOCAL_BOWED};
use crate::solve::seam_chart::with_shape;
use crate::thinning::stride;
use nalgebra::{DMatrix, DVector, SMatrix, SVector, Vector3};
use trueline_geometry::{Pose, so3};
use trueline_model::Placement;

/// Effect of each kind of error on the estimate: columns in the tangent, each of unit variance.
#[derive(Clone, Debug)]
pub struct Systematic {
    /// Robot.
    pub robot: DMatrix<f64>,
    /// The sensor's own calibration, if it is held. The columns correspond to those of `sensor_shape`.
    pub sensor: DMatrix<f64>,
    /// The shapes for the columns of `sensor` (5 × columns).
    pub sensor_shape: DMatrix<f64>,
    /// The feature's bias with the tilt, or its remaining part.
    pub feature_bias: DMatrix<f64>,
    /// Held quantities that are not known exactly. Each column contains the quantity itself in its own row.
    pub held: DMatrix<f64>,
}

/// Observations on which the robot's errors are looked at; of more, one in several represents the rest, for these errors change
/// slowly along the path.
const MOST_OBSERVATIONS: usize = 800;

/// Maximum number of poses for the mean attitude of a scan and the robot's modes.
const POSES: usize = 3_000;

impl Systematic {
    /// The total covariance of all of them.
    #[must_use]
    pub fn covariance(&self) -> DMatrix<f64> {
        let own = |columns: &DMatrix<f64>| columns * columns.transpose();
        own(&self.robot) + own(&self.sensor) + own(&self.feature_bias) + own(&self.held)
    }

    /// They as shares of an error, each of equal errors in every answer of the scan.
    #[must_use]
    pub(crate) fn shares(&self) -> Vec<Share> {
        let share = |of: ShareOf, columns: &DMatrix<f64>, shape: Option<&DMatrix<f64>>| Share {
            of,
            columns: columns.clone(),
            shape: shape.cloned(),
        };
        let all = [
            share(ShareOf::Robot, &self.robot, None),
            share(ShareOf::Sensor, &self.sensor, Some(&self.sensor_shape)),
            share(ShareOf::Detector, &self.feature_bias, None),
            share(ShareOf::Held, &self.held, None),
        ];
        all.into_iter().filter(|share| share.columns.ncols() > 0).collect()
    }

    /// The same with held components of the tangent and their standard deviations, SI. `hessian` is over all components, and `root` is that of the
    /// covariance of the others.
    #[must_use]
    pub(crate) fn with_held(
        self,
        hessian: &DMatrix<f64>,
        root: &DMatrix<f64>,
        sigmas: &[(usize, f64)],
    ) -> Self {
        let mut held = DMatrix::zeros(root.nrows(), sigmas.len());
        for (column, (component, sigma)) in sigmas.iter().enumerate() {
            let moved = root * (root.transpose() * hessian.column(*component)) * -*sigma;
            held.set_column(column, &moved);
            held[(*component, column)] = *sigma;
        }
        Self { held, ..self }
    }
}

/// A bias that is estimated beside the other unknowns.
#[derive(Clone, Copy, Debug)]
pub struct BiasEstimate {
    /// The bias, px per 10°.
    pub px: SVector<f64, BIAS>,
    /// Covariance of its error from noise, robot and prior, px².
    pub covariance: SMatrix<f64, BIAS, BIAS>,
    /// uᵀ C_u⁻¹ u with the effect of noise and robot on the score u: χ²₆ for a detector without bias.
    pub wald: f64,
}

/// Remaining error of the bias that was removed from the features, px per 10°, by kind of error: columns of unit variance, as in [`Systematic`].
#[derive(Clone, Debug)]
pub struct BiasError {
    /// The bias that was not estimated, and noise.
    pub own: DMatrix<f64>,
    /// Robot.
    pub robot: DMatrix<f64>,
    /// The sensor's own calibration, if it is held.
    pub sensor: DMatrix<f64>,
}

/// Jᵀ W Z of each kind, for an estimate whose covariance is C₀ = root rootᵀ.
#[derive(Clone)]
pub(crate) struct SystematicSums {
    /// The tilt convention of the bias.
    pub tilt: TiltBias,
    /// The robot's errors; `None` for an ideal robot.
    pub field: Option<RobotField>,
    root: DMatrix<f64>,
    robot: DMatrix<f64>,
    shape: DMatrix<f64>,
    held: DMatrix<f64>,
    bias: DMatrix<f64>,
    bias_level_px: f64,
    /// The products of the bias columns with all others, and with the residuals.
    bias_robot: DMatrix<f64>,
    bias_shape: DMatrix<f64>,
    bias_square: SMatrix<f64, BIAS, BIAS>,
    bias_gradient: SVector<f64, BIAS>,
}

impl SystematicSums {
    /// At a solution whose covariance has the root `root`.
    #[must_use]
    pub(crate) fn of(
        problem: &LineProblem<'_>,
        at: &Parameters,
        root: &DMatrix<f64>,
        levels: &SystematicLevels,
    ) -> Self {
        let poses = poses(problem, at);
        let field = RobotField::new(levels.robot, &poses);
        Self::with_field(problem, at, root, levels, (field, TiltBias::about(&poses)))
    }

    /// At a solution near that of other sums, with their robot, path and mean attitude.
    #[must_use]
    pub(crate) fn beside(
        other: &Self,
        problem: &LineProblem<'_>,
        at: &Parameters,
        root: &DMatrix<f64>,
        levels: &SystematicLevels,
    ) -> Self {
        Self::with_field(problem, at, root, levels, (other.field.clone(), other.tilt))
    }

    fn with_field(
        problem: &LineProblem<'_>,
        at: &Parameters,
        root: &DMatrix<f64>,
        levels: &SystematicLevels,
        (field, tilt): (Option<RobotField>, TiltBias),
    ) -> Self {
        let mut sums = Self::zeros(root, tilt, field.as_ref().map_or(0, RobotField::modes));
        sums.bias_level_px = levels.feature_bias_px;
        let held = levels.held_shape.and_then(|covariance| covariance.cholesky()).map(|c| c.l());
        sums.held =
            held.map_or_else(|| DMatrix::zeros(5, 0), |l| DMatrix::from_column_slice(5, 5, l.as_slice()));
        sums.field = field;
        sums.add(problem, at);
        sums
    }

    /// Adds the features of another problem of the same robot, sensor and seam at the same state.
    pub(crate) fn add(&mut self, problem: &LineProblem<'_>, at: &Parameters) {
        let every = stride(problem.list.len(), MOST_OBSERVATIONS);
        let with_shape = with_shape(problem.observations, at.clone());
        let field = self.field.take();
        let mut by_line = vec![LineSums::default(); at.lines.len()];
        problem.for_each_whitened(&with_shape, |k, WhitenedRow { residual, jacobian }| {
            let pair = (&problem.list[k], &problem.whiteners[k]);
            let Some(placement) = problem.placement(pair.0, at) else { return };
            let weight = problem.loss.weight(residual.norm_squared());
            let line = pair.0.line as usize;
            let bias = if self.bias_level_px > 0.0 {
                pair.1.matrix() * self.tilt.slopes(pair.0, at, &placement)
            } else {
                SMatrix::zeros()
            };
            let weighted_bias = bias * weight;
            by_line[line].bias += jacobian.tr_mul(&weighted_bias);
            self.bias_square += bias.tr_mul(&weighted_bias);
            self.bias_gradient += weighted_bias.tr_mul(residual);
            if self.held.ncols() > 0 {
                let columns: SMatrix<f64, 2, 5> = jacobian.fixed_columns::<5>(LOCAL_BOWED) * weight;
                by_line[line].shape += jacobian.tr_mul(&columns);
                self.bias_shape += bias.transpose() * columns;
            }
            let Some(field) = field.as_ref().filter(|_| k.is_multiple_of(every)) else { return };
            if let Some(columns) = robot_columns(field, problem, pair, at, &placement) {
                let weight = weight * every as f64;
                let by_local = jacobian.transpose() * &columns * weight;
                problem.unknowns.add_rows(line, &by_local, &mut self.robot);
                self.bias_robot += bias.transpose() * &columns * weight;
            }
        });
        for (line, of_line) in by_line.iter().enumerate() {
            problem.unknowns.add_rows(line, &of_line.bias, &mut self.bias);
            problem.unknowns.add_rows(line, &of_line.shape, &mut self.shape);
        }
        self.field = field;
    }

    /// Re-estimates the bias after the other unknowns have moved by `step` since these sums, to where their gradient is zero. The root of their
    /// covariance is `root`.
    pub(crate) fn bias_after(
        &mut self,
        step: &DVector<f64>,
        root: DMatrix<f64>,
        corrected_px: &SVector<f64, BIAS>,
        inflation: f64,
    ) -> Option<DVector<f64>> {
        self.root = root;
        let at_sums = self.bias_gradient;
        self.bias_gradient += SVector::from_fn(|k, _| self.bias.column(k).dot(step));
        let found = self.bias(corrected_px, inflation);
        self.bias_gradient = at_sums;
        let moved_px = found?.px - corrected_px;
        Some(self.spread(&self.bias) * DVector::from_column_slice(moved_px.as_slice()))
    }

    fn zeros(root: &DMatrix<f64>, tilt: TiltBias, modes: usize) -> Self {
        let [robot, shape, bias] = [6 * modes, 5, BIAS].map(|columns| DMatrix::zeros(root.nrows(), columns));
        let [bias_robot, bias_shape] = [6 * modes, 5].map(|columns| DMatrix::zeros(BIAS, columns));
        Self {
            tilt,
            field: None,
            root: root.clone(),
            robot,
            shape,
            held: DMatrix::zeros(5, 0),
            bias,
            bias_level_px: 0.0,
            bias_robot,
            bias_shape,
            bias_square: SMatrix::zeros(),
            bias_gradient: SVector::zeros(),
        }
    }

    /// Replaces the prior level of the bias.
    pub(crate) fn set_bias_level(&mut self, level_px: f64) {
        self.bias_level_px = level_px;
    }

    /// C₀ times columns.
    fn spread(&self, columns: &DMatrix<f64>) -> DMatrix<f64> {
        &self.root * (self.root.transpose() * columns)
    }

    /// Effect of each kind of error on an estimate; the levels state whether the bias was estimated.
    #[must_use]
    pub(crate) fn systematic(&self, levels: &SystematicLevels, inflation: f64) -> Systematic {
        self.with(&self.bias_error(levels, inflation))
    }

    /// The same for an estimate that assumes zero bias.
    #[must_use]
    pub(crate) fn with_bias_held(&self) -> Systematic {
        self.with(&self.held_bias())
    }

    /// The same with an estimated bias. `inflation` is the ratio of the noise's covariance to that of white noise. `None` without a bias.
    #[must_use]
    pub(crate) fn with_bias_estimated(&self, inflation: f64) -> Option<Systematic> {
        Some(self.with(&self.estimated_bias(inflation)?))
    }

    /// Remaining error of the bias. The levels state whether it was estimated.
    #[must_use]
    pub(crate) fn bias_error(&self, levels: &SystematicLevels, inflation: f64) -> BiasError {
        let estimated = levels.bias_is_estimated.then(|| self.estimated_bias(inflation)).flatten();
        estimated.unwrap_or_else(|| self.held_bias())
    }

    fn with(&self, bias: &BiasError) -> Systematic {
        let by_bias = self.spread(&self.bias);
        Systematic {
            robot: &by_bias * &bias.robot - self.spread(&self.robot),
            sensor: &by_bias * &bias.sensor - self.spread(&(&self.shape * &self.held)),
            sensor_shape: self.held.clone(),
            feature_bias: by_bias * &bias.own,
            held: DMatrix::zeros(self.root.nrows(), 0),
        }
    }

    /// The error of a bias that is assumed zero is the full bias.
    fn held_bias(&self) -> BiasError {
        BiasError {
            own: DMatrix::identity(BIAS, BIAS) * -self.bias_level_px,
            robot: DMatrix::zeros(BIAS, self.robot.ncols()),
            sensor: DMatrix::zeros(BIAS, self.held.ncols()),
        }
    }

    /// Remaining error of an estimated bias: G(S b + u) − b, with u the effect of noise, robot and sensor on its score.
    fn estimated_bias(&self, inflation: f64) -> Option<BiasError> {
        let own = self.own_score();
        let gain = self.bias_gain(&own, inflation)?;
        let missed = (gain * own - SMatrix::<f64, BIAS, BIAS>::identity()) * self.bias_level_px;
        let by_noise = gain * own.cholesky()?.l() * inflation.sqrt();
        let mut left = DMatrix::zeros(BIAS, 2 * BIAS);
        left.columns_mut(0, BIAS).copy_from(&missed);
        left.columns_mut(BIAS, BIAS).copy_from(&by_noise);
        let gain = dynamic(&gain);
        Some(BiasError {
            own: left,
            robot: &gain * self.in_score(&self.robot, &self.bias_robot),
            sensor: &gain * self.in_score(&(&self.shape * &self.held), &(&self.bias_shape * &self.held)),
        })
    }

    /// The bias of features from which `corrected_px` was already removed: the linear estimate of least mean square, given the effect of noise and
    /// robot on its score. `None` without a bias.
    #[must_use]
    pub(crate) fn bias(&self, corrected_px: &SVector<f64, BIAS>, inflation: f64) -> Option<BiasEstimate> {
        let own = self.own_score();
        let gain = self.bias_gain(&own, inflation)?;
        // The gradient of the others is zero at their optimum, so this is the score beside them.
        let score = self.bias_gradient + own * corrected_px;
        let others = self.other_scores(&own, inflation);
        let missed = (SMatrix::<f64, BIAS, BIAS>::identity() - gain * own) * self.bias_level_px;
        let covariance = missed * missed.transpose() + gain * others * gain.transpose();
        Some(BiasEstimate {
            px: gain * score,
            covariance,
            wald: score.dot(&others.cholesky()?.solve(&score)),
        })
    }

    /// J_bᵀ W Z − J_bᵀ W J C₀ Jᵀ W Z: the effect of columns on the score of the bias beside the other unknowns.
    fn in_score(&self, columns: &DMatrix<f64>, with_bias: &DMatrix<f64>) -> DMatrix<f64> {
        with_bias - self.bias.transpose() * self.spread(columns)
    }

    /// S: the effect of a bias on its own score, and the covariance of the score from white noise.
    fn own_score(&self) -> SMatrix<f64, BIAS, BIAS> {
        let own = self.in_score(&self.bias, &dynamic(&self.bias_square));
        let own = fixed(&(&own + own.transpose())) * 0.5;
        // A tilt that does not occur has no score.
        own + SMatrix::identity() * (LEAST_SCORE * own.trace()).max(f64::MIN_POSITIVE)
    }

    /// Covariance of the score from noise and robot.
    fn other_scores(&self, own: &SMatrix<f64, BIAS, BIAS>, inflation: f64) -> SMatrix<f64, BIAS, BIAS> {
        let robot = self.in_score(&self.robot, &self.bias_robot);
        own * inflation + fixed(&(&robot * robot.transpose()))
    }

    /// P S (S P S + C_u)⁻¹.
    fn bias_gain(&self, own: &SMatrix<f64, BIAS, BIAS>, inflation: f64) -> Option<SMatrix<f64, BIAS, BIAS>> {
        if self.bias_level_px <= 0.0 {
            return None;
        }
        let prior = self.bias_level_px.powi(2);
        let all = own * own * prior + self.other_scores(own, inflation);
        let all = (all + all.transpose()) * 0.5;
        Some(all.cholesky()?.solve(&(own * prior)).transpose())
    }
}

/// Least information on each number of a bias, relative to their mean: rounding.
const LEAST_SCORE: f64 = 1e-9;

fn dynamic(matrix: &SMatrix<f64, BIAS, BIAS>) -> DMatrix<f64> {
    DMatrix::from_column_slice(BIAS, BIAS, matrix.as_slice())
}

fn fixed(matrix: &DMatrix<f64>) -> SMatrix<f64, BIAS, BIAS> {
    SMatrix::from_iterator(matrix.iter().copied())
}

/// Poses of a scan, sampled if there are many.
fn poses(problem: &LineProblem<'_>, at: &Parameters) -> Vec<Pose> {
    let some = problem.list.iter().step_by(stride(problem.list.len(), POSES));
    some.filter_map(|o| Some(problem.placement(o, at)?.base_from_tool)).collect()
}

/// Jᵀ W Z of the observations of one line, by their local unknowns.
#[derive(Clone, Default)]
struct LineSums {
    bias: SMatrix<f64, LOCAL_ALL, BIAS>,
    shape: SMatrix<f64, LOCAL_ALL, 5>,
}

/// Effect of each mode of the robot's field on a whitened residual.
pub(crate) fn robot_columns(
    field: &RobotField,
    problem: &LineProblem<'_>,
    pair: (&Observation, &Whitener),
    at: &Parameters,
    placement: &Placement,
) -> Option<DMatrix<f64>> {
    let onto = problem.whitened_displacement(pair, at, placement)?;
    let measured = at.corrected(&problem.observations.sheet, &pair.0.point_in_camera);
    let lever: Vector3<f64> =
        placement.point_in_base(&measured) - placement.base_from_tool.translation.vector;
    let position = onto * field.sigmas.position_m;
    let attitude = onto * -so3::hat(&lever) * field.sigmas.attitude_rad;
    let by_mode = field.at(&placement.base_from_tool);
    let mut columns = DMatrix::zeros(2, 6 * by_mode.len());
    for (k, amplitude) in by_mode.iter().enumerate() {
        columns.view_mut((0, 6 * k), (2, 3)).copy_from(&(position * *amplitude));
        columns.view_mut((0, 6 * k + 3), (2, 3)).copy_from(&(attitude * *amplitude));
    }
    Some(columns)
}
