//! A six-axis arm with the proportions of an ABB IRB 6700-200/2.60, and the same arm built a little differently.
//!
//! The controller computes joint angles with the nominal geometry; the arm turns these into a pose with its own. Standard
//! Denavit–Hartenberg parameters: each joint is Rz(θ) Tz(d) Tx(a) Rx(α).

use crate::noise::Noise;
use nalgebra::{Isometry3, Rotation3, Translation3, UnitQuaternion, Vector3};
use std::f64::consts::{FRAC_PI_2, PI};
use trueline_geometry::Pose;

/// One joint: offset of θ (rad), d (m), a (m), α (rad).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Link {
    /// Added to the joint's angle, rad.
    pub offset_rad: f64,
    /// Along the joint's axis, m.
    pub d_m: f64,
    /// Along the common normal, m.
    pub a_m: f64,
    /// Twist about the common normal, rad.
    pub alpha_rad: f64,
}

/// The geometry of an arm.
pub(crate) type Links = [Link; 6];

const fn link(offset_rad: f64, d_m: f64, a_m: f64, alpha_rad: f64) -> Link {
    Link { offset_rad, d_m, a_m, alpha_rad }
}

/// The nominal geometry.
pub const NOMINAL: Links = [
    link(0.0, 0.780, 0.320, -FRAC_PI_2),
    link(-FRAC_PI_2, 0.0, 1.125, 0.0),
    link(0.0, 0.0, 0.200, -FRAC_PI_2),
    link(0.0, 1.1425, 0.0, FRAC_PI_2),
    link(0.0, 0.0, 0.0, -FRAC_PI_2),
    link(0.0, 0.200, 0.0, 0.0),
];

/// Standard deviations of angles (rad) and of lengths (m) of an arm with an RMS position error of 0.3 mm over its
/// workspace, mean removed.
const ERRORS_OF_0_3_MM: [f64; 2] = [0.005 / 180.0 * PI, 0.075e-3];

/// An arm with a geometry that differs from the nominal one.
#[derive(Clone, Debug)]
pub struct Arm {
    world_from_arm: Pose,
    links: Links,
}

impl Arm {
    /// An arm with drawn errors (24 of them), placed so that it reaches `base_from_tool` in the middle of its workspace,
    /// forearm sloping down. The base that poses refer to is then wherever it is; `None` if the placing fails.
    #[must_use]
    pub fn before(base_from_tool: &Pose, mut noise: Noise, rms_m: f64) -> Option<Self> {
        let scale = rms_m / 0.3e-3;
        let [angle, length] = ERRORS_OF_0_3_MM.map(|sigma| sigma * scale);
        let links = NOMINAL.map(|nominal| Link {
            offset_rad: nominal.offset_rad + noise.normal(angle),
            d_m: nominal.d_m + noise.normal(length),
            a_m: nominal.a_m + noise.normal(length),
            alpha_rad: nominal.alpha_rad + noise.normal(angle),
        });
        // A bent elbow and a wrist far from its singularity.
        let comfortable = forward(&NOMINAL, &[0.2, 0.3, 0.2, 0.3, 1.1, 0.4]);
        let world_from_arm = base_from_tool * comfortable.inverse();
        Some(Self { world_from_arm, links }).filter(|arm| arm.true_from_nominal(base_from_tool).is_some())
    }

    /// Pose of the tool when the controller reports a pose; `None` out of reach.
    #[must_use]
    pub fn true_from_nominal(&self, base_from_tool: &Pose) -> Option<Pose> {
        let angles = inverse(&(self.world_from_arm.inverse() * base_from_tool))?;
        Some(self.world_from_arm * forward(&self.links, &angles))
    }
}

/// Pose of the flange for six joint angles, rad.
#[must_use]
pub fn forward(links: &Links, angles_rad: &[f64; 6]) -> Pose {
    links.iter().zip(angles_rad).fold(Pose::identity(), |pose, (link, angle)| {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle + link.offset_rad);
        let twist = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), link.alpha_rad);
        pose * Isometry3::from_parts(Translation3::new(0.0, 0.0, link.d_m), turn)
            * Isometry3::from_parts(Translation3::new(link.a_m, 0.0, 0.0), twist)
    })
}

/// Joint angles (rad) of the nominal arm for a flange pose: shoulder forward, elbow up, wrist not flipped. `None` out of
/// reach.
#[must_use]
pub fn inverse(arm_from_flange: &Pose) -> Option<[f64; 6]> {
    let flange_axis = arm_from_flange.rotation * Vector3::z();
    let wrist = arm_from_flange.translation.vector - flange_axis * NOMINAL[5].d_m;
    let first = wrist.y.atan2(wrist.x);
    // In the plane of the upper arm and the forearm, from the second joint.
    let out = wrist.x.hypot(wrist.y) - NOMINAL[0].a_m;
    let up = wrist.z - NOMINAL[0].d_m;
    let (upper, forearm) = (NOMINAL[1].a_m, NOMINAL[2].a_m.hypot(NOMINAL[3].d_m));
    let squared = out * out + up * up;
    let cosine = (squared - upper * upper - forearm * forearm) / (2.0 * upper * forearm);
    if cosine.abs() > 1.0 {
        return None;
    }
    // The angle between the extended upper arm and the line from elbow to wrist.
    let bend = cosine.acos();
    let second = FRAC_PI_2 - (up.atan2(out) + (forearm * bend.sin()).atan2(upper + forearm * bend.cos()));
    let third = bend - NOMINAL[3].d_m.atan2(NOMINAL[2].a_m);
    let arm_from_third = forward_rotation(&[first, second, third]);
    let [fourth, fifth, sixth] =
        wrist_angles(&(arm_from_third.inverse() * arm_from_flange.rotation.to_rotation_matrix()));
    Some([first, second, third, fourth, fifth, sixth])
}

/// Rotation of the first three joints; the other three are neutral at zero.
fn forward_rotation([first, second, third]: &[f64; 3]) -> Rotation3<f64> {
    forward(&NOMINAL, &[*first, *second, *third, 0.0, 0.0, 0.0]).rotation.to_rotation_matrix()
}

/// Angles of the last three joints: Rz(θ4) Ry(−θ5) Rz(θ6), with θ5 between 0 and π.
fn wrist_angles(rotation: &Rotation3<f64>) -> [f64; 3] {
    let r = rotation.matrix();
    let sine = r[(0, 2)].hypot(r[(1, 2)]);
    let fifth = sine.atan2(r[(2, 2)]);
    // Rz(a) Rx(90°) Rz(b) Rx(−90°) Rz(c) = Rz(a) Ry(−b) Rz(c), whose third column is (−cos a sin b, −sin a sin b, cos b).
    let fourth = (-r[(1, 2)]).atan2(-r[(0, 2)]);
    let sixth = (-r[(2, 1)]).atan2(r[(2, 0)]);
    [fourth, fifth, sixth]
}
