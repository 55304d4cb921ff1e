//! Logged poses with few digits.

use nalgebra::UnitQuaternion;
use trueline_geometry::{Pose, se3};

/// Step of angles for each metre of the positions' step, rad: a tenth of it in degrees for mm.
const RAD_PER_M: f64 = 100.0 * std::f64::consts::PI / 180.0;

/// A logged pose: positions in steps, m, and the roll, pitch and yaw that controllers write likewise.
pub(crate) fn quantised(pose: &Pose, step_m: f64) -> Pose {
    let (roll, pitch, yaw) = pose.rotation.euler_angles();
    let [roll, pitch, yaw] = [roll, pitch, yaw].map(|angle| rounded(angle, step_m * RAD_PER_M));
    let rotation = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
    se3::from_parts(rotation, pose.translation.vector.map(|value| rounded(value, step_m)))
}

fn rounded(value: f64, step: f64) -> f64 {
    (value / step).round() * step
}
