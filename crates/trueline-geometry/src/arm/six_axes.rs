//! An arm of six revolute joints in series.

use crate::{Pose, se3};
use nalgebra::{Matrix6, UnitQuaternion, UnitVector3, Vector3};

/// Number of joints of an arm.
pub const AXES: usize = 6;

/// Angles of all joints, rad.
pub type Angles = [f64; AXES];

/// A joint and its limits.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// The joint's frame in that of the previous joint at angle zero. For the first joint, in the arm's base.
    pub before: Pose,
    /// Its axis, in its own frame.
    pub axis: UnitVector3<f64>,
    /// Smallest and largest angle, rad.
    pub range_rad: [f64; 2],
    /// Largest speed, rad/s.
    pub speed_rad_s: f64,
    /// Largest acceleration, rad/s²; `None` if not stated.
    pub acceleration_rad_s2: Option<f64>,
}

/// An arm.
#[derive(Clone, Debug, PartialEq)]
pub struct Arm {
    /// From the base to the flange.
    pub joints: [Joint; AXES],
    /// The flange in the frame of the last joint.
    pub last_from_flange: Pose,
}

/// Places of joints and flange, and the flange's motion with the joints.
#[derive(Clone, Copy, Debug)]
pub struct ArmState {
    /// Frame of each joint in the arm's base, rotated by its angle.
    pub base_from_joint: [Pose; AXES],
    /// Axis of each joint in the arm's base.
    pub axes: [Vector3<f64>; AXES],
    /// The flange.
    pub base_from_flange: Pose,
}

impl Joint {
    /// The joint's frame in that of the previous joint at an angle, rad.
    #[must_use]
    pub fn at(&self, angle_rad: f64) -> Pose {
        let turn = UnitQuaternion::from_axis_angle(&self.axis, angle_rad);
        se3::from_parts(self.before.rotation * turn, self.before.translation.vector)
    }
}

impl Arm {
    /// Pose of the flange in the arm's base.
    #[must_use]
    pub fn base_from_flange(&self, angles: &Angles) -> Pose {
        self.state(angles).base_from_flange
    }

    /// The arm at some angles, rad.
    #[must_use]
    pub fn state(&self, angles: &Angles) -> ArmState {
        let mut at = Pose::identity();
        let mut base_from_joint = [at; AXES];
        let mut axes = [Vector3::zeros(); AXES];
        for (k, joint) in self.joints.iter().enumerate() {
            at *= joint.at(angles[k]);
            base_from_joint[k] = at;
            axes[k] = at.rotation * joint.axis.into_inner();
        }
        ArmState { base_from_joint, axes, base_from_flange: at * self.last_from_flange }
    }

    /// Distance of a joint's angle from the middle of its range, in units of half the range; above 1 it is
    /// outside.
    #[must_use]
    pub fn used_of_range(&self, angles: &Angles) -> [f64; AXES] {
        std::array::from_fn(|k| {
            let [low, high] = self.joints[k].range_rad;
            (angles[k] - 0.5 * (low + high)).abs() / (0.5 * (high - low))
        })
    }
}

impl ArmState {
    /// Jacobian of the flange's motion by the joints: velocity of its origin above, angular velocity below, both in the arm's base \[Siciliano2009,
    /// Eq. 3.30\].
    #[must_use]
    pub fn jacobian(&self) -> Matrix6<f64> {
        let tip = self.base_from_flange.translation.vector;
        let mut jacobian = Matrix6::zeros();
        for k in 0..AXES {
            let arm = tip - self.base_from_joint[k].translation.vector;
            jacobian.fixed_view_mut::<3, 1>(0, k).copy_from(&self.axes[k].cross(&arm));
            jacobian.fixed_view_mut::<3, 1>(3, k).copy_from(&self.axes[k]);
        }
        jacobian
    }

    /// Distance of the wrist from its singularity, rad: the angle between the axes of the fourth and the
    /// sixth joint. In line they do the same, and one direction is lost.
    #[must_use]
    pub fn wrist_rad(&self) -> f64 {
        let [.., fourth, _, sixth] = &self.axes;
        fourth.cross(sixth).norm().atan2(fourth.dot(sixth).abs())
    }
}
