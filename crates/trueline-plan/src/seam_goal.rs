//! A wanted seam error, and what a path leaves of it: quick enough for a search, which the rehearsal then confirms.
//!
//! Unknown are time offset, hand-eye, line and bow, and with what is known of them beforehand the sensor's five numbers of shape and the
//! six of the feature's bias with the tilt. The robot's errors are a Gaussian process over the poses that is not estimated: it moves
//! the estimate \[Schmidt1966\]. The seam error is the root mean square over the field that the scan visits, as in
//! `trueline_method::assess::seam_error`.

use crate::cell::Cell;
use crate::prediction::{NoiseLeft, Sight, Sights};
use crate::rehearsal::knowledge;
use nalgebra::{Matrix2, SMatrix, Vector2, Vector3};
use trueline_dataset::SensorSetup;
use trueline_geometry::so3;
use trueline_method::assess::robot_field::{RobotSigmas, alike};
use trueline_method::assess::tilt_bias::{BIAS, TiltBias};
use trueline_method::input::shape_knowledge::ShapeCovariance;
use trueline_method::problem::parameters::{ROTATION, TIME_OFFSET, TRANSLATION};
use trueline_method::problem::unknowns::{LOCAL_ALL, LOCAL_BOWED, LOCAL_STRAIGHT};
use trueline_model::SheetShape;

/// What is wanted of the seam error, and what is known beforehand of everything that adds to it.
#[derive(Clone, Debug, PartialEq)]
pub struct SeamGoal {
    /// One standard deviation, m.
    pub wanted_m: f64,
    /// Covariance of the sensor's shape.
    pub shape: ShapeCovariance,
    /// How far the robot is off within a scan.
    pub robot: RobotSigmas,
    /// Bias of the feature per 10° of tilt, px (m for sensors that report lengths are made of it as the estimator does).
    pub bias_px: f64,
    /// Speed along the seam in use, m/s.
    pub speed_m_s: f64,
}

/// Unknowns with the bias.
const ALL: usize = LOCAL_ALL + BIAS;
/// Robot errors change slowly along a path: of a search's frames about so many are asked.
const ROBOT_POSES: usize = 36;
/// Points of the field along each axis.
const GRID: usize = 3;
/// Part of the points that may lie beyond either end of the field.
const BEYOND: f64 = 0.02;

type Square = SMatrix<f64, ALL, ALL>;

impl SeamGoal {
    /// For a cell and what the sensor's file says; `None` where no scan of it can be made.
    #[must_use]
    pub fn of(cell: &Cell, setup: &SensorSetup, wanted_m: f64) -> Option<Self> {
        let (shape, robot, bias_px, speed_m_s) = knowledge(cell, setup)?;
        Some(Self { wanted_m, shape, robot, bias_px, speed_m_s })
    }

    /// The seam error that frames leave, each with its weight, m; `None` where something is not shown at all.
    #[must_use]
    pub fn left_m(&self, cell: &Cell, sights: &Sights, weights: &[f64]) -> Option<f64> {
        let seen = self.seen(cell, sights, weights);
        let mut information = sights.prior();
        for frame in &seen {
            information += frame.columns.transpose() * frame.columns * frame.weight;
        }
        let known = self.shape.cholesky()?.inverse();
        let mut shape = information.fixed_view_mut::<5, 5>(LOCAL_BOWED, LOCAL_BOWED);
        shape += known;
        let bias = if self.bias_px > 0.0 { self.bias_px.powi(-2) } else { f64::MAX.sqrt() };
        (LOCAL_ALL..ALL).for_each(|k| information[(k, k)] += bias);
        let covariance = inverse(&information)?;
        let field = self.field(cell, sights, weights)?;
        let noise = (field * covariance).trace();
        let spread = covariance * field * covariance;
        Some((noise + self.by_robot(&seen, &spread)).max(0.0).sqrt())
    }

    /// Whitened derivatives by all unknowns and the bias.
    fn seen(&self, cell: &Cell, sights: &Sights, weights: &[f64]) -> Vec<Seen> {
        let left = NoiseLeft::of(cell);
        let poses: Vec<_> = sights.list.iter().map(|sight| sight.placement.base_from_tool).collect();
        let tilt = TiltBias::about(&poses);
        let every = sights.list.len().div_ceil(ROBOT_POSES).max(1);
        let frames = sights.list.iter().zip(weights).enumerate().filter(|(_, (_, weight))| **weight > 0.0);
        let seen = frames.filter_map(|(k, (sight, weight))| {
            let (whitener, by_px) = sight.whitener(cell, &left)?;
            let mut columns = SMatrix::<f64, 2, ALL>::zeros();
            columns.fixed_columns_mut::<LOCAL_ALL>(0).copy_from(&(whitener * sight.columns()));
            let tilted = tilt.in_sensor(&sight.placement.tool_from_camera, &sight.placement);
            for axis in 0..3 {
                let moved = whitener * by_px * tilted[axis];
                columns.fixed_columns_mut::<2>(LOCAL_ALL + 2 * axis).copy_from(&moved);
            }
            let weight = weight * sights.stride() as f64;
            let robot = k.is_multiple_of(every).then(|| self.robot_columns(sight, &whitener) * every as f64);
            Some(Seen { columns, weight, robot, pose: sight.placement.base_from_tool })
        });
        seen.collect()
    }

