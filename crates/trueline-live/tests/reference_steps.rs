//! A reference never steps further than limits × time, whatever a robot reports; and the tool's load is never faster than
//! 250 mm/s.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod common;

use common::liar::{Liar, shifted};
use common::{PERIOD_NS, limits};
use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;
use trueline_dataset::RobotSample;
use trueline_geometry::{Pose, so3};
use trueline_live::egm::MciState;
use trueline_live::motion::{
    CheckedPath, EndReason, MotionLimits, OperatorCommand, PathError, Phase, Reference, derive_limits,
};

/// Time by which a reference may be ahead: 12 ms made up for, and a period of 20 ms at most.
const AHEAD_S: f64 = 0.032;
/// The cap at the tip.
const TIP_M_S: f64 = 0.250;

/// How far the furthest of all points within reach of the tool's origin is moved from one pose to another, m. Of a turn by θ about n,
/// (R − 1) q fills a disc square to n of radius 2 sin(θ/2) · reach; the part of the origin's shift along n comes square to it.
fn greatest_shift_m(from: &Pose, to: &Pose, reach_m: f64) -> f64 {
    let shift_m = to.translation.vector - from.translation.vector;
    let turn = to.rotation * from.rotation.inverse();
    let Some(axis) = turn.axis() else { return shift_m.norm() };
    let along_m = shift_m.dot(&axis);
    let square_m = (shift_m - axis.into_inner() * along_m).norm();
    along_m.hypot(square_m + 2.0 * (turn.angle() / 2.0).sin() * reach_m)
}

/// Between any two references lies no more than limits × (time + what may be ahead).
fn check_steps(sent: &[(i64, Reference)], l: &MotionLimits) {
    for (k, (from_ns, from)) in sent.iter().enumerate() {
        for (to_ns, to) in &sent[k + 1..sent.len().min(k + 60)] {
            let may_s = (to_ns - from_ns) as f64 * 1e-9 + AHEAD_S;
            let (a, b) = (from.base_from_tool, to.base_from_tool);
            let step_m = (b.translation.vector - a.translation.vector).norm();
            let turn_rad = a.rotation.angle_to(&b.rotation);
            assert!(step_m <= l.speed_m_s * may_s + 1e-9, "{step_m} m in {may_s} s");
            assert!(turn_rad <= l.turn_rad_s * may_s + 1e-7, "{turn_rad} rad in {may_s} s");
            let tip_m = greatest_shift_m(&a, &b, l.reach_m);
            assert!(tip_m <= TIP_M_S * may_s + 1e-7, "the tip moved by {tip_m} m in {may_s} s");
        }
    }
}

fn check(robot: &Liar) {
    check_steps(&robot.sent, &limits());
}

#[test]
fn a_jump_that_stays_is_not_followed() {
    for jump_m in [0.035, 0.05, 0.08, 0.15] {
        let mut robot = Liar::new();
        robot.obeys(500);
        let away = shifted(&robot.obedient(), jump_m);
        for _ in 0..200 {
            robot.says(PERIOD_NS, away, |_| {});
        }
        check(&robot);
        let why = robot.state.phase;
        assert!(matches!(why, Phase::Silent { why: EndReason::NotBelieved { .. } }), "{jump_m}: {why:?}");
        assert!(robot.sent.last().unwrap().1.is_rest());
    }
}

#[test]
fn a_new_session_elsewhere_is_held_at_the_last_reference() {
    let mut robot = Liar::new();
    robot.obeys(500);
    let last = robot.obedient();
    let away = shifted(&last, 0.051);
    robot.says(150_000_000, away, |received| received.is_first = true);
    assert!(matches!(robot.state.phase, Phase::Holding { why: EndReason::Restarted, .. }));
    for _ in 0..50 {
        robot.says(PERIOD_NS, away, |_| {});
    }
    check(&robot);
    assert!((robot.obedient().translation.vector - last.translation.vector).norm() < 1e-12);
    assert!(robot.sent.last().unwrap().1.is_rest());
}

#[test]
fn walking_unguided_and_coming_back_guided_moves_no_reference_faster_than_the_limits() {
    // Before the scan, and after one that was broken off.
    for obeyed in [10, 500] {
        let mut robot = Liar::new();
        robot.obeys(obeyed);
        let mut at = robot.obedient();
        for _ in 0..60 {
            // 2 mm a frame: believed, and five times the limit.
            at = shifted(&at, 0.002);
            robot.says(PERIOD_NS, at, |received| received.frame.mci = MciState::Stopped);
        }
        for _ in 0..100 {
            robot.says(PERIOD_NS, at, |_| {});
        }
        check(&robot);
        assert!(robot.sent.last().unwrap().1.is_rest(), "{:?}", robot.state.phase);
    }
}

