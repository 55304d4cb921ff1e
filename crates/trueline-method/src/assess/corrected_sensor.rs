//! The corrected sensor file, and the frame in which that file places points.
//!
//! A profiler, or points, store the shape itself. A camera has no shape but focal lengths, principal point and laser plane. Only five combinations
//! of those seven numbers are observable, and the numbers also move the sheet as a whole. The most likely seven given their prior are taken, and the
//! frame follows the sheet.

use crate::assess::file_frame::FileFrame;
use crate::input::camera_sensor::CameraSensor;
use crate::input::observations::Observations;
use crate::problem::parameters::Parameters;
use nalgebra::{DMatrix, DVector, Matrix3, SMatrix, Vector2, Vector3};
use trueline_dataset::sensor_setup::{SensorParameter, SensorUncertainty, SheetShape};
use trueline_dataset::{Recording, Sensor};
use trueline_geometry::{Pose, se3, so3};

/// A sensor as corrected by the scan.
#[derive(Clone, Debug, PartialEq)]
pub struct CorrectedSensor {
    /// The sensor.
    pub sensor: Sensor,
    /// The correction of its sheet, if its file has one.
    pub shape: Option<SheetShape>,
    /// Uncertainty of that correction: the prior of the sensor for another scan. `None` for a camera, whose numbers a scan separates only with their
    /// prior.
    pub uncertainty: Option<SensorUncertainty>,
    /// The frame in which it places points.
    pub frame: FileFrame,
}

/// Assumed standard deviations of a camera's numbers if its file states none: focal lengths (relative), principal point (px), plane (rad, m).
const ASSUMED: (f64, f64, f64, f64) = (3e-3, 10.0, 3.5e-3, 0.3e-3);
/// A number stated to be exact may still change by this fraction of the assumed uncertainty, if no other can.
const LEAST_PART: f64 = 1e-2;
/// Tolerance for the corrected points, m. It is far below noise, so that the prior only chooses between equivalent sensors.
const MET_M: f64 = 1e-8;
/// Maximum Gauss–Newton steps.
const STEPS: usize = 8;

impl CorrectedSensor {
    /// From a solution with a shape, and the covariance of all unknowns. `None` without a shape, or if no camera produces it.
    #[must_use]
    pub fn of(
        recording: &Recording,
        observations: &Observations,
        at: &Parameters,
        covariance: &DMatrix<f64>,
    ) -> Option<Self> {
        let shape = at.shape?;
        let as_found = FileFrame::of_estimate();
        let (sensor, frame) = match &recording.sensor {
            Sensor::CameraLaser { camera, laser_plane_in_camera } => {
                let sensor = CameraSensor { camera: *camera, plane: *laser_plane_in_camera };
                let (corrected, frame) = corrected_camera(&sensor, recording, observations, at)?;
                let CameraSensor { camera, plane } = corrected;
                (Sensor::CameraLaser { camera, laser_plane_in_camera: plane }, frame)
            }
            // A sheet that was fitted to points is stored with them.
            Sensor::Points { .. } => {
                let plane = *observations.sheet.plane();
                (Sensor::Points { laser_plane_in_camera: Some(plane) }, as_found)
            }
            Sensor::Profiler => (Sensor::Profiler, as_found),
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
            frame,
        })
    }
}

/// The estimated shape added to the correction in the sensor's file.
#[must_use]
pub fn total(recording: &Recording, found: &SheetShape) -> SheetShape {
    recording.setup.shape.as_ref().map_or(*found, |first| found.after(first))
}

/// The most likely camera and laser plane that reproduce the corrected points, with their frame.
fn corrected_camera(
    old: &CameraSensor,
    recording: &Recording,
    observations: &Observations,
    at: &Parameters,
) -> Option<(CameraSensor, FileFrame)> {
    let pixels = old.sample(recording);
    let (sheet, shape) = (&observations.sheet, at.shape?);
    let wanted: Vec<(Vector3<f64>, SMatrix<f64, 3, 5>)> = pixels
        .iter()
        .map(|pixel| {
            let point = old.point(pixel)?;
            let d_shape = shape.d_corrected_d_shape(&sheet.coordinates(&point))?;
            Some((at.corrected(sheet, &point), sheet.axes() * d_shape))
        })
        .collect::<Option<_>>()?;
    let (order, information) = numbers(old, recording)?;
    let n = order.len();
    let (mut sensor, mut moved, mut off) = (*old, Pose::identity(), DVector::zeros(n));
    let mut d_moved = SMatrix::<f64, 6, 5>::zeros();
    for _ in 0..STEPS {
        let fields = sensor.fields(&order, &pixels)?;
        let mut hessian = DMatrix::zeros(n + 6, n + 6);
        let mut gradient = DVector::zeros(n + 6);
        let mut by_shape = DMatrix::zeros(n + 6, 5);
        for (k, (pixel, (wanted, d_wanted))) in pixels.iter().zip(&wanted).enumerate() {
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
            by_shape += slope.transpose() * (d_wanted / MET_M);
        }
        let mut known = hessian.view_mut((0, 0), (n, n));
        known += &information;
        let mut pull = gradient.rows_mut(0, n);
        pull -= &information * &off;
        let scale = DVector::from_iterator(n + 6, hessian.diagonal().iter().map(|d| d.sqrt().recip()));
        let scaled = DMatrix::from_fn(n + 6, n + 6, |i, j| hessian[(i, j)] * scale[i] * scale[j]);
        let solver = scaled.cholesky()?;
        let step = solver.solve(&gradient.component_mul(&scale)).component_mul(&scale);
        let scales = DMatrix::from_diagonal(&scale);
        d_moved = (&scales * solver.solve(&(&scales * by_shape))).fixed_view::<6, 5>(n, 0).into_owned();
        for (parameter, by) in order.iter().zip(step.iter()) {
            sensor = sensor.moved(*parameter, *by)?;
        }
        off += step.rows(0, n);
        let (turn, shift) = (step.fixed_rows::<3>(n).into(), step.fixed_rows::<3>(n + 3).into());
        moved = se3::retract_decoupled(&moved, &turn, &shift);
    }
    Some((sensor, FileFrame { camera_from_file: moved, d_shape: d_moved }))
}

/// The camera's numbers that may be corrected, and their prior information: the inverse of their covariance.
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