    /// How a unit of each of the robot's six errors moves the whitened residual.
    fn robot_columns(&self, sight: &Sight, whitener: &Matrix2<f64>) -> SMatrix<f64, 2, 6> {
        let placement = &sight.placement;
        let in_tool = placement.tool_from_camera * nalgebra::Point3::from(sight.point_in_camera);
        let arm = placement.base_from_tool.rotation * in_tool.coords;
        let by_base = whitener * sight.onto_sheet();
        let mut columns = SMatrix::<f64, 2, 6>::zeros();
        columns.fixed_columns_mut::<3>(0).copy_from(&(by_base * self.robot.position_m));
        columns.fixed_columns_mut::<3>(3).copy_from(&(by_base * so3::hat(&arm) * -self.robot.attitude_rad));
        columns
    }

    /// Σ k(i, j) tr(aᵢᵀ N aⱼ) with aᵢ what the robot's errors at a pose put into the gradient.
    fn by_robot(&self, seen: &[Seen], spread: &Square) -> f64 {
        if self.robot == RobotSigmas::default() {
            return 0.0;
        }
        let moved: Vec<_> = seen
            .iter()
            .filter_map(|frame| {
                let pushed = frame.columns.transpose() * frame.robot? * frame.weight;
                Some((frame.pose, pushed, spread * pushed))
            })
            .collect();
        let mut sum = 0.0;
        for (k, (pose, pushed, own)) in moved.iter().enumerate() {
            sum += pushed.dot(own);
            for (other, _, theirs) in &moved[..k] {
                sum += 2.0 * alike(pose, other) * pushed.dot(theirs);
            }
        }
        sum
    }

    /// The mean of YᵀY over the field: how the unknowns move a seam point that is measured later.
    fn field(&self, cell: &Cell, sights: &Sights, weights: &[f64]) -> Option<Square> {
        let seen = sights.list.iter().zip(weights).filter(|(_, weight)| **weight > 0.0);
        let places: Vec<Vector2<f64>> =
            seen.map(|(sight, _)| cell.sheet.coordinates(&sight.point_in_camera)).collect();
        let ends: Vec<[f64; 2]> = (0..2).map(|axis| ends(&places, axis)).collect::<Option<_>>()?;
        let middle = sights.list.get(sights.list.len() / 2)?;
        let along = middle.placement.base_from_tool.rotation.inverse() * cell.seam.direction()?.into_inner();
        let origin = places.iter().sum::<Vector2<f64>>() / places.len() as f64;
        let shape = SheetShape::exact_about(&origin);
        let turn = cell.tool_from_camera.rotation.to_rotation_matrix().into_inner();
        let mut sum = Square::zeros();
        for k in 0..GRID * GRID {
            let part = |axis: usize, k: usize| {
                let [low, high] = ends[axis];
                low + (high - low) * k as f64 / (GRID - 1) as f64
            };
            let there = Vector2::new(part(0, k % GRID), part(1, k / GRID));
            let report = shape.reported(&there);
            let d_shape = turn * cell.sheet.axes() * -(report.d_true.try_inverse()? * report.d_shape);
            let point: Vector3<f64> = turn * cell.sheet.point(&there);
            let mut slope = SMatrix::<f64, 3, ALL>::zeros();
            slope.fixed_columns_mut::<1>(TIME_OFFSET).copy_from(&(along * -self.speed_m_s));
            slope.fixed_columns_mut::<3>(ROTATION).copy_from(&-so3::hat(&point));
            slope.fixed_columns_mut::<3>(TRANSLATION).fill_with_identity();
            slope.fixed_columns_mut::<5>(LOCAL_BOWED).copy_from(&d_shape);
            sum += slope.transpose() * slope / (GRID * GRID) as f64;
        }
        Some(sum)
    }
}

/// A frame's whitened derivatives.
struct Seen {
    columns: SMatrix<f64, 2, ALL>,
    weight: f64,
    robot: Option<SMatrix<f64, 2, 6>>,
    pose: trueline_geometry::Pose,
}

fn ends(places: &[Vector2<f64>], axis: usize) -> Option<[f64; 2]> {
    let mut values: Vec<f64> = places.iter().map(|place| place[axis]).collect();
    values.sort_by(f64::total_cmp);
    let last = values.len().checked_sub(1)? as f64;
    Some([BEYOND, 1.0 - BEYOND].map(|part| values[(part * last).round() as usize]))
}

/// By Cholesky, scaled; `None` if it is singular.
fn inverse(information: &Square) -> Option<Square> {
    let scale = information.diagonal().map(|d| 1.0 / d.max(f64::MIN_POSITIVE).sqrt());
    let scaled = Square::from_fn(|i, j| information[(i, j)] * scale[i] * scale[j]);
    let inverse = scaled.cholesky()?.inverse();
    Some(Square::from_fn(|i, j| inverse[(i, j)] * scale[i] * scale[j]))
}

impl Sights {
    /// What is known of the bow beforehand.
    fn prior(&self) -> Square {
        let mut prior = Square::zeros();
        (LOCAL_STRAIGHT..LOCAL_BOWED).for_each(|k| prior[(k, k)] = self.bow_sigma_m().powi(-2));
        prior
    }
}
