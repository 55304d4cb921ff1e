//! A required seam error, and that of a path: fast enough for a search; the rehearsal then confirms it.
//!
//! Unknowns are time offset, hand-eye, line and bow (or the planes of plates and edge and their forms). With a prior they
//! include the sensor's five numbers of shape and the six of the feature's bias with the tilt. The robot's errors are a Gaussian process over the
//! poses that is not estimated: it moves the estimate \[Schmidt1966\]. So does the radius of an edge, because the detector
//! finds its outermost point. The seam error is the root mean square over the field that the scan visits, as in
//! `trueline_method::assess::seam_error`.

use crate::cell::Cell;
use crate::evidence::{Evidence, FrameRows, HELD, add_square};
use crate::predicted_frames::PredictedFrames;
use crate::rehearsal::knowledge;
use nalgebra::{SMatrix, SVector, Vector2, Vector3};
use trueline_dataset::{Sensor, SensorSetup};
use trueline_geometry::so3;
use trueline_method::assess::robot_field::{RobotSigmas, alike};
use trueline_method::assess::tilt_bias::TiltBias;
use trueline_method::config::ASSUMED_EDGE_RADIUS_M;
use trueline_method::input::shape_knowledge::ShapeCovariance;
use trueline_method::problem::parameters::{ROTATION, TIME_OFFSET, TRANSLATION};
use trueline_model::SheetShape;

/// Required seam error, and the prior of all its contributions.
#[derive(Clone, Debug, PartialEq)]
pub struct SeamGoal {
    /// One standard deviation, m.
    pub wanted_m: f64,
    /// Covariance of the sensor's shape.
    pub shape: ShapeCovariance,
    /// Errors of the robot within a scan.
    pub robot: RobotSigmas,
    /// Radius of the edge behind the seam points, m. It is not in stripes, where two fitted lines cross.
    pub edge_radius_m: f64,
    /// Bias of the feature per 10° of tilt, px (converted to m for sensors that report lengths, as in the estimator).
    pub bias_px: f64,
    /// Speed along the seam in use, m/s.
    pub speed_m_s: f64,
}

/// Robot errors change slowly along a path: about this many of a search's frames are used.
const ROBOT_POSES: usize = 36;
/// Points of the field along each axis.
const GRID: usize = 3;
/// Part of the points that may lie beyond either end of the field.
const BEYOND: f64 = 0.02;

impl SeamGoal {
    /// For a cell and its sensor's file; `None` if no scan of it is possible.
    #[must_use]
    pub fn of(cell: &Cell, setup: &SensorSetup, wanted_m: f64) -> Option<Self> {
        let (shape, robot, bias_px, speed_m_s) = knowledge(cell, setup)?;
        let edge_radius_m = setup.edge_radius_m.unwrap_or(ASSUMED_EDGE_RADIUS_M);
        Some(Self { wanted_m, shape, robot, edge_radius_m, bias_px, speed_m_s })
    }

    /// The remaining seam error of frames, m; `None` if something is not determined at all. A is N and the coefficients of the
    /// bias.
    #[must_use]
    pub(crate) fn left_m<const ROWS: usize, const N: usize, const A: usize>(
        &self,
        cell: &Cell,
        sights: &PredictedFrames,
        evidence: &Evidence<ROWS, N>,
    ) -> Option<f64> {
        let seen = self.seen::<ROWS, N, A>(sights, evidence);
        let mut information = self.told(evidence, &seen)?;
        (N..A).for_each(|k| information[(k, k)] += self.known_of_bias());
        let covariance = inverse(&information)?;
        let field = self.field(cell, sights, evidence)?;
        let noise = (field * covariance).trace();
        let spread = covariance * field * covariance;
        let edge = self.by_edge(cell, sights, evidence, &seen, &spread)?;
        Some((noise + edge + self.by_robot(&seen, &spread)).max(0.0).sqrt())
    }

