//! Tests arms against other code and published numbers: Denavit–Hartenberg tables as matrices, the simulator's own arm, and the flange of each named
//! arm at zero.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use nalgebra::{Matrix4, Rotation3, UnitQuaternion, Vector3, Vector6};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::{FRAC_PI_2, PI};
use trueline_geometry::Pose;
use trueline_geometry::arm::dh::{self, Row};
use trueline_geometry::arm::urdf::{Chain, UrdfError};
use trueline_geometry::arm::{AXES, Angles, Arm, inverse, named};
use trueline_sim::arm::{NOMINAL, forward, inverse as inverse_of_sim};

/// The matrix of a row as in textbooks.
fn matrix(theta: f64, d: f64, a: f64, alpha: f64) -> Matrix4<f64> {
    let ((s, c), (sa, ca)) = (theta.sin_cos(), alpha.sin_cos());
    Matrix4::new(
        c,
        -s * ca,
        s * sa,
        a * c, //
        s,
        c * ca,
        -c * sa,
        a * s, //
        0.0,
        sa,
        ca,
        d, //
        0.0,
        0.0,
        0.0,
        1.0,
    )
}

/// a, d, α of the UR5e and the UR10e as Universal Robots publishes them, m.
const UR5E: [(f64, f64, f64); 6] = [
    (0.0, 0.1625, FRAC_PI_2),
    (-0.425, 0.0, 0.0),
    (-0.3922, 0.0, 0.0),
    (0.0, 0.1333, FRAC_PI_2),
    (0.0, 0.0997, -FRAC_PI_2),
    (0.0, 0.0996, 0.0),
];
const UR10E: [(f64, f64, f64); 6] = [
    (0.0, 0.1807, FRAC_PI_2),
    (-0.6127, 0.0, 0.0),
    (-0.57155, 0.0, 0.0),
    (0.0, 0.17415, FRAC_PI_2),
    (0.0, 0.11985, -FRAC_PI_2),
    (0.0, 0.11655, 0.0),
];

fn random_angles(random: &mut ChaCha8Rng, arm: &Arm) -> Angles {
    std::array::from_fn(|k| {
        let [low, high] = arm.joints[k].range_rad;
        random.random_range(low..high)
    })
}

#[test]
fn arms_of_universal_robots_agree_with_their_published_tables() {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    for (name, table) in [("ur5e", UR5E), ("ur10e", UR10E)] {
        let arm = named::find(name).unwrap().arm();
        for _ in 0..20 {
            let angles = random_angles(&mut random, &arm);
            let product = (table.iter().zip(angles))
                .fold(Matrix4::identity(), |at, ((a, d, alpha), angle)| at * matrix(angle, *d, *a, *alpha));
            let off = (arm.base_from_flange(&angles).to_homogeneous() - product).norm();
            // Six products of numbers up to 1, each rounded to 1e-16.
            assert!(off < 1e-14, "{name}: {off}");
        }
    }
}

#[test]
fn named_arms_stand_at_zero_where_their_drawings_have_the_flange() {
    let down = Rotation3::from_axis_angle(&Vector3::y_axis(), FRAC_PI_2);
    for (name, at_mm, turn) in [
        // a₂ + a₃, −(d₄ + d₆), d₁ − d₅.
        ("ur5e", [-817.2, -232.9, 62.8], Rotation3::from_axis_angle(&Vector3::x_axis(), FRAC_PI_2)),
        // Forearm and wrist point to the front, and the flange points along x.
        ("abb-irb1200-5-0.9", [533.0, 0.0, 889.1], down),
        ("abb-irb2600-12-1.65", [1030.0, 0.0, 1260.0], down),
        // KUKA's zero stretches the whole arm to the front.
        ("kuka-kr10-r1420", [1500.0, 0.0, 470.0], down),
    ] {
        let pose = named::find(name).unwrap().arm().base_from_flange(&[0.0; AXES]);
        assert!((pose.translation.vector * 1e3 - Vector3::from(at_mm)).norm() < 1e-9, "{name}: {pose}");
        assert!(pose.rotation.angle_to(&UnitQuaternion::from_rotation_matrix(&turn)) < 1e-9, "{name}");
    }
    assert!(named::find("nobody").is_none());
    assert!(named::ALL.iter().all(|arm| !arm.source.is_empty()));
}

