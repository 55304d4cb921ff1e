//! A calibration as the placer needs it.

use crate::external_axis::{ExternalAxis, MOST_AXES};
use nalgebra::{Matrix3, SMatrix};
use trueline_geometry::{Plane, Pose};
use trueline_model::{Camera, LaserSheet, SheetShape};

/// Covariance of time offset (s), hand-eye rotation (left, tool frame, rad) and hand-eye translation (m), in this order.
pub type LinksCovariance = SMatrix<f64, 7, 7>;

/// Kind of readings of the sensor.
#[derive(Clone, Debug)]
pub enum SensorModel {
    /// Pixels of a camera that sees a laser plane.
    CameraLaser {
        /// The camera.
        camera: Camera,
        /// The laser plane in the camera frame.
        laser_plane_in_camera: Plane,
    },
    /// Points (x, z) of a profiler, m.
    Profiler,
    /// Points in the camera frame, m.
    Points {
        /// The sheet in the camera frame, if there is one: a shape corrects its coordinates.
        laser_plane_in_camera: Option<Plane>,
    },
}

impl SensorModel {
    /// The sheet that the sensor measures in.
    #[must_use]
    pub(crate) fn sheet(&self) -> LaserSheet {
        match self {
            Self::CameraLaser { laser_plane_in_camera: plane, .. }
            | Self::Points { laser_plane_in_camera: Some(plane) } => LaserSheet::from_plane(*plane),
            Self::Profiler | Self::Points { laser_plane_in_camera: None } => LaserSheet::of_profiler(),
        }
    }
}

/// Carrier of the sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Carrier {
    /// The robot carries the sensor: points come out in base.
    #[default]
    Tool,
    /// The sensor stands beside the robot, which carries the part. Points are then in the frame of the tool, and
    /// [`PlacerCalibration::tool_from_camera`] is `base_from_camera`.
    Fixed,
}

/// A finished calibration: everything that a [`crate::Placer`] takes from it.
#[derive(Clone, Debug)]
pub struct PlacerCalibration {
    /// Kind of readings of the sensor.
    pub sensor: SensorModel,
    /// The correction of the sheet's coordinates; `None` for a sensor without error.
    pub shape: Option<SheetShape>,
    /// Hand-eye transform of the corrected sensor.
    pub tool_from_camera: Pose,
    /// Time offset, s: the image stamped t was exposed at t − offset.
    pub time_offset_s: f64,
    /// Their uncertainty.
    pub covariance: LinksCovariance,
    /// Standard deviation of a reading along each axis of the sheet, m.
    pub reading_sigma_m: f64,
    /// Carrier of the sensor.
    pub carrier: Carrier,
    /// The external axes, from the base outward; empty if there are none.
    pub axes: Vec<ExternalAxis>,
}

impl PlacerCalibration {
    /// A calibration of independent errors: standard deviations of the time offset (s), of the rotation about each axis (rad) and of
    /// the translation along each axis (m).
    #[must_use]
    pub fn covariance_of(time_s: f64, rotation_rad: f64, translation_m: f64) -> LinksCovariance {
        let mut covariance = LinksCovariance::zeros();
        covariance[(0, 0)] = time_s * time_s;
        covariance.fixed_view_mut::<3, 3>(1, 1).copy_from(&(Matrix3::identity() * rotation_rad.powi(2)));
        covariance.fixed_view_mut::<3, 3>(4, 4).copy_from(&(Matrix3::identity() * translation_m.powi(2)));
        covariance
    }

    /// The first number that no calibration has, by its name.
    #[must_use]
    pub(crate) fn problem(&self) -> Option<&'static str> {
        let pose = &self.tool_from_camera;
        let shape = self.shape.as_ref();
        let are_finite = |numbers: &[f64]| numbers.iter().all(|number| number.is_finite());
        [
            (self.time_offset_s.is_finite() && self.time_offset_s.abs() <= LONGEST_OFFSET_S, "time_offset_s"),
            (is_pose(pose), "tool_from_camera"),
            (
                are_finite(self.covariance.as_slice()) && (0..7).all(|k| self.covariance[(k, k)] >= 0.0),
                "covariance",
            ),
            (self.reading_sigma_m.is_finite() && self.reading_sigma_m >= 0.0, "reading_sigma_m"),
            (shape.is_none_or(|shape| are_finite(&shape.h) && are_finite(&shape.origin_m)), "shape"),
            (self.axes.len() <= MOST_AXES && self.axes.iter().all(ExternalAxis::is_good), "axes"),
        ]
        .into_iter()
        .find_map(|(is_good, name)| (!is_good).then_some(name))
    }
}

/// No sensor is later than this, s.
const LONGEST_OFFSET_S: f64 = 10.0;

/// No pose is further from its origin than this, m.
const FURTHEST_M: f64 = 1e5;
/// A quaternion may be off unit length by this.
const UNIT: f64 = 1e-6;

/// Whether a pose is one: finite, within reach, with a rotation.
#[must_use]
pub(crate) fn is_pose(pose: &Pose) -> bool {
    let shift = pose.translation.vector;
    let is_near = shift.iter().all(|number| number.abs() <= FURTHEST_M);
    is_near && (pose.rotation.coords.norm() - 1.0).abs() <= UNIT
}
