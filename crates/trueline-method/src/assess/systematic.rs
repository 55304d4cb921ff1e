//! What the estimate owes to errors that are not noise: the robot's, the sensor's where it is held, the feature's.
//!
//! With whitened residuals r = J x + Z ξ and ξ of unit variance, an estimate that does not know of ξ is off by
//! −C₀ Jᵀ W Z ξ: the consider covariance \[Schmidt1966\]. Each kind of error is a set of such columns C₀ Jᵀ W Z.

use crate::assess::robot_field::RobotField;
use crate::input::noise_levels::Whitener;
use crate::input::observations::Observation;
use crate::input::shape_knowledge::ShapeCovariance;
use crate::problem::line_problem::{LineProblem, LocalJacobian};
use crate::problem::parameters::Parameters;
use crate::problem::unknowns::{LOCAL_BOWED, Unknowns};
use crate::solve::seam_chart::with_shape;
use nalgebra::{DMatrix, SMatrix, UnitQuaternion, Vector2, Vector3};
use trueline_geometry::{Pose, so3};
use trueline_model::Placement;

/// How far the estimate is moved by each kind of error: columns in the tangent, each of unit variance.
#[derive(Clone, Debug)]
pub struct Systematic {
    /// By the robot.
    pub robot: DMatrix<f64>,
    /// By the sensor's own calibration, where that is held; the columns are those of `sensor_shape`.
    pub sensor: DMatrix<f64>,
    /// The shapes that go with the columns of `sensor` (5 × columns).
    pub sensor_shape: DMatrix<f64>,
    /// By the feature's bias with the tilt.
    pub feature_bias: DMatrix<f64>,
}

/// How large the errors are taken to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SystematicLevels {
    /// Absolute accuracy of the robot, m.
    pub robot_accuracy_m: f64,
    /// Whether somebody stated it; else it is assumed.
    pub robot_is_stated: bool,
    /// Bias of the feature per 10° of tilt, px.
    pub feature_bias_px: f64,
    /// Covariance of the shape of a sensor that is held; `None` where it is estimated, or exact.
    pub held_shape: Option<ShapeCovariance>,
}

/// Observations that are looked at; of more, every so many stand for the rest.
const SAMPLE: usize = 3000;
/// The tilt that a bias is stated for, rad.
const BIAS_TILT_RAD: f64 = 10.0 * std::f64::consts::PI / 180.0;
/// Noise of a feature that a bias in pixels is compared with where features are lengths, px.
const USUAL_SIGMA_PX: f64 = 0.3;

impl Systematic {
    /// At a solution whose covariance's root is `root` (C₀ = root rootᵀ).
    #[must_use]
    pub fn of(
        problem: &LineProblem<'_>,
        at: &Parameters,
        root: &DMatrix<f64>,
        levels: &SystematicLevels,
    ) -> Self {
        let every = problem.list.len().div_ceil(SAMPLE).max(1);
        let seen = placed(problem, at, every);
        let poses: Vec<Pose> = seen.iter().map(|(_, placement)| placement.base_from_tool).collect();
        let field = RobotField::new(levels.robot_accuracy_m, &poses);
        let mean = mean_attitude(&poses);
        let with_shape = with_shape(problem.observations, at.clone());
        let held = levels.held_shape.and_then(|covariance| covariance.cholesky()).map(|c| c.l());
        let mut sums = Sums::zeros(root.nrows(), field.as_ref().map_or(0, RobotField::modes));
        for (pair, placement) in &seen {
            let Some((residual, jacobian)) = problem.whitened_where(*pair, &with_shape, placement) else {
                continue;
            };
            let weight = problem.loss.weight(residual.norm_squared()) * every as f64;
            let row = Row { unknowns: &problem.unknowns, line: pair.0.line as usize, jacobian, weight };
            if held.is_some() {
                let columns: SMatrix<f64, 2, 5> = row.jacobian.fixed_columns::<5>(LOCAL_BOWED).into();
                row.add(&mut sums.shape, &DMatrix::from_column_slice(2, 5, columns.as_slice()));
            }
            if levels.feature_bias_px > 0.0 {
                let tilt = so3::log(&(mean.inverse() * placement.base_from_tool.rotation));
                let in_sensor = at.tool_from_camera.rotation.inverse() * tilt / BIAS_TILT_RAD;
                let shift_m = range_per_px_m(pair.0) * levels.feature_bias_px;
                let columns = pair.1.matrix() * Vector2::new(0.0, shift_m) * in_sensor.transpose();
                row.add(&mut sums.bias, &DMatrix::from_column_slice(2, 3, columns.as_slice()));
            }
            if let Some(columns) =
                field.as_ref().and_then(|field| robot_columns(field, problem, *pair, at, placement))
            {
                row.add(&mut sums.robot, &columns);
            }
        }
        let moved = |sum: &DMatrix<f64>| -(root * (root.transpose() * sum));
        let held =
            held.map_or_else(|| DMatrix::zeros(5, 0), |l| DMatrix::from_column_slice(5, 5, l.as_slice()));
        Self {
            robot: moved(&sums.robot),
            sensor: moved(&(&sums.shape * &held)),
            sensor_shape: held,
            feature_bias: moved(&sums.bias),
        }
    }

