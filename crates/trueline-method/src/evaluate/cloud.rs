//! Places every measured point of a recording in base, frame by frame, with a known calibration.

use crate::config::Config;
use crate::error::Error;
use crate::input::observations::{self, point_by_sheet, sheet_of_sensor};
use crate::input::robot_motion::RobotMotion;
use crate::input::skip::Skip;
use crate::input::timestamps::{Dejittered, Sampling};
use crate::problem::placement::placement_at;
use nalgebra::{Matrix3, Matrix4, SMatrix, Vector3};
use std::collections::BTreeMap;
use trueline_dataset::{Guess, Measured, Recording, Sensor};
use trueline_model::{LaserSheet, Placement, SheetShape};

/// Nanoseconds in a second.
const NS_PER_S: f64 = 1e9;

/// The path of a recording with a calibration that places its points.
#[derive(Clone, Debug)]
pub struct CloudPath {
    robot: RobotMotion,
    origin_ns: i64,
    by: Guess,
    sensor: Sensor,
    sheet: LaserSheet,
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

/// The sensor at the exposure of a frame.
#[derive(Clone, Copy, Debug)]
pub struct CloudFrame {
    /// Velocity of the tool in base, m/s.
    pub velocity: Vector3<f64>,
    rotation: Matrix3<f64>,
    shift: Vector3<f64>,
    /// The variance of a point p of the camera frame is (p, 1)ᵀ Q (p, 1), m².
    spread: Option<Matrix4<f64>>,
}

/// A reading that was placed.
#[derive(Clone, Copy, Debug)]
pub struct CloudReading {
    /// Its number among the readings of the frame.
    pub index: usize,
    /// In the camera frame, m.
    pub in_camera: Vector3<f64>,
    /// In base, m.
    pub in_base: Vector3<f64>,
    /// The RMS distance from the true point, m, if it was to be computed.
    pub sigma_m: Option<f64>,
}

impl CloudFrame {
    /// A point of the camera frame in base, m.
    #[must_use]
    pub fn point_in_base(&self, point_in_camera: &Vector3<f64>) -> Vector3<f64> {
        self.rotation * point_in_camera + self.shift
    }

    fn sigma_m(&self, point_in_camera: &Vector3<f64>) -> Option<f64> {
        let point = point_in_camera.push(1.0);
        self.spread.map(|spread| point.dot(&(spread * point)).max(0.0).sqrt())
    }
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
        Ok(Self { robot, origin_ns, by: *by, sheet: sheet_of_sensor(&sensor), sensor, shape })
    }

    /// Pose of the sensor at the exposure of a frame, with the uncertainty of its points if the noise is given.
    ///
    /// # Errors
    /// [`Skip::Outside`] and [`Skip::Gap`] if the robot's pose is unknown.
    pub fn at(&self, stamp_ns: i64, noise: Option<&CloudNoise>) -> Result<CloudFrame, Skip> {
        self.after(stamp_ns, self.by.time_offset_s, noise)
    }

    /// The same as if the time offset were zero.
    ///
    /// # Errors
    /// As [`CloudPath::at`].
    pub fn at_stamp(&self, stamp_ns: i64) -> Result<CloudFrame, Skip> {
        self.after(stamp_ns, 0.0, None)
    }

    fn after(
        &self,
        stamp_ns: i64,
        time_offset_s: f64,
        noise: Option<&CloudNoise>,
    ) -> Result<CloudFrame, Skip> {
        let exposure_s = (stamp_ns - self.origin_ns) as f64 / NS_PER_S - time_offset_s;
        let (start, end) = self.robot.trajectory.span();
        let missing = if exposure_s < start || exposure_s > end { Skip::Outside } else { Skip::Gap };
        let placement = placement_at(&self.robot.trajectory, exposure_s, &self.by.tool_from_camera);
        let placement = placement.ok_or(missing)?;
        let base_from_camera = placement.base_from_camera();
        Ok(CloudFrame {
            velocity: placement.velocity,
            rotation: base_from_camera.rotation.to_rotation_matrix().into_inner(),
            shift: base_from_camera.translation.vector,
            spread: noise.map(|noise| self.spread(&placement, noise)),
        })
    }

    /// Places the readings of a frame; counts those that cannot be by their reason.
    pub fn place(
        &self,
        at: &CloudFrame,
        readings: &[Measured],
        placed: &mut Vec<CloudReading>,
        skipped: &mut BTreeMap<Skip, usize>,
    ) {
        placed.clear();
        for (index, measured) in readings.iter().enumerate() {
            match point_by_sheet(&self.sensor, &self.sheet, self.shape.as_ref(), *measured) {
                Ok(in_camera) => placed.push(CloudReading {
                    index,
                    in_camera,
                    in_base: at.point_in_base(&in_camera),
                    sigma_m: at.sigma_m(&in_camera),
                }),
                Err(reason) => *skipped.entry(reason).or_insert(0) += 1,
            }
        }
    }

