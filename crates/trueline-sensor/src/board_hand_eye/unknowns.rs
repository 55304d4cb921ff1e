//! Unknowns of the joint estimate, and the reported noise.

use trueline_geometry::Pose;

/// Number of unknowns: time offset, six of the hand-eye transform, six of the target.
pub const SIZE: usize = 13;
/// Index of the time offset.
pub const TIME_OFFSET: usize = 0;
/// First index of the hand-eye transform: three of its rotation, three of its translation.
pub const HAND_EYE: usize = 1;
/// First index of the target's pose.
pub const TARGET: usize = 7;

/// The unknowns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unknowns {
    /// Image stamp less exposure, s.
    pub time_offset_s: f64,
    /// Hand-eye transform.
    pub tool_from_camera: Pose,
    /// Pose of the target.
    pub base_from_target: Pose,
}

/// Noise of the robot and of the stamps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ErrorModel {
    /// Noise of the robot's position, per axis, m.
    pub position_m: f64,
    /// Noise of its attitude, per axis, rad.
    pub rotation_rad: f64,
    /// Jitter of an image's stamp, s.
    pub stamp_s: f64,
    /// The body on the robot: its rotation noise turns this about the tool.
    pub carries: Carried,
}

/// The body on the robot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Carried {
    /// The camera; the target stands still.
    #[default]
    Camera,
    /// The target; the camera stands still. The path is then that of the base before the tool, `tool_from_base`.
    Target,
}
