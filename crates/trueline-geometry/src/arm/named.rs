//! Well-known arms as data. Lengths are in mm and angles in degrees. At zero all frames are parallel to the base.
//!
//! The figures come from the source given for each arm. Makers publish no accelerations of joints.

use crate::arm::six_axes::{AXES, Arm, Joint};
use crate::{Pose, se3};
use nalgebra::{UnitQuaternion, UnitVector3, Vector3};

/// A joint: its place from the joint before, its axis, range and speed.
type Row = ([f64; 3], [f64; 3], [f64; 2], f64);

/// An arm with published figures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NamedArm {
    /// The name in files.
    pub name: &'static str,
    /// The maker's name for it.
    pub title: &'static str,
    /// Source of the figures.
    pub source: &'static str,
    joints: [Row; AXES],
    /// The flange relative to the last joint, and its roll, pitch and yaw about fixed axes.
    flange: ([f64; 3], [f64; 3]),
}

const X: [f64; 3] = [1.0, 0.0, 0.0];
const Y: [f64; 3] = [0.0, 1.0, 0.0];
const Z: [f64; 3] = [0.0, 0.0, 1.0];
const MINUS_X: [f64; 3] = [-1.0, 0.0, 0.0];
const MINUS_Y: [f64; 3] = [0.0, -1.0, 0.0];
const MINUS_Z: [f64; 3] = [0.0, 0.0, -1.0];
const TURN: [f64; 2] = [-360.0, 360.0];

/// All of them.
pub const ALL: [NamedArm; 5] = [UR5E, UR10E, IRB_1200_5_09, IRB_2600_12_165, KR_10_R1420];

const UR5E: NamedArm = NamedArm {
    name: "ur5e",
    title: "Universal Robots UR5e",
    source: "Universal Robots, Parameters for calculations of kinematics and dynamics (support article 45257); ranges and speeds: \
             User Manual UR5e 5.8, the elbow's range as UniversalRobots/Universal_Robots_ROS2_Description has it",
    joints: [
        ([0.0, 0.0, 162.5], Z, TURN, 180.0),
        ([0.0, 0.0, 0.0], MINUS_Y, TURN, 180.0),
        ([-425.0, 0.0, 0.0], MINUS_Y, [-180.0, 180.0], 180.0),
        ([-392.2, 0.0, 0.0], MINUS_Y, TURN, 180.0),
        ([0.0, -133.3, 0.0], MINUS_Z, TURN, 180.0),
        ([0.0, 0.0, -99.7], MINUS_Y, TURN, 180.0),
    ],
    flange: ([0.0, -99.6, 0.0], [90.0, 0.0, 0.0]),
};

const UR10E: NamedArm = NamedArm {
    name: "ur10e",
    title: "Universal Robots UR10e",
    source: "Universal Robots, Parameters for calculations of kinematics and dynamics (support article 45257), the last distance also in \
             ros-industrial/universal_robot, ur_description/config/ur10e/physical_parameters.yaml; ranges and speeds: \
             User Manual UR10e 5.8, the elbow's range as UniversalRobots/Universal_Robots_ROS2_Description has it",
    joints: [
        ([0.0, 0.0, 180.7], Z, TURN, 120.0),
        ([0.0, 0.0, 0.0], MINUS_Y, TURN, 120.0),
        ([-612.7, 0.0, 0.0], MINUS_Y, [-180.0, 180.0], 180.0),
        ([-571.55, 0.0, 0.0], MINUS_Y, TURN, 180.0),
        ([0.0, -174.15, 0.0], MINUS_Z, TURN, 180.0),
        ([0.0, 0.0, -119.85], MINUS_Y, TURN, 180.0),
    ],
    flange: ([0.0, -116.55, 0.0], [90.0, 0.0, 0.0]),
};

