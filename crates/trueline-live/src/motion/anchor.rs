//! Place of a path: at the robot's pose when the motion began.

use super::checked_path::Reference;
use nalgebra::{UnitQuaternion, Vector3};
use trueline_geometry::Pose;

/// Difference between the path's first pose and the robot's: a shift in base, and a rotation in the tool, so that speeds
/// stay the same.
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

    /// A reference of the path at its present place.
    #[must_use]
    pub(super) fn lay(&self, mut reference: Reference) -> Reference {
        reference.base_from_tool.translation.vector += self.shift_m;
        reference.base_from_tool.rotation *= self.turn;
        reference
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_pose_comes_to_lie_on_the_robot_and_speeds_stay() {
        let pose = |x: f64, turn: Vector3<f64>| Pose::new(Vector3::new(x, 0.1, 0.2), turn);
        let (start, robot) =
            (pose(0.5, Vector3::new(0.1, 0.2, 0.3)), pose(0.503, Vector3::new(0.12, 0.19, 0.33)));
        let anchor = Anchor::between(&start, &robot);
        let moving = |base_from_tool: Pose| Reference {
            base_from_tool,
            velocity_m_s: Vector3::new(0.1, 0.2, 0.3),
            angular_velocity_rad_s: Vector3::new(0.4, 0.5, 0.6),
        };
        let laid = anchor.lay(moving(start));
        assert!((laid.base_from_tool.translation.vector - robot.translation.vector).norm() < 1e-15);
        assert!(laid.base_from_tool.rotation.angle_to(&robot.rotation) < 1e-7);
        assert_eq!(
            (laid.velocity_m_s, laid.angular_velocity_rad_s),
            (moving(start).velocity_m_s, moving(start).angular_velocity_rad_s)
        );
        // Later: the same shift in base and the same rotation in the tool, so that the path's own rotation in base
        // stays the same.
        let later = pose(0.7, Vector3::new(0.3, -0.2, 0.5));
        let laid = anchor.lay(moving(later)).base_from_tool;
        assert!((laid.translation.vector - Vector3::new(0.703, 0.1, 0.2)).norm() < 1e-12);
        let turned = |from: &Pose, to: &Pose| to.rotation * from.rotation.inverse();
        assert!(turned(&robot, &laid).angle_to(&turned(&start, &later)) < 1e-7);
    }
}