    /// Contribution of the edge's radius: the detector's point lies on the side of the sensor, away from the mean of the
    /// scan by as much as the view is.
    fn by_edge<const ROWS: usize, const N: usize, const A: usize>(
        &self,
        cell: &Cell,
        sights: &PredictedFrames,
        evidence: &Evidence<ROWS, N>,
        seen: &[Seen<ROWS, A>],
        spread: &SMatrix<f64, A, A>,
    ) -> Option<f64> {
        if self.edge_radius_m == 0.0 {
            return Some(0.0);
        }
        let along = cell.seam.direction()?.into_inner();
        let view = |frame: &FrameRows<ROWS, N>| {
            let sight = &sights.list[frame.sight];
            let base_from_camera = sight.placement.base_from_camera();
            // A picture's view starts at the camera's origin; for sensors that report lengths the range is the view.
            let towards = match cell.sensor {
                Sensor::CameraLaser { .. } => -(base_from_camera.rotation * sight.point_in_camera),
                _ => base_from_camera.rotation * cell.sheet.axes().column(1),
            };
            (towards - along * along.dot(&towards)).normalize()
        };
        let views: Vec<Vector3<f64>> = evidence.frames.iter().map(view).collect();
        let mean = views.iter().sum::<Vector3<f64>>() / views.len().max(1) as f64;
        let mut pushed = SVector::<f64, A>::zeros();
        for ((frame, seen), view) in evidence.frames.iter().zip(seen).zip(&views) {
            let column = frame.by_shift * (view - mean) * self.edge_radius_m;
            pushed += seen.columns.transpose() * column * seen.weight;
        }
        Some(pushed.dot(&(spread * pushed)))
    }

    /// Prior information of each number of the bias: one over its variance.
    fn known_of_bias(&self) -> f64 {
        if self.bias_px > 0.0 { self.bias_px.powi(-2) } else { HELD }
    }

    /// Information of frames, with the priors of form and shape; `None` for an exactly known shape.
    fn told<const ROWS: usize, const N: usize, const A: usize>(
        &self,
        evidence: &Evidence<ROWS, N>,
        seen: &[Seen<ROWS, A>],
    ) -> Option<SMatrix<f64, A, A>> {
        let mut information = SMatrix::<f64, A, A>::zeros();
        (evidence.asked..evidence.shape).for_each(|k| information[(k, k)] = evidence.known_of_form);
        for frame in seen {
            add_square(&mut information, &frame.columns.transpose(), frame.weight);
        }
        information.fill_lower_triangle_with_upper_triangle();
        evidence.held.iter().for_each(|&k| information[(k, k)] += HELD);
        let known = self.shape.cholesky()?.inverse();
        let mut shape = information.fixed_view_mut::<5, 5>(evidence.shape, evidence.shape);
        shape += known;
        Some(information)
    }

    /// Whitened derivatives by all unknowns and the bias.
    fn seen<const ROWS: usize, const N: usize, const A: usize>(
        &self,
        sights: &PredictedFrames,
        evidence: &Evidence<ROWS, N>,
    ) -> Vec<Seen<ROWS, A>> {
        let poses: Vec<_> = sights.list.iter().map(|sight| sight.placement.base_from_tool).collect();
        let tilt = TiltBias::about(&poses);
        let every = sights.list.len().div_ceil(ROBOT_POSES).max(1);
        let seen = evidence.frames.iter().map(|frame| {
            let placement = &sights.list[frame.sight].placement;
            let mut columns = SMatrix::<f64, ROWS, A>::zeros();
            columns.fixed_columns_mut::<N>(0).copy_from(&frame.columns);
            let tilted = tilt.in_sensor(&placement.tool_from_camera, placement);
            for axis in 0..3 {
                columns.fixed_columns_mut::<2>(N + 2 * axis).copy_from(&(frame.by_px * tilted[axis]));
            }
            let is_asked = frame.sight.is_multiple_of(every);
            let robot = is_asked.then(|| self.robot_columns(frame) * every as f64);
            Seen { columns, weight: frame.share * evidence.stride, robot, pose: placement.base_from_tool }
        });
        seen.collect()
    }

