//! Pose of the robot.

use nalgebra::Vector3;
use trueline_geometry::Pose;

/// Pose of the robot, its motion, and their uncertainty.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Located {
    /// Pose of the robot's load, in base.
    pub base_from_tool: Pose,
    /// Velocity of the tool's origin in base, m/s.
    pub velocity: Vector3<f64>,
    /// Angular velocity of the tool in base, rad/s.
    pub angular_velocity: Vector3<f64>,
    /// Standard deviation of the position along each axis, m.
    pub sigma_m: f64,
    /// Standard deviation of the attitude about each axis, rad.
    pub sigma_rad: f64,
    /// Standard deviation of the time of the poses, s.
    pub sigma_s: f64,
    /// How long before the last pose, s; negative where the pose is predicted.
    pub age_s: f64,
}
