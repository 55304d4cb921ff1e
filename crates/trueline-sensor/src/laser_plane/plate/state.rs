//! The unknowns: camera, laser plane, hand-eye transform and plate.

use crate::projection::CAMERA_SIZE;
use trueline_geometry::{Plane, Pose};
use trueline_model::Camera;

/// First of the camera's nine unknowns.
pub const CAMERA: usize = 0;
/// First of the laser plane's: two tilts (rad) and the offset (m).
pub const LASER_PLANE: usize = CAMERA_SIZE;
/// First of the hand-eye transform's: rotation (rad) and translation (m), perturbed on the left.
pub const HAND_EYE: usize = LASER_PLANE + 3;
/// First of the plate's: two tilts (rad) and the offset (m).
pub const PLATE: usize = HAND_EYE + 6;
/// Number of unknowns.
pub const SIZE: usize = PLATE + 3;

/// Camera, laser plane, hand-eye transform and plate.
#[derive(Clone, Copy, Debug)]
pub struct PlateState {
    /// The camera.
    pub camera: Camera,
    /// The laser plane in the camera frame.
    pub laser_plane_in_camera: Plane,
    /// The hand-eye transform.
    pub tool_from_camera: Pose,
    /// The plate in base; in the tool frame where the robot carries the plate.
    pub plate_in_base: Plane,
}