    /// How a unit of each of the robot's six errors moves the whitened residual.
    fn robot_columns<const ROWS: usize, const N: usize>(
        &self,
        frame: &FrameRows<ROWS, N>,
    ) -> SMatrix<f64, ROWS, 6> {
        let mut columns = SMatrix::<f64, ROWS, 6>::zeros();
        columns.fixed_columns_mut::<3>(0).copy_from(&(frame.by_shift * self.robot.position_m));
        columns.fixed_columns_mut::<3>(3).copy_from(&(frame.by_turn * self.robot.attitude_rad));
        columns
    }

    /// Σ k(i, j) tr(aᵢᵀ N aⱼ) with aᵢ the contribution of the robot's errors at a pose to the gradient.
    fn by_robot<const ROWS: usize, const A: usize>(
        &self,
        seen: &[Seen<ROWS, A>],
        spread: &SMatrix<f64, A, A>,
    ) -> f64 {
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
    fn field<const ROWS: usize, const N: usize, const A: usize>(
        &self,
        cell: &Cell,
        sights: &PredictedFrames,
        evidence: &Evidence<ROWS, N>,
    ) -> Option<SMatrix<f64, A, A>> {
        let seen = evidence.frames.iter().map(|frame| &sights.list[frame.sight].point_in_camera);
        let places: Vec<Vector2<f64>> = seen.map(|point| cell.sheet.coordinates(point)).collect();
        let ends: Vec<[f64; 2]> = (0..2).map(|axis| ends(&places, axis)).collect::<Option<_>>()?;
        let middle = sights.list.get(sights.list.len() / 2)?;
        let along = middle.placement.base_from_tool.rotation.inverse() * cell.seam.direction()?.into_inner();
        let origin = places.iter().sum::<Vector2<f64>>() / places.len() as f64;
        let shape = SheetShape::exact_about(&origin);
        let turn = cell.tool_from_camera.rotation.to_rotation_matrix().into_inner();
        let mut sum = SMatrix::<f64, A, A>::zeros();
        for k in 0..GRID * GRID {
            let part = |axis: usize, k: usize| {
                let [low, high] = ends[axis];
                low + (high - low) * k as f64 / (GRID - 1) as f64
            };
            let there = Vector2::new(part(0, k % GRID), part(1, k / GRID));
            let report = shape.reported(&there);
            let d_shape = turn * cell.sheet.axes() * -(report.d_true.try_inverse()? * report.d_shape);
            let point: Vector3<f64> = turn * cell.sheet.point(&there);
            let mut slope = SMatrix::<f64, 3, A>::zeros();
            slope.fixed_columns_mut::<1>(TIME_OFFSET).copy_from(&(along * -self.speed_m_s));
            slope.fixed_columns_mut::<3>(ROTATION).copy_from(&-so3::hat(&point));
            slope.fixed_columns_mut::<3>(TRANSLATION).fill_with_identity();
            slope.fixed_columns_mut::<5>(evidence.shape).copy_from(&d_shape);
            sum += slope.transpose() * slope / (GRID * GRID) as f64;
        }
        Some(sum)
    }
}

/// A frame's whitened derivatives.
struct Seen<const ROWS: usize, const A: usize> {
    columns: SMatrix<f64, ROWS, A>,
    weight: f64,
    robot: Option<SMatrix<f64, ROWS, 6>>,
    pose: trueline_geometry::Pose,
}

fn ends(places: &[Vector2<f64>], axis: usize) -> Option<[f64; 2]> {
    let mut values: Vec<f64> = places.iter().map(|place| place[axis]).collect();
    values.sort_by(f64::total_cmp);
    let last = values.len().checked_sub(1)? as f64;
    Some([BEYOND, 1.0 - BEYOND].map(|part| values[(part * last).round() as usize]))
}

/// By Cholesky, scaled; `None` if it is singular.
fn inverse<const A: usize>(information: &SMatrix<f64, A, A>) -> Option<SMatrix<f64, A, A>> {
    let scale = information.diagonal().map(|d| 1.0 / d.max(f64::MIN_POSITIVE).sqrt());
    let scaled = SMatrix::<f64, A, A>::from_fn(|i, j| information[(i, j)] * scale[i] * scale[j]);
    let inverse = scaled.cholesky()?.inverse();
    Some(SMatrix::from_fn(|i, j| inverse[(i, j)] * scale[i] * scale[j]))
}