const IRB_1200_5_09: NamedArm = NamedArm {
    name: "abb-irb1200-5-0.9",
    title: "ABB IRB 1200-5/0.9",
    source: "ros-industrial/abb, abb_irb1200_support/urdf/irb1200_5_90_macro.xacro",
    joints: [
        ([0.0, 0.0, 399.1], Z, [-170.0, 170.0], 288.0),
        ([0.0, 0.0, 0.0], Y, [-100.0, 130.0], 240.0),
        ([0.0, 0.0, 448.0], Y, [-200.0, 70.0], 300.0),
        ([0.0, 0.0, 42.0], X, [-270.0, 270.0], 400.0),
        ([451.0, 0.0, 0.0], Y, [-130.0, 130.0], 405.0),
        ([82.0, 0.0, 0.0], X, TURN, 600.0),
    ],
    flange: ([0.0, 0.0, 0.0], [0.0, 90.0, 0.0]),
};

const IRB_2600_12_165: NamedArm = NamedArm {
    name: "abb-irb2600-12-1.65",
    title: "ABB IRB 2600-12/1.65",
    source: "ros-industrial/abb, abb_irb2600_support/urdf/irb2600_12_165_macro.xacro",
    joints: [
        ([0.0, 0.0, 445.0], Z, [-180.0, 180.0], 175.0),
        ([150.0, 0.0, 0.0], Y, [-155.0, 95.0], 175.0),
        ([0.0, 0.0, 700.0], Y, [-155.0, 75.0], 175.0),
        ([0.0, 0.0, 115.0], X, [-400.0, 400.0], 360.0),
        ([795.0, 0.0, 0.0], Y, [-120.0, 120.0], 360.0),
        ([85.0, 0.0, 0.0], X, [-400.0, 400.0], 500.0),
    ],
    flange: ([0.0, 0.0, 0.0], [0.0, 90.0, 0.0]),
};

const KR_10_R1420: NamedArm = NamedArm {
    name: "kuka-kr10-r1420",
    title: "KUKA KR 10 R1420",
    source: "ros-industrial/kuka_experimental, kuka_kr10_support/urdf/kr10r1420_macro.xacro",
    joints: [
        ([0.0, 0.0, 450.0], MINUS_Z, [-170.0, 170.0], 220.0),
        ([150.0, 0.0, 0.0], Y, [-185.0, 65.0], 210.0),
        ([610.0, 0.0, 0.0], Y, [-137.0, 163.0], 270.0),
        ([0.0, 0.0, 20.0], MINUS_X, [-185.0, 185.0], 381.0),
        ([660.0, 0.0, 0.0], Y, [-120.0, 120.0], 311.0),
        ([80.0, 0.0, 0.0], MINUS_X, [-350.0, 350.0], 492.0),
    ],
    flange: ([0.0, 0.0, 0.0], [0.0, 90.0, 0.0]),
};

/// The arm with a name.
#[must_use]
pub fn find(name: &str) -> Option<&'static NamedArm> {
    ALL.iter().find(|arm| arm.name == name)
}

impl NamedArm {
    /// The arm. Its flange is the frame that the controller calls tool0 (flange, tool 0).
    #[must_use]
    pub fn arm(&self) -> Arm {
        let joints = self.joints.map(|(from_mm, axis, range_deg, speed_deg_s)| Joint {
            before: at(from_mm, UnitQuaternion::identity()),
            axis: UnitVector3::new_normalize(Vector3::from(axis)),
            range_rad: range_deg.map(f64::to_radians),
            speed_rad_s: speed_deg_s.to_radians(),
            acceleration_rad_s2: None,
        });
        let (from_mm, rpy_deg) = self.flange;
        let [roll, pitch, yaw] = rpy_deg.map(f64::to_radians);
        Arm { joints, last_from_flange: at(from_mm, UnitQuaternion::from_euler_angles(roll, pitch, yaw)) }
    }
}

fn at(mm: [f64; 3], rotation: UnitQuaternion<f64>) -> Pose {
    se3::from_parts(rotation, Vector3::from(mm) * 1e-3)
}