#[test]
fn drift_and_a_frozen_robot_are_held_without_a_leap() {
    let mut robot = Liar::new();
    robot.obeys(500);
    let frozen = robot.obedient();
    for _ in 0..500 {
        robot.says(PERIOD_NS, frozen, |_| {});
    }
    check(&robot);
    let why = robot.state.phase;
    assert!(matches!(why, Phase::Holding { why: EndReason::Deviation { .. }, .. }), "{why:?}");
    assert!((robot.obedient().translation.vector - frozen.translation.vector).norm() < 1e-9, "back to it");

    let mut robot = Liar::new();
    robot.obeys(500);
    for k in 0..200 {
        let away = shifted(&robot.obedient(), 0.0022 * f64::from(k.min(20)));
        robot.says(PERIOD_NS, away, |_| {});
    }
    check(&robot);
    assert!(matches!(robot.state.phase, Phase::Holding { .. } | Phase::Silent { .. }));
}

#[test]
fn a_slow_start_buys_no_leap_later() {
    for slow_ns in [19_000_000, 190_000_000] {
        let mut robot = Liar::new();
        let mut device_ns = 0;
        for _ in 0..40 {
            device_ns += slow_ns;
            robot.says(slow_ns, robot.obedient(), |received| received.frame.device_ns = device_ns);
        }
        // A clock that lags, and leaps when there is something to be had.
        for k in 0..2000 {
            device_ns += if k % 12 == 11 { 60_000_000 } else { 100_000 };
            robot.says(PERIOD_NS, robot.obedient(), |received| received.frame.device_ns = device_ns);
        }
        check(&robot);
    }
}

/// The network holds frames up and delivers them in order, 0.2 ms apart or all at once.
#[test]
fn a_stall_of_the_network_pauses_the_scan_and_it_goes_on() {
    for stall_ms in [20_i64, 30, 60, 90, 120, 180] {
        for apart_ns in [0, 200_000, 2_000_000] {
            // 180 ms and 44 frames of 2 ms are more than the controller's patience of 200 ms.
            if stall_ms == 180 && apart_ns == 2_000_000 {
                continue;
            }
            let mut robot = Liar::new();
            robot.obeys(500);
            let stalled = stall_ms * 1_000_000 / PERIOD_NS;
            let at = robot.obedient();
            let ends_ns = robot.now_ns + stalled * PERIOD_NS;
            // Meanwhile the loop ticks.
            while robot.now_ns + PERIOD_NS < ends_ns {
                robot.now_ns += PERIOD_NS;
                robot.step(None, OperatorCommand::Go);
            }
            for k in 0..stalled {
                robot.now_ns = ends_ns + k * apart_ns - apart_ns;
                robot.says(apart_ns, at, |_| {});
            }
            // Frames that were sent meanwhile come on top of the queue, then all is as before.
            while robot.state.phase != Phase::Waiting && robot.k * PERIOD_NS < robot.now_ns - PERIOD_NS {
                robot.says(100_000, robot.obedient(), |_| {});
            }
            robot.now_ns = robot.k * PERIOD_NS;
            robot.obeys(2600);
            check(&robot);
            let ended = robot.state.phase;
            assert!(
                matches!(ended, Phase::Holding { why: EndReason::Travelled, .. }),
                "{stall_ms} ms, {apart_ns} ns apart: {ended:?}"
            );
            assert!(robot.state.pauses >= 1);
        }
    }
}

/// A tool that turns about its own origin, 0.9 s to and fro.
fn turning_path(turn_rad: f64) -> Vec<RobotSample> {
    let down = so3::exp(&Vector3::new(std::f64::consts::PI, 0.0, 0.0));
    (0..=300)
        .map(|k| {
            let t = f64::from(k) * 0.01;
            let turn = Vector3::new(0.0, 0.0, turn_rad * (7.0 * t).sin());
            let pose = Pose::from_parts(Vector3::new(1.0, 0.0, 0.6).into(), down * so3::exp(&turn));
            RobotSample { stamp_ns: k as i64 * 10_000_000, device_ns: None, base_from_tool: pose }
        })
        .collect()
}

#[test]
fn turning_about_a_resting_tool_is_capped_at_what_the_tool_carries() {
    let wide = |reach_m: f64| MotionLimits {
        reach_m,
        cone_rad: 3.0,
        turn_rad_s: 8.0,
        turn_acceleration_rad_s2: 100.0,
        ..limits()
    };
    // 1.1 rad · 7/s = 7.7 rad/s: 2.3 m/s at 300 mm.
    let refused = CheckedPath::new(&turning_path(1.1), 1.0, &wide(0.3));
    assert!(
        matches!(refused, Err(PathError::TooMuch { what: "the speed of the tool's load", found, .. }) if found > 2200.0),
        "{refused:?}"
    );
    assert!(matches!(
        derive_limits::limits_for(&turning_path(1.1), 1.0, 0.3),
        Err(PathError::TooMuch { what: "the speed of the tool's load", .. })
    ));
    // 0.1 rad · 7/s · 0.3 m = 0.21 m/s, and a little for the bound.
    let path = CheckedPath::new(&turning_path(0.1), 1.0, &wide(0.3)).unwrap();
    assert!((0.209..0.225).contains(&path.extremes().tip_m_s), "{}", path.extremes().tip_m_s);
    assert!(CheckedPath::new(&turning_path(0.1), 1.0, &wide(0.4)).is_err());
    let derived = derive_limits::limits_for(&turning_path(0.1), 1.0, 0.3).unwrap();
    assert!(derived.reach_m == 0.3 && derived.turn_rad_s * 0.3 <= TIP_M_S);
    assert!(CheckedPath::new(&turning_path(0.1), 1.0, &derived).is_ok());
}

