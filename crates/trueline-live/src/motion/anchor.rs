//! Where a path is laid: at the robot, as it stood when the motion began.

use super::checked_path::Reference;
use nalgebra::{UnitQuaternion, Vector3};
use trueline_geometry::Pose;

/// What lies between the path's first pose and the robot's: the place is shifted in base, the attitude turned in the tool, so
/// that speeds stay as they are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Anchor {
    shift_m: Vector3<f64>,
    turn: UnitQuaternion<f64>,
}

impl Default for Anchor {
    fn default() -> Self {
        Self { shift_m: Vector3::zeros(), turn: UnitQuaternion::identity() }
    }
}

impl Anchor {
    /// Lays the path's first pose at the robot.
    #[must_use]
    pub(super) fn between(path_start: &Pose, robot: &Pose) -> Self {
        Self {
            shift_m: robot.translation.vector - path_start.translation.vector,
            turn: path_start.rotation.inverse() * robot.rotation,
        }
    }

    /// A reference of the path where it is laid.
    #[must_use]
    pub(super) fn lay(&self, mut reference: Reference) -> Reference {
        reference.base_from_tool.translation.vector += self.shift_m;
        reference.base_from_tool.rotation *= self.turn;
        reference
    }
}