/// The simulator's arm as a table.
fn simulated() -> Arm {
    dh::arm(&NOMINAL.map(|link| Row {
        offset_rad: link.offset_rad,
        d_m: link.d_m,
        a_m: link.a_m,
        alpha_rad: link.alpha_rad,
        range_rad: [-PI, PI],
        speed_rad_s: 1.0,
    }))
}

#[test]
fn a_table_agrees_with_the_simulators_arm_in_both_directions() {
    let (arm, mut random) = (simulated(), ChaCha8Rng::seed_from_u64(2));
    for _ in 0..20 {
        // Within the simulator's single configuration: shoulder forward, elbow up, wrist not flipped.
        let angles: Angles = [(-1.0, 1.0), (-0.3, 0.8), (-0.5, 0.8), (-1.5, 1.5), (0.3, 1.6), (-1.5, 1.5)]
            .map(|(low, high)| random.random_range(low..high));
        let pose = forward(&NOMINAL, &angles);
        let off = arm.base_from_flange(&angles).inverse() * pose;
        assert!(off.translation.vector.norm() < 1e-13 && off.rotation.angle() < 1e-7, "{off}");
        let theirs = inverse_of_sim(&pose).unwrap();
        let near = theirs.map(|angle| angle + 0.2);
        let ours = inverse::angles_for(&arm, &pose, &near).unwrap();
        // The flange is accurate to 1e-10, and every joint rotates it by at least a tenth of its angle here.
        assert!((0..AXES).all(|k| (ours[k] - theirs[k]).abs() < 1e-8), "{ours:?} {theirs:?}");
    }
}

#[test]
fn the_jacobian_is_the_derivative_of_the_pose() {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    for named in named::ALL {
        let arm = named.arm();
        let angles = random_angles(&mut random, &arm);
        let jacobian = arm.state(&angles).jacobian();
        const STEP: f64 = 1e-6;
        for k in 0..AXES {
            let at = |by: f64| {
                let mut moved = angles;
                moved[k] += by;
                arm.base_from_flange(&moved)
            };
            let (before, after) = (at(-STEP), at(STEP));
            let shift = (after.translation.vector - before.translation.vector) / (2.0 * STEP);
            let turn = (after.rotation * before.rotation.inverse()).scaled_axis() / (2.0 * STEP);
            let column = Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z);
            // Rounding 1e-16/2e-6, and the step squared.
            assert!((jacobian.column(k) - column).norm() < 1e-8, "{}: {k}", named.name);
        }
    }
}

#[test]
fn every_configuration_reaches_the_pose_and_the_drawn_one_is_among_them() {
    let mut random = ChaCha8Rng::seed_from_u64(4);
    for named in named::ALL {
        let arm = named.arm();
        let angles = random_angles(&mut random, &arm);
        let pose = arm.base_from_flange(&angles);
        let found = inverse::configurations(&arm, &pose);
        // An arm of this kind has at most eight \[Pieper1968\].
        assert!((1..=8).contains(&found.len()), "{}: {}", named.name, found.len());
        for one in &found {
            let off = arm.base_from_flange(one).inverse() * pose;
            assert!(off.translation.vector.norm() < 1e-9, "{}", named.name);
            assert!(arm.used_of_range(one).iter().all(|used| *used <= 1.0));
        }
        let turns = |k: usize, one: &Angles| (one[k] - angles[k]) / (2.0 * PI);
        let is_it = |one: &Angles| (0..AXES).all(|k| (turns(k, one) - turns(k, one).round()).abs() < 1e-6);
        assert!(found.iter().any(is_it), "{}: {angles:?} {found:?}", named.name);
    }
}

#[test]
fn out_of_reach_is_reported() {
    let arm = named::find("ur5e").unwrap().arm();
    let far = Pose::translation(1.2, 0.0, 0.3);
    assert!(inverse::configurations(&arm, &far).is_empty());
}

