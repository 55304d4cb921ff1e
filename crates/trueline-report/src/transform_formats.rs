//! A hand-eye transform as robots and programs want it written.

use nalgebra::{UnitQuaternion, Vector3};
use trueline_dataset::unit::MM_PER_M;
use trueline_geometry::Pose;

/// One way to write it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Form {
    /// Whose way.
    pub name: &'static str,
    /// Its units, order and axes, in words.
    pub convention: &'static str,
    /// The text to copy.
    pub text: String,
}

/// All ways to write a transform from camera to tool coordinates.
#[must_use]
pub fn all(tool_from_camera: &Pose) -> Vec<Form> {
    let mut forms = Vec::from(in_mathematics(tool_from_camera));
    forms.extend(on_robots(tool_from_camera));
    forms.extend(in_ros(tool_from_camera));
    forms
}

fn form(name: &'static str, convention: &'static str, text: String) -> Form {
    Form { name, convention, text }
}

fn in_mathematics(tool_from_camera: &Pose) -> [Form; 3] {
    let mm = tool_from_camera.translation.vector * MM_PER_M;
    let rotation = &tool_from_camera.rotation;
    let [w, x, y, z] = crate::number::positive_w(rotation);
    let [yaw, pitch, roll] = yaw_pitch_roll(rotation).map(f64::to_degrees);
    [
        form(
            "Quaternion",
            "Translation x, y, z in mm, then w, x, y, z (Hamilton); camera coordinates to tool coordinates.",
            format!("{:.4} {:.4} {:.4}\n{w:.8} {x:.8} {y:.8} {z:.8}", mm.x, mm.y, mm.z),
        ),
        form(
            "Euler",
            "x, y, z in mm; yaw, pitch, roll in degrees: about z, then about the new y, then about the new x.",
            format!("{:.4} {:.4} {:.4}\n{yaw:.6} {pitch:.6} {roll:.6}", mm.x, mm.y, mm.z),
        ),
        form(
            "Matrix",
            "4 × 4, millimetres; multiplied from the left to points of the camera.",
            matrix(rotation, &mm),
        ),
    ]
}

fn on_robots(tool_from_camera: &Pose) -> [Form; 4] {
    let m = tool_from_camera.translation.vector;
    let mm = m * MM_PER_M;
    let rotation = &tool_from_camera.rotation;
    let [w, x, y, z] = crate::number::positive_w(rotation);
    let [a, b, c] = yaw_pitch_roll(rotation).map(f64::to_degrees);
    let turn = trueline_geometry::so3::log(rotation);
    [
        form(
            "ABB",
            "RAPID pose: mm and q1 to q4 = w, x, y, z.",
            format!(
                "PERS pose tool_from_camera := [[{:.4},{:.4},{:.4}],[{w:.8},{x:.8},{y:.8},{z:.8}]];",
                mm.x, mm.y, mm.z
            ),
        ),
        form(
            "KUKA",
            "KRL FRAME: mm; A, B, C in degrees about z, y', x''.",
            format!("{{X {:.4}, Y {:.4}, Z {:.4}, A {a:.6}, B {b:.6}, C {c:.6}}}", mm.x, mm.y, mm.z),
        ),
        form(
            "Fanuc",
            "mm; W, P, R in degrees about the fixed x, y, z.",
            format!("X {:.4}\nY {:.4}\nZ {:.4}\nW {c:.6}\nP {b:.6}\nR {a:.6}", mm.x, mm.y, mm.z),
        ),
        form(
            "UR",
            "URScript pose: m and a rotation vector in rad.",
            format!("p[{:.7}, {:.7}, {:.7}, {:.8}, {:.8}, {:.8}]", m.x, m.y, m.z, turn.x, turn.y, turn.z),
        ),
    ]
}

fn in_ros(tool_from_camera: &Pose) -> [Form; 2] {
    let m = tool_from_camera.translation.vector;
    let rotation = &tool_from_camera.rotation;
    let [w, x, y, z] = crate::number::positive_w(rotation);
    let [yaw, pitch, roll] = yaw_pitch_roll(rotation);
    [
        form(
            "URDF",
            "Origin of a fixed joint from tool to camera: m; roll, pitch, yaw in rad about the fixed x, y, z.",
            format!(
                "<origin xyz=\"{:.7} {:.7} {:.7}\" rpy=\"{roll:.8} {pitch:.8} {yaw:.8}\"/>",
                m.x, m.y, m.z
            ),
        ),
        form(
            "ROS 2",
            "m and x, y, z, w; replace tool0 by the frame that your robot reports.",
            format!(
                "ros2 run tf2_ros static_transform_publisher --x {:.7} --y {:.7} --z {:.7} --qx {x:.8} --qy {y:.8} \
                 --qz {z:.8} --qw {w:.8} --frame-id tool0 --child-frame-id camera",
                m.x, m.y, m.z
            ),
        ),
    ]
}