/// A robot that jumps in place and attitude and begins anew. It is shifted along the axis of its turn, so its tool's fastest
/// point moves by less than the sum of both.
#[test]
fn a_turn_and_a_shift_along_its_axis_keep_the_cap_at_the_tip() {
    let mut robot = Liar::new();
    for _ in 0..30 {
        robot.says(28_385_809, robot.obedient(), |_| {});
    }
    let turned = so3::exp(&Vector3::new(0.0, -0.147_359_644, -0.124_230_568));
    let mut pose = robot.obedient();
    pose.translation.vector.z += 0.084_776_284;
    pose.rotation *= turned;
    robot.says(100_000, pose, |_| {});
    robot.now_ns += 3_689_123 * 20;
    robot.step(None, OperatorCommand::Go);
    for _ in 0..=16 {
        let mut pose = robot.obedient();
        pose.translation.vector.z += 0.084_776_284;
        pose.rotation *= turned;
        robot.says(3_689_123, pose, |_| {});
    }
    let mut pose = robot.obedient();
    pose.translation.vector.x -= 0.053_094_455;
    pose.rotation *= turned;
    robot.says(5_331_491, pose, |received| received.is_first = true);
    check(&robot);
    let (from, to) = (robot.sent[0].1.base_from_tool, robot.sent[robot.sent.len() - 1].1.base_from_tool);
    assert!(
        from.rotation.angle_to(&to.rotation) > 0.02,
        "the test turns the tool: {:?}",
        from.rotation.angle_to(&to.rotation)
    );
}

#[derive(Clone, Debug)]
enum Lie {
    Obey,
    Nothing,
    Jump([f64; 3], [f64; 3]),
    Stay([f64; 3]),
    Unguided,
    NewSession([f64; 3]),
    Clock(i64),
}

fn lie() -> impl Strategy<Value = Lie> {
    let small = || prop::array::uniform3(-0.2..0.2);
    prop_oneof![
        20 => Just(Lie::Obey),
        2 => Just(Lie::Nothing),
        2 => (small(), small()).prop_map(|(p, r)| Lie::Jump(p, r)),
        3 => prop::array::uniform3(-0.01..0.01).prop_map(Lie::Stay),
        2 => Just(Lie::Unguided),
        1 => small().prop_map(Lie::NewSession),
        2 => (-400_000_000..400_000_000_i64).prop_map(Lie::Clock),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// The robot obeys, jumps and stays there, walks unguided, begins anew, and its clock leaps; frames come from 0.1 to 150 ms apart.
    #[test]
    fn no_lie_makes_a_reference_step_further_than_limits_times_time(
        lies in prop::collection::vec((lie(), 100_000..8_000_000_i64, 0..40_usize), 1..60),
        first_ns in prop_oneof![3 => Just(PERIOD_NS), 1 => 4_000_000..190_000_000_i64],
    ) {
        let mut robot = Liar::new();
        for _ in 0..30 {
            robot.says(first_ns, robot.obedient(), |_| {});
        }
        let (mut off, mut turned, mut clock_ns, mut guided) =
            (Vector3::zeros(), UnitQuaternion::identity(), 0_i64, true);
        for (lie, every_ns, repeats) in lies {
            let mut is_first = false;
            match &lie {
                Lie::Obey => (off, turned, guided) = (Vector3::zeros(), UnitQuaternion::identity(), true),
                Lie::Nothing => {
                    robot.now_ns += every_ns * 20;
                    robot.step(None, OperatorCommand::Go);
                }
                Lie::Jump(p, r) => (off, turned) = (Vector3::from(*p), so3::exp(&Vector3::from(*r))),
                Lie::Stay(p) => off += Vector3::from(*p),
                Lie::Unguided => guided = !guided,
                Lie::NewSession(p) => (off, is_first) = (Vector3::from(*p), true),
                Lie::Clock(ns) => clock_ns += ns,
            }
            for repeat in 0..=repeats {
                let mut pose = robot.obedient();
                pose.translation.vector += off;
                pose.rotation *= turned;
                robot.says(every_ns, pose, |received| {
                    received.is_first |= is_first && repeat == 0;
                    received.frame.device_ns += clock_ns;
                    if !guided {
                        received.frame.mci = MciState::Stopped;
                    }
                });
            }
        }
        check(&robot);
        for (_, sent) in &robot.sent {
            prop_assert!(limits().contain(&sent.base_from_tool));
            let tip = limits().tip_speed_m_s(&sent.velocity_m_s, &sent.angular_velocity_rad_s);
            prop_assert!(tip <= TIP_M_S, "{tip}");
        }
    }
}
