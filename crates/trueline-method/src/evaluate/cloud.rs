//! Places every measured point of a recording in base, frame by frame, with a known calibration.

use crate::config::Config;
use crate::error::Error;
use crate::input::observations::{self, point_in_camera};
use crate::input::robot_motion::RobotMotion;
use crate::input::skip::Skip;
use crate::input::timestamps::{Dejittered, Sampling};
use crate::problem::placement::placement_at;
use nalgebra::{SMatrix, Vector3};
use trueline_dataset::{Guess, Measured, Recording, Sensor};
use trueline_model::{Placement, SheetShape};

/// Nanoseconds in a second.
const NS_PER_S: f64 = 1e9;

/// The path of a recording with a calibration that places its points.
#[derive(Clone, Debug)]
pub struct CloudPath {
    robot: RobotMotion,
    origin_ns: i64,
    by: Guess,
    sensor: Sensor,
    shape: Option<SheetShape>,
}

/// Contributions to a point's uncertainty besides the motion.
#[derive(Clone, Copy, Debug)]
pub struct CloudNoise {
    /// Covariance of time offset (s), hand-eye rotation (rad) and translation (m).
    pub links: SMatrix<f64, 7, 7>,
    /// Standard deviation of a reading along each axis of the sheet, m.
    pub reading_m: f64,
}

impl CloudPath {
    /// The path of a recording, by recorded stamps. The recording needs no seam points.
    ///
    /// # Errors
    /// A robot stream that is no trajectory, or does not move.
    pub fn of(recording: &Recording, by: &Guess, config: &Config) -> Result<Self, Error> {
        let origin_ns = observations::origin_ns(recording);
        let sampling = Sampling::of(recording, origin_ns);
        let robot = RobotMotion::of(recording, sampling.robot_times_s(Dejittered::default()), config)?;
        let (sensor, shape) = (recording.sensor.clone(), recording.setup.shape);
        Ok(Self { robot, origin_ns, by: *by, sensor, shape })
    }

    /// The same with another calibration.
    #[must_use]
    pub fn by(&self, by: &Guess) -> Self {
        Self { by: *by, ..self.clone() }
    }

    /// Pose of the sensor at the exposure of a frame.
    ///
    /// # Errors
    /// [`Skip::Outside`] and [`Skip::Gap`] if the robot's pose is unknown.
    pub fn at(&self, stamp_ns: i64) -> Result<Placement, Skip> {
        let exposure_s = (stamp_ns - self.origin_ns) as f64 / NS_PER_S - self.by.time_offset_s;
        let (start, end) = self.robot.trajectory.span();
        let missing = if exposure_s < start || exposure_s > end { Skip::Outside } else { Skip::Gap };
        placement_at(&self.robot.trajectory, exposure_s, &self.by.tool_from_camera).ok_or(missing)
    }

    /// A reading in the camera frame, m, corrected by the sensor's shape.
    ///
    /// # Errors
    /// A pixel without a ray, a ray that does not meet the laser plane, a reading of another sensor.
    pub fn point_in_camera(&self, measured: Measured) -> Result<Vector3<f64>, Skip> {
        point_in_camera(&self.sensor, self.shape.as_ref(), measured)
    }

    /// The uncertainty of a point of the camera frame, m: the RMS distance of the placed point from the true one.
    #[must_use]
    pub fn sigma_m(&self, placement: &Placement, point_in_camera: &Vector3<f64>, noise: &CloudNoise) -> f64 {
        let jacobian = placement.jacobian(point_in_camera);
        let mut by_links = SMatrix::<f64, 3, 7>::zeros();
        by_links.set_column(0, &jacobian.d_point_d_time_offset);
        by_links.fixed_view_mut::<3, 3>(0, 1).copy_from(&jacobian.d_point_d_rotation);
        by_links.fixed_view_mut::<3, 3>(0, 4).copy_from(&jacobian.d_point_d_translation);
        let by_calibration = (by_links * noise.links * by_links.transpose()).trace();
        let by_robot = 3.0 * self.robot.noise_m.powi(2);
        // The error of a reading is within the sheet.
        (by_calibration + by_robot + 2.0 * noise.reading_m.powi(2)).max(0.0).sqrt()
    }
}
