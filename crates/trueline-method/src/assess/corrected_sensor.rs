//! The sensor's file as the scan corrects it, and the hand-eye transform that goes with it.
//!
//! A profiler, or points, take the shape as it is. A camera has no shape but focal lengths, principal point and laser plane.
//! Of those seven only five are seen, and they also move the sheet as a whole; so the most likely seven are taken, given how
//! well each was known before, and the hand-eye transform follows the sheet. A sensor that takes no correction at all is
//! served best by the rigid motion nearest to it.

use crate::input::camera_sensor::CameraSensor;
use crate::input::observations::Observations;
use crate::problem::parameters::Parameters;
use nalgebra::{DMatrix, DVector, Matrix3, Vector2, Vector3};
use trueline_dataset::sensor_setup::{SensorParameter, SensorUncertainty, SheetShape};
use trueline_dataset::{Recording, Sensor};
use trueline_geometry::{Pose, se3, so3};

/// A sensor as the scan corrects it.
#[derive(Clone, Debug, PartialEq)]
pub struct CorrectedSensor {
    /// The sensor.
    pub sensor: Sensor,
    /// The correction of its sheet, where it takes one.
    pub shape: Option<SheetShape>,
    /// How well that correction is known: what is known of the sensor before another scan. `None` of a camera, whose numbers
    /// a scan tells apart only with what was known of them before.
    pub uncertainty: Option<SensorUncertainty>,
    /// The hand-eye transform that goes with it.
    pub tool_from_camera: Pose,
    /// What a sensor that takes no correction is served best by.
    pub uncorrected: Uncorrected,
}

/// The best for a sensor that takes no correction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Uncorrected {
    /// The hand-eye transform.
    pub tool_from_camera: Pose,
    /// How far off its points are, RMS over the points of the scan, m.
    pub remains_m: f64,
}

/// How well a camera's numbers are taken to be known where its file does not say: focal lengths (part), principal point
/// (px), plane (rad, m).
const ASSUMED: (f64, f64, f64, f64) = (3e-3, 10.0, 3.5e-3, 0.3e-3);
/// A number that is stated to be exact may still take this part of what is assumed otherwise, where nothing else can.
const LEAST_PART: f64 = 1e-2;
/// The corrected points are met to within this, m: far below noise, so that what is known of the numbers only chooses
/// between sensors that are equal.
const MET_M: f64 = 1e-8;
/// Most steps of Gauss and Newton.
const STEPS: usize = 8;
/// Points that stand for the scan.
const SAMPLE: usize = 200;

impl CorrectedSensor {
    /// Of a solution with a shape, and the covariance of all unknowns; `None` without one, or where no camera has it.
    #[must_use]
    pub fn of(
        recording: &Recording,
        observations: &Observations,
        at: &Parameters,
        covariance: &DMatrix<f64>,
    ) -> Option<Self> {
        let shape = at.shape?;
        let uncorrected = uncorrected(observations, at)?;
        let (sensor, camera_from_corrected) = match &recording.sensor {
            Sensor::CameraLaser { camera, laser_plane_in_camera } => {
                let sensor = CameraSensor { camera: *camera, plane: *laser_plane_in_camera };
                let (corrected, moved) = corrected_camera(&sensor, recording, observations, at)?;
                let CameraSensor { camera, plane } = corrected;
                (Sensor::CameraLaser { camera, laser_plane_in_camera: plane }, moved)
            }
            // The sheet that was fitted to points is written with them.
            Sensor::Points { .. } => {
                let plane = *observations.sheet.plane();
                (Sensor::Points { laser_plane_in_camera: Some(plane) }, Pose::identity())
            }
            Sensor::Profiler => (Sensor::Profiler, Pose::identity()),
        };
        let takes_shape = !matches!(sensor, Sensor::CameraLaser { .. });
        Some(Self {
            sensor,
            shape: takes_shape.then(|| total(recording, &shape)),
            uncertainty: takes_shape.then(|| {
                let first = at.unknowns().shape().start;
                let covariance = covariance.fixed_view::<5, 5>(first, first).into_owned();
                let before = recording.setup.uncertainty.iter().flat_map(|before| before.found_from.iter());
                let found_from = before.chain(recording.measured_inputs()).cloned().collect();
                SensorUncertainty { found_from, ..SensorUncertainty::of_shape(&covariance) }
            }),
            tool_from_camera: at.tool_from_camera * camera_from_corrected,
            uncorrected,
        })
    }
}

/// What was found of a shape on top of what the sensor's file corrects already.
#[must_use]
pub fn total(recording: &Recording, found: &SheetShape) -> SheetShape {
    recording.setup.shape.as_ref().map_or(*found, |first| found.after(first))
}

/// The rigid motion that carries points nearest to others, by Gauss and Newton from the identity.
fn nearest_rigid(points: &[(Vector3<f64>, Vector3<f64>)]) -> Option<Pose> {
    let mut motion = Pose::identity();
    for _ in 0..STEPS {
        let mut slopes = DMatrix::zeros(3 * points.len(), 6);
        let mut gap = DVector::zeros(3 * points.len());
        for (k, (from, to)) in points.iter().enumerate() {
            let moved = motion * nalgebra::Point3::from(*from);
            slopes.view_mut((3 * k, 0), (3, 3)).copy_from(&-so3::hat(&(motion.rotation * from)));
            slopes.view_mut((3 * k, 3), (3, 3)).copy_from(&Matrix3::identity());
            gap.rows_mut(3 * k, 3).copy_from(&(to - moved.coords));
        }
        let step = slopes.svd(true, true).solve(&gap, 1e-12).ok()?;
        motion =
            se3::retract_decoupled(&motion, &step.fixed_rows::<3>(0).into(), &step.fixed_rows::<3>(3).into());
    }
    Some(motion)
}