    /// The form of the variance. A point moves with each number of the calibration by an affine function of its place p, S₀ + Σ pₖ Sₖ, so
    /// that Qᵢⱼ is the trace of Sᵢ Σ Sⱼᵀ.
    fn spread(&self, placement: &Placement, noise: &CloudNoise) -> Matrix4<f64> {
        let at = |point: &Vector3<f64>| {
            let jacobian = placement.jacobian(point);
            let mut by_links = SMatrix::<f64, 3, 7>::zeros();
            by_links.set_column(0, &jacobian.d_point_d_time_offset);
            by_links.fixed_view_mut::<3, 3>(0, 1).copy_from(&jacobian.d_point_d_rotation);
            by_links.fixed_view_mut::<3, 3>(0, 4).copy_from(&jacobian.d_point_d_translation);
            by_links
        };
        let origin = at(&Vector3::zeros());
        let slopes = [0, 1, 2, 3].map(|k| match k {
            3 => origin,
            _ => at(&Vector3::ith(k, 1.0)) - origin,
        });
        let by_slope = slopes.map(|slope| slope * noise.links);
        let mut form = Matrix4::from_fn(|i, j| by_slope[i].component_mul(&slopes[j]).sum());
        // The error of a reading is within the sheet.
        form[(3, 3)] += 3.0 * self.robot.noise_m.powi(2) + 2.0 * noise.reading_m.powi(2);
        form
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use trueline_geometry::{Pose, se3, so3};

    fn recording() -> Recording {
        let robot = (0..500).map(|k| {
            let time_s = 0.004 * f64::from(k);
            let turn = so3::exp(&Vector3::new(0.3 * time_s, 2.5, 0.2 * (3.0 * time_s).sin()));
            let base_from_tool = se3::from_parts(turn, Vector3::new(0.4 * time_s, 0.1, 0.5));
            trueline_dataset::RobotSample {
                stamp_ns: 4_000_000 * i64::from(k),
                device_ns: None,
                base_from_tool,
            }
        });
        Recording::new(
            Sensor::Profiler,
            trueline_dataset::SensorSetup::default(),
            robot.collect(),
            Vec::new(),
        )
    }

    /// The calibration moved by one standard deviation of one of its numbers moves the point by its ±.
    #[test]
    fn the_uncertainty_of_a_point_is_its_motion_with_each_number() {
        const STEP: f64 = 1e-6;
        let by = Guess {
            time_offset_s: 0.02,
            tool_from_camera: se3::from_parts(
                so3::exp(&Vector3::new(0.2, -0.4, 0.7)),
                Vector3::new(0.05, -0.1, 0.2),
            ),
        };
        let path = |by: &Guess| CloudPath::of(&recording(), by, &Config::default()).unwrap();
        let place = |path: &CloudPath, noise: Option<&CloudNoise>| {
            let (mut placed, mut skipped) = (Vec::new(), BTreeMap::new());
            let at = path.at(1_003_000_000, noise).unwrap();
            path.place(
                &at,
                &[Measured::Profile([0.03, 0.25]), Measured::Pixel([1.0, 2.0])],
                &mut placed,
                &mut skipped,
            );
            assert_eq!((placed.len(), skipped.get(&Skip::NoRay)), (1, Some(&1)));
            placed[0]
        };
        let still = CloudNoise { links: SMatrix::zeros(), reading_m: 0.0 };
        let bare = place(&path(&by), Some(&still));
        for number in 0..7 {
            let mut noise = still;
            noise.links[(number, number)] = STEP * STEP;
            let mut delta = [0.0; 7];
            delta[number] = STEP;
            let [time_s, turn @ .., x, y, z] = delta;
            let moved = Guess {
                time_offset_s: by.time_offset_s + time_s,
                tool_from_camera: se3::retract_decoupled(
                    &by.tool_from_camera,
                    &Vector3::from(turn),
                    &Vector3::new(x, y, z),
                ),
            };
            let moved_m = (place(&path(&moved), None).in_base - bare.in_base).norm();
            let [with, without] = [place(&path(&by), Some(&noise)), bare].map(|point| point.sigma_m.unwrap());
            let by_number_m = (with * with - without * without).sqrt();
            // Second order: STEP²; and rounding of squares beside the robot's.
            assert!(
                (by_number_m - moved_m).abs() < 1e-3 * moved_m + 1e-11,
                "{number}: {by_number_m} {moved_m}"
            );
        }
    }

    #[test]
    fn a_frame_outside_the_recording_is_skipped() {
        let by = Guess { time_offset_s: 0.0, tool_from_camera: Pose::identity() };
        let path = CloudPath::of(&recording(), &by, &Config::default()).unwrap();
        assert_eq!(path.at(3_000_000_000, None).unwrap_err(), Skip::Outside);
        assert!(path.at_stamp(1_000_000_000).is_ok());
    }
}