fn matrix(rotation: &UnitQuaternion<f64>, mm: &Vector3<f64>) -> String {
    let r = rotation.to_rotation_matrix().into_inner();
    let row =
        |k: usize| format!("{:>12.8} {:>12.8} {:>12.8} {:>12.4}", r[(k, 0)], r[(k, 1)], r[(k, 2)], mm[k]);
    format!("{}\n{}\n{}\n{:>12} {:>12} {:>12} {:>12}", row(0), row(1), row(2), 0, 0, 0, 1)
}

/// Angles of R = Rz(yaw) Ry(pitch) Rx(roll), rad; at a pitch of ±90° the roll is zero.
#[must_use]
pub fn yaw_pitch_roll(rotation: &UnitQuaternion<f64>) -> [f64; 3] {
    let r = rotation.to_rotation_matrix().into_inner();
    let level = r[(0, 0)].hypot(r[(1, 0)]);
    let pitch = (-r[(2, 0)]).atan2(level);
    if level < 1e-9 {
        return [(-r[(0, 1)]).atan2(r[(1, 1)]), pitch, 0.0];
    }
    [r[(1, 0)].atan2(r[(0, 0)]), pitch, r[(2, 1)].atan2(r[(2, 2)])]
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    fn rebuilt([yaw, pitch, roll]: [f64; 3]) -> Rotation3<f64> {
        Rotation3::from_axis_angle(&Vector3::z_axis(), yaw)
            * Rotation3::from_axis_angle(&Vector3::y_axis(), pitch)
            * Rotation3::from_axis_angle(&Vector3::x_axis(), roll)
    }

    #[test]
    fn angles_make_the_same_rotation_again_also_upright() {
        let half = std::f64::consts::FRAC_PI_2;
        for angles in
            [[0.3, -0.4, 2.9], [3.0, 1.2, -0.1], [0.7, half, 0.0], [-0.7, -half, 0.0], [1.1, half, 0.5]]
        {
            let truth = rebuilt(angles);
            let found = rebuilt(yaw_pitch_roll(&UnitQuaternion::from_rotation_matrix(&truth)));
            // Near upright the two cosines are 1e-9 at most.
            assert!(found.angle_to(&truth) < 1e-7, "{angles:?}");
        }
    }

    #[test]
    fn every_form_says_the_same_pose() {
        let rotation = UnitQuaternion::from_rotation_matrix(&rebuilt([0.5, -0.3, 1.2]));
        let pose = Pose::from_parts(Vector3::new(0.0621, -0.0184, 0.1452).into(), rotation);
        let numbers = |name: &str| -> Vec<f64> {
            let forms = all(&pose);
            let form = forms.iter().find(|form| form.name == name);
            let text = form.map_or("", |form| form.text.as_str());
            let words = text.split(|c: char| !(c.is_ascii_digit() || c == '.' || c == '-'));
            words.filter(|word| word.contains('.')).filter_map(|word| word.parse().ok()).collect()
        };
        let near = |found: &[f64], expected: &[f64]| {
            assert_eq!(found.len(), expected.len(), "{found:?}");
            // Printed to seven significant digits or more.
            assert!(
                found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 6e-7 * b.abs().max(1.0)),
                "{found:?}"
            );
        };
        let (deg, q) = (f64::to_degrees, rotation.quaternion());
        near(&numbers("KUKA"), &[62.1, -18.4, 145.2, deg(0.5), deg(-0.3), deg(1.2)]);
        near(&numbers("Fanuc"), &[62.1, -18.4, 145.2, deg(1.2), deg(-0.3), deg(0.5)]);
        near(&numbers("URDF"), &[0.0621, -0.0184, 0.1452, 1.2, -0.3, 0.5]);
        near(&numbers("ABB"), &[62.1, -18.4, 145.2, q.w, q.i, q.j, q.k]);
        near(&numbers("ROS 2"), &[0.0621, -0.0184, 0.1452, q.i, q.j, q.k, q.w]);
        let turn = rotation.scaled_axis();
        near(&numbers("UR"), &[0.0621, -0.0184, 0.1452, turn.x, turn.y, turn.z]);
    }
}