    /// The covariance that all of them together add.
    #[must_use]
    pub fn covariance(&self) -> DMatrix<f64> {
        let own = |columns: &DMatrix<f64>| columns * columns.transpose();
        own(&self.robot) + own(&self.sensor) + own(&self.feature_bias)
    }
}

/// Jᵀ W Z of each kind.
struct Sums {
    robot: DMatrix<f64>,
    shape: DMatrix<f64>,
    bias: DMatrix<f64>,
}

impl Sums {
    fn zeros(unknowns: usize, modes: usize) -> Self {
        let [robot, shape, bias] = [6 * modes, 5, 3].map(|columns| DMatrix::zeros(unknowns, columns));
        Self { robot, shape, bias }
    }
}

/// One observation's part of them.
struct Row<'a> {
    unknowns: &'a Unknowns,
    line: usize,
    jacobian: LocalJacobian,
    weight: f64,
}

impl Row<'_> {
    fn add(&self, sum: &mut DMatrix<f64>, columns: &DMatrix<f64>) {
        for local in 0..self.unknowns.local() {
            let row = self.jacobian.column(local).transpose() * columns * self.weight;
            let mut target = sum.row_mut(self.unknowns.place(local, self.line));
            target += row;
        }
    }
}

/// How each mode of the robot's field moves a whitened residual.
fn robot_columns(
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
    let position = onto * field.position_sigma_m;
    let attitude = onto * -so3::hat(&lever) * field.attitude_sigma_rad;
    let by_mode = field.at(&placement.base_from_tool);
    let mut columns = DMatrix::zeros(2, 6 * by_mode.len());
    for (k, amplitude) in by_mode.iter().enumerate() {
        columns.view_mut((0, 6 * k), (2, 3)).copy_from(&(position * *amplitude));
        columns.view_mut((0, 6 * k + 3), (2, 3)).copy_from(&(attitude * *amplitude));
    }
    Some(columns)
}

/// Every so many observations with its whitener and where the sensor was.
fn placed<'a>(
    problem: &'a LineProblem<'_>,
    at: &Parameters,
    every: usize,
) -> Vec<((&'a Observation, &'a Whitener), Placement)> {
    let mut hint = 0;
    let sample = problem.selected().step_by(every);
    sample.filter_map(|pair| Some((pair, problem.placement(pair.0, at, &mut hint)?))).collect()
}

fn mean_attitude(poses: &[Pose]) -> UnitQuaternion<f64> {
    let Some(first) = poses.first() else { return UnitQuaternion::identity() };
    let turns = poses.iter().map(|pose| so3::log(&(first.rotation.inverse() * pose.rotation)));
    first.rotation * so3::exp(&(turns.sum::<Vector3<f64>>() / poses.len() as f64))
}

/// How far a pixel is along the range, m; of sensors that report lengths, what their noise would be.
fn range_per_px_m(o: &Observation) -> f64 {
    let sigma_px = if o.sigma_px > 0.0 { f64::from(o.sigma_px) } else { USUAL_SIGMA_PX };
    o.covariance[2].sqrt() / sigma_px
}
