//! The exported data.

use nalgebra::Matrix4;
use trueline_dataset::Sensor;
use trueline_geometry::Pose;
use trueline_model::Camera;

/// Pose of the sensor on the robot, and delay of its stamps.
#[derive(Clone, Debug)]
pub struct Mounting {
    /// The pose of the sensor's frame in the tool's.
    pub tool_from_sensor: Pose,
    /// An image stamped t was exposed at t − offset, s; `None` if it is not known.
    pub time_offset_s: Option<f64>,
    /// Name of the frame that the sensor is mounted on.
    pub parent: String,
    /// Name of the sensor's frame.
    pub child: String,
    /// Number of the tool on controllers that number them.
    pub tool_number: u32,
    /// The camera, for formats that describe one.
    pub camera: Option<Camera>,
}

impl Mounting {
    /// A sensor `laser` on a `flange`, tool 1.
    #[must_use]
    pub fn new(tool_from_sensor: Pose, time_offset_s: Option<f64>) -> Self {
        Self {
            tool_from_sensor,
            time_offset_s,
            parent: "flange".to_owned(),
            child: "laser".to_owned(),
            tool_number: 1,
            camera: None,
        }
    }

    /// The same with the camera of a sensor, if it has one.
    #[must_use]
    pub fn with_camera_of(self, sensor: &Sensor) -> Self {
        let camera = match sensor {
            Sensor::CameraLaser { camera, .. } => Some(*camera),
            _ => None,
        };
        Self { camera, ..self }
    }

    /// The transform as a matrix, with lengths multiplied by `per_m`.
    pub(crate) fn matrix(&self, per_m: f64) -> Matrix4<f64> {
        let mut matrix = self.tool_from_sensor.to_homogeneous();
        for row in 0..3 {
            matrix[(row, 3)] *= per_m;
        }
        matrix
    }
}