fn uncorrected(observations: &Observations, at: &Parameters) -> Option<Uncorrected> {
    let every = observations.list.len().div_ceil(SAMPLE).max(1);
    let points: Vec<_> = observations
        .list
        .iter()
        .step_by(every)
        .map(|o| (o.point_in_camera, at.corrected(&observations.sheet, &o.point_in_camera)))
        .collect();
    let motion = nearest_rigid(&points)?;
    let squares =
        points.iter().map(|(from, to)| (motion * nalgebra::Point3::from(*from) - to).coords.norm_squared());
    let remains_m = (squares.sum::<f64>() / points.len() as f64).sqrt();
    Some(Uncorrected { tool_from_camera: at.tool_from_camera * motion, remains_m })
}

/// The most likely camera and laser plane that measure what the shape corrects, and the motion between their frame and the
/// old one.
fn corrected_camera(
    old: &CameraSensor,
    recording: &Recording,
    observations: &Observations,
    at: &Parameters,
) -> Option<(CameraSensor, Pose)> {
    let pixels = old.sample(recording);
    let wanted: Vec<Vector3<f64>> = pixels
        .iter()
        .map(|pixel| Some(at.corrected(&observations.sheet, &old.point(pixel)?)))
        .collect::<Option<_>>()?;
    let (order, information) = numbers(old, recording)?;
    let n = order.len();
    let (mut sensor, mut moved, mut off) = (*old, Pose::identity(), DVector::zeros(n));
    for _ in 0..STEPS {
        let fields = sensor.fields(&order, &pixels)?;
        let mut hessian = DMatrix::zeros(n + 6, n + 6);
        let mut gradient = DVector::zeros(n + 6);
        for (k, (pixel, wanted)) in pixels.iter().zip(&wanted).enumerate() {
            let there = moved.rotation * sensor.point(pixel)?;
            let mut slope = DMatrix::zeros(3, n + 6);
            let turn = moved.rotation.to_rotation_matrix().into_inner();
            slope.columns_mut(0, n).copy_from(&(turn * fields.rows(3 * k, 3)));
            slope.view_mut((0, n), (3, 3)).copy_from(&-so3::hat(&there));
            slope.view_mut((0, n + 3), (3, 3)).copy_from(&Matrix3::identity());
            slope /= MET_M;
            let gap = (wanted - there - moved.translation.vector) / MET_M;
            hessian += slope.transpose() * &slope;
            gradient += slope.transpose() * gap;
        }
        let mut known = hessian.view_mut((0, 0), (n, n));
        known += &information;
        let mut pull = gradient.rows_mut(0, n);
        pull -= &information * &off;
        let scale = DVector::from_iterator(n + 6, hessian.diagonal().iter().map(|d| d.sqrt().recip()));
        let scaled = DMatrix::from_fn(n + 6, n + 6, |i, j| hessian[(i, j)] * scale[i] * scale[j]);
        let step = scaled.cholesky()?.solve(&gradient.component_mul(&scale)).component_mul(&scale);
        for (parameter, by) in order.iter().zip(step.iter()) {
            sensor = sensor.moved(*parameter, *by)?;
        }
        off += step.rows(0, n);
        let (turn, shift) = (step.fixed_rows::<3>(n).into(), step.fixed_rows::<3>(n + 3).into());
        moved = se3::retract_decoupled(&moved, &turn, &shift);
    }
    Some((sensor, moved))
}

/// The camera's numbers that may be corrected, and how well they are known: the inverse of their covariance.
fn numbers(sensor: &CameraSensor, recording: &Recording) -> Option<(Vec<SensorParameter>, DMatrix<f64>)> {
    use SensorParameter::{Cx, Cy, Fx, Fy, NormalE1, NormalE2, Offset};
    let (focal, centre, tilt, offset) = ASSUMED;
    let focal: Vector2<f64> = sensor.camera.focal * focal;
    let order = vec![Fx, Fy, Cx, Cy, NormalE1, NormalE2, Offset];
    let assumed = [focal.x, focal.y, centre, centre, tilt, tilt, offset];
    let stated = recording.setup.uncertainty.as_ref().and_then(|uncertainty| sensor.stated(uncertainty));
    let mut covariance = DMatrix::zeros(order.len(), order.len());
    for (i, row) in order.iter().enumerate() {
        let least = (assumed[i] * if stated.is_some() { LEAST_PART } else { 1.0 }).powi(2);
        for (j, column) in order.iter().enumerate() {
            covariance[(i, j)] = stated.as_ref().map_or(0.0, |(of, matrix)| {
                let place = |wanted| of.iter().position(|parameter| parameter == wanted);
                place(row).zip(place(column)).map_or(0.0, |(i, j)| matrix[(i, j)])
            });
        }
        covariance[(i, i)] += least;
    }
    Some((order, covariance.cholesky()?.inverse()))
}
