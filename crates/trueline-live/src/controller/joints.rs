//! Joint angles for a pose, of an upright six-axis arm of no particular make. They move as a real robot's do. Out of
//! reach the arm points there, stretched.

use nalgebra::{Matrix3, Vector3};
use trueline_geometry::Pose;

/// Height of the shoulder, its distance from the first axis, upper arm, forearm and flange, m.
const SHOULDER_M: f64 = 0.780;
const OFFSET_M: f64 = 0.320;
const UPPER_ARM_M: f64 = 1.280;
const FOREARM_M: f64 = 1.600;
const FLANGE_M: f64 = 0.200;

/// Six angles, deg; the flange's z axis points out of it.
#[must_use]
pub(crate) fn angles_deg(base_from_flange: &Pose) -> [f64; 6] {
    let rotation = base_from_flange.rotation.to_rotation_matrix();
    let wrist = base_from_flange.translation.vector - rotation * Vector3::z() * FLANGE_M;
    let first = wrist.y.atan2(wrist.x);
    let (out, up) = (wrist.xy().norm() - OFFSET_M, wrist.z - SHOULDER_M);
    let reach = out.hypot(up).clamp((FOREARM_M - UPPER_ARM_M).abs() + 1e-6, UPPER_ARM_M + FOREARM_M);
    let cosine = |a: f64, b: f64, c: f64| ((a * a + b * b - c * c) / (2.0 * a * b)).clamp(-1.0, 1.0).acos();
    let at_shoulder = cosine(UPPER_ARM_M, reach, FOREARM_M);
    let at_elbow = cosine(UPPER_ARM_M, FOREARM_M, reach);
    // 0 is an upright upper arm and a level forearm.
    let second = std::f64::consts::FRAC_PI_2 - up.atan2(out) - at_shoulder;
    let third = std::f64::consts::FRAC_PI_2 - at_elbow;
    let wrist_from_flange = forearm(first, second + third).transpose() * rotation.matrix();
    // The wrist turns about x, y, x; the flange's z is along the last x.
    let along = wrist_from_flange.column(2);
    let fifth = along.y.hypot(along.z).atan2(along.x);
    let fourth = along.y.atan2(-along.z);
    let across = wrist_from_flange.row(0);
    let sixth = across[1].atan2(across[0]);
    [first, second, third, fourth, fifth, sixth].map(f64::to_degrees)
}

/// Attitude of the forearm: x along it.
fn forearm(turn: f64, pitch: f64) -> Matrix3<f64> {
    let about_z = nalgebra::Rotation3::from_axis_angle(&Vector3::z_axis(), turn);
    let about_y = nalgebra::Rotation3::from_axis_angle(&Vector3::y_axis(), pitch);
    (about_z * about_y).into_inner()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Forward again, joint by joint.
    fn flange(angles_deg: [f64; 6]) -> (Vector3<f64>, Vector3<f64>) {
        let [first, second, third, fourth, fifth, _] = angles_deg.map(f64::to_radians);
        let upright = forearm(first, second);
        let shoulder = forearm(first, 0.0) * Vector3::x() * OFFSET_M + Vector3::z() * SHOULDER_M;
        let along = forearm(first, second + third);
        let wrist = shoulder + upright * Vector3::z() * UPPER_ARM_M + along * Vector3::x() * FOREARM_M;
        let bent = nalgebra::Rotation3::from_axis_angle(&Vector3::x_axis(), fourth)
            * nalgebra::Rotation3::from_axis_angle(&Vector3::y_axis(), fifth);
        let out = along * (bent * Vector3::x());
        (wrist + out * FLANGE_M, out)
    }

    #[test]
    fn the_angles_lead_back_to_the_pose() {
        for k in 0..50 {
            let k = f64::from(k);
            let position =
                Vector3::new(1.5 + 0.3 * k.sin(), 0.5 * (1.7 * k).cos(), 0.8 + 0.4 * (0.3 * k).sin());
            let pose = Pose::new(position, Vector3::new(2.0 + 0.3 * k.cos(), 0.4 * k.sin(), 0.2));
            let (at, out) = flange(angles_deg(&pose));
            assert!((at - position).norm() < 1e-12, "{at} is not {position}");
            assert!((out - pose.rotation * Vector3::z()).norm() < 1e-12);
        }
    }
}