#[test]
fn the_wrists_distance_is_the_fifth_angle_of_a_spherical_wrist() {
    let arm = named::find("abb-irb2600-12-1.65").unwrap().arm();
    for (fifth, distance) in [(0.4, 0.4), (-0.7, 0.7), (2.0, PI - 2.0), (0.0, 0.0)] {
        let state = arm.state(&[0.2, 0.1, 0.3, 0.8, fifth, -0.4]);
        assert!((state.wrist_rad() - distance).abs() < 1e-9, "{fifth}");
    }
}

/// The KR 10 R1420 as a URDF, with its joints in a row and a flange.
fn urdf(limit_of_a3: &str) -> String {
    let joint = |n: usize, xyz: &str, axis: &str, limit: &str| {
        format!(
            "<joint name=\"a{n}\" type=\"revolute\"><parent link=\"l{}\"/><child link=\"l{n}\"/><origin xyz=\"{xyz}\"/>\
             <axis xyz=\"{axis}\"/>{limit}</joint>",
            n - 1
        )
    };
    let limit = "<limit lower=\"-2\" upper=\"2.5\" velocity=\"3\" effort=\"0\"/>";
    [
        "<robot name=\"r\">".to_owned(),
        joint(1, "0 0 0.45", "0 0 -1", limit),
        joint(2, "0.15 0 0", "0 1 0", limit),
        joint(3, "0.61 0 0", "0 1 0", limit_of_a3),
        joint(4, "0 0 0.02", "-1 0 0", limit),
        joint(5, "0.66 0 0", "0 1 0", limit),
        joint(6, "0.08 0 0", "-1 0 0", limit),
        "<joint name=\"f\" type=\"fixed\"><parent link=\"l6\"/><child link=\"flange\"/>\
         <origin xyz=\"0 0 0\" rpy=\"0 1.5707963267948966 0\"/></joint></robot>"
            .to_owned(),
    ]
    .concat()
}

#[test]
fn a_urdf_gives_the_same_arm_as_its_name() {
    let limit = "<limit lower=\"-2\" upper=\"2.5\" velocity=\"3\" acceleration=\"9\" effort=\"0\"/>";
    let arm = Chain::of(&urdf(limit), None, None).unwrap().arm().unwrap();
    let named = named::find("kuka-kr10-r1420").unwrap().arm();
    let angles = [0.3, -0.9, 1.1, 0.4, -0.6, 2.0];
    let off = arm.base_from_flange(&angles).inverse() * named.base_from_flange(&angles);
    assert!(off.translation.vector.norm() < 1e-13 && off.rotation.angle() < 1e-7, "{off}");
    assert_eq!((arm.joints[1].range_rad, arm.joints[1].speed_rad_s), ([-2.0, 2.5], 3.0));
    assert_eq!(arm.joints.each_ref().map(|joint| joint.acceleration_rad_s2)[1..3], [None, Some(9.0)]);
}

#[test]
fn a_urdf_without_limits_or_with_other_joints_is_refused() {
    let refusal = |limit: &str| match Chain::of(&urdf(limit), None, None).and_then(|chain| chain.arm()) {
        Err(UrdfError::Unusable { why }) => why,
        other => panic!("{other:?}"),
    };
    assert!(refusal("").contains("`a3` has no limit of its range"));
    assert!(refusal("<limit lower=\"-1\" upper=\"1\"/>").contains("`a3` has no limit of its speed"));
    assert!(refusal("<limit lower=\"1\" upper=\"1\" velocity=\"1\"/>").contains("leave nothing"));
    assert!(refusal("<limit lower=\"nan\" upper=\"1\" velocity=\"1\"/>").contains("not a number"));
    let five =
        Chain::of(&urdf("<limit lower=\"-1\" upper=\"1\" velocity=\"1\"/>"), Some("l1"), None).unwrap();
    assert!(matches!(five.arm(), Err(UrdfError::Unusable { why }) if why.contains("this has 5")));
}
