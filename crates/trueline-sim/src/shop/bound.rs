//! The Cramér–Rao bound of a scan: how exactly its readings with their noise alone could show where seam points are in the tool.
//!
//! Derivatives are differences of the forward projection. The unknowns are time offset (s), hand-eye rotation (rad) and translation (m),
//! and the line's four numbers.

use super::truth::CheckPoint;
use crate::capture::{SheetAxes, measure, point_on_sheet};
use crate::scenario::SensorModel;
use nalgebra::{Matrix3, SMatrix, SVector, Vector3, Vector4};
use trueline_dataset::Measured;
use trueline_geometry::{Line, Pose, se3, so3};

/// Unknowns.
const COUNT: usize = 11;
type Information = SMatrix<f64, COUNT, COUNT>;
type Step = SVector<f64, COUNT>;

/// Steps of the differences: s, rad, m.
const STEPS: [f64; COUNT] = [1e-4, 1e-5, 1e-5, 1e-5, 1e-6, 1e-6, 1e-6, 1e-5, 1e-5, 1e-6, 1e-6];
/// Images in the computation; the others have the same information.
const MOST_IMAGES: usize = 300;
/// Value of a scan without information, m.
pub(crate) const NOTHING_SHOWN_M: f64 = 1.0;

/// A scan without errors.
pub(crate) struct IdealScan<'a> {
    pub(crate) sensor: &'a SensorModel,
    pub(crate) base_from_tool: &'a dyn Fn(f64) -> Pose,
    pub(crate) tool_from_camera: Pose,
    pub(crate) line: Line,
}

impl IdealScan<'_> {
    /// Reading at a time, s, with the unknowns changed; two numbers in the sensor's own coordinates.
    fn reading(&self, sheet: &SheetAxes, time_s: f64, step: &Step) -> Option<[f64; 2]> {
        let part = |first: usize| Vector3::new(step[first], step[first + 1], step[first + 2]);
        let tool_from_camera = se3::retract_decoupled(&self.tool_from_camera, &part(1), &part(4));
        let line = self.line.retract(&Vector4::from_fn(|k, _| step[7 + k]));
        let base_from_camera = (self.base_from_tool)(time_s - step[0]) * tool_from_camera;
        let point = point_on_sheet(sheet, &base_from_camera, &line)?;
        Some(match measure(self.sensor, &point)? {
            Measured::Pixel(pixel) => pixel,
            Measured::Profile(place) => place,
            Measured::Point(_) => {
                let at = sheet.camera_from_sheet.inverse() * (point - sheet.middle);
                [at.x, at.z]
            }
        })
    }

    /// The information of readings at some times, s, each with a standard deviation.
    fn information(&self, times_s: &[f64], sigma: f64) -> Information {
        let sheet = SheetAxes::of(self.sensor);
        let every = times_s.len().div_ceil(MOST_IMAGES).max(1);
        let mut information = Information::zeros();
        for time_s in times_s.iter().step_by(every) {
            let slopes: Option<Vec<[f64; 2]>> = (0..COUNT)
                .map(|k| {
                    let mut step = Step::zeros();
                    step[k] = STEPS[k];
                    let (up, down) =
                        (self.reading(&sheet, *time_s, &step)?, self.reading(&sheet, *time_s, &-step)?);
                    Some([0, 1].map(|axis| (up[axis] - down[axis]) / (2.0 * STEPS[k])))
                })
                .collect();
            for axis in 0..2 {
                if let Some(slopes) = &slopes {
                    let row = Step::from_fn(|k, _| slopes[k][axis] / sigma);
                    information += row * row.transpose();
                }
            }
        }
        information * every as f64
    }

    /// RMS of the smallest error that check points at a speed, m/s, can have, m.
    pub(crate) fn bound_m(&self, times_s: &[f64], sigma: f64, points: &[CheckPoint], speed_m_s: f64) -> f64 {
        let scale = Step::from_column_slice(&STEPS);
        let scaled = Information::from_diagonal(&scale)
            * self.information(times_s, sigma)
            * Information::from_diagonal(&scale);
        let Some(covariance) = scaled.cholesky().map(|cholesky| cholesky.inverse()) else {
            return NOTHING_SHOWN_M;
        };
        let mean_square: f64 = points
            .iter()
            .map(|point| {
                let lever = so3::hat(&(point.in_tool - self.tool_from_camera.translation.vector));
                let mut y = SMatrix::<f64, 3, COUNT>::zeros();
                y.set_column(0, &(point.velocity_in_tool * speed_m_s));
                y.fixed_view_mut::<3, 3>(0, 1).copy_from(&-lever);
                y.fixed_view_mut::<3, 3>(0, 4).copy_from(&Matrix3::identity());
                let y = y * SMatrix::<f64, COUNT, COUNT>::from_diagonal(&scale);
                (y * covariance * y.transpose()).trace()
            })
            .sum::<f64>()
            / points.len().max(1) as f64;
        mean_square.sqrt().min(NOTHING_SHOWN_M)
    }
}
