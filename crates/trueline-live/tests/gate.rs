//! For any input, no command outside the limits leaves the gate; and every kind of exit ends in rest.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod common;

use common::{PERIOD_NS, PERIOD_S, frame, limits, s_path};
use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;
use trueline_dataset::RobotSample;
use trueline_geometry::{Pose, so3};
use trueline_live::RobotFrame;
use trueline_live::egm::{MciState, MotorState, RapidState};
use trueline_live::motion::{
    CheckedPath, EndReason, Gate, GateState, Input, MotionLimits, OperatorCommand, PathError, Phase,
    ReceivedFrame, Reference,
};

fn gate() -> Gate {
    let path = CheckedPath::new(&s_path(1.0), 1.0, &limits()).unwrap();
    Gate::new(limits(), path, 0.2)
}

/// A robot at its commanded pose, one period later.
struct Follower {
    gate: Gate,
    state: GateState,
    robot: Pose,
    k: i64,
    sent: Vec<(i64, Reference)>,
}

impl Follower {
    fn new() -> Self {
        let gate = gate();
        let robot = gate.path().at(0.0).base_from_tool;
        Self { gate, state: GateState::default(), robot, k: 0, sent: Vec::new() }
    }

    fn tick(&mut self, command: OperatorCommand, change: impl FnOnce(&mut RobotFrame)) -> Option<Reference> {
        let mut frame = frame(self.k, self.robot);
        change(&mut frame);
        self.input(Some(frame), command)
    }

    fn input(&mut self, frame: Option<RobotFrame>, command: OperatorCommand) -> Option<Reference> {
        let now_ns = self.k * PERIOD_NS;
        let received = frame.map(|frame| ReceivedFrame { frame, arrival_ns: now_ns, is_first: self.k == 0 });
        let input = Input { received, now_ns, command };
        let (state, sent) = self.gate.step(self.state, &input);
        self.state = state;
        if let Some(reference) = sent {
            self.sent.push((self.k, reference));
            self.robot = reference.base_from_tool;
        }
        self.k += 1;
        sent
    }

    fn go(&mut self, ticks: usize) {
        for _ in 0..ticks {
            self.tick(OperatorCommand::Go, |_| {});
        }
    }

    fn end_reason(&self) -> Option<EndReason> {
        match self.state.phase {
            Phase::Holding { why, .. } | Phase::Silent { why } => Some(why),
            _ => None,
        }
    }

    fn last_is_rest(&self) -> bool {
        let (_, last) = self.sent.last().unwrap();
        last.velocity_m_s == Vector3::zeros() && last.angular_velocity_rad_s == Vector3::zeros()
    }
}

#[test]
fn travels_the_path_from_rest_to_rest_within_every_limit() {
    let mut robot = Follower::new();
    robot.go(2500);
    assert_eq!(robot.end_reason(), Some(EndReason::Travelled));
    assert!(robot.last_is_rest());
    let end = robot.gate.path().at(robot.gate.path().duration_s()).base_from_tool;
    // It stops at most two steps before the end: two periods of path time at full rate.
    let missing = (robot.robot.translation.vector - end.translation.vector).norm();
    assert!(missing < 2.0 * PERIOD_S * 0.12, "{missing}");
    let l = limits();
    let poses: Vec<Vector3<f64>> =
        robot.sent.iter().map(|(_, r)| r.base_from_tool.translation.vector).collect();
    let d1: Vec<Vector3<f64>> = poses.windows(2).map(|p| (p[1] - p[0]) / PERIOD_S).collect();
    let d2: Vec<Vector3<f64>> = d1.windows(2).map(|p| (p[1] - p[0]) / PERIOD_S).collect();
    let d3: Vec<Vector3<f64>> = d2.windows(2).map(|p| (p[1] - p[0]) / PERIOD_S).collect();
    let most = |list: &[Vector3<f64>]| list.iter().map(|v| v.norm()).fold(0.0, f64::max);
    // Divided differences are values of the derivative in between; cutting the rate at 1e-5 adds 1e-5 · speed / period
    // and its differences.
    let cut = 1e-5 * l.speed_m_s;
    assert!(most(&d1) <= l.speed_m_s);
    assert!(most(&d2) <= l.acceleration_m_s2 + cut / PERIOD_S, "{}", most(&d2));
    assert!(most(&d3) <= l.jerk_m_s3 + 2.0 * cut / PERIOD_S.powi(2), "{}", most(&d3));
    // The stated velocity agrees with the poses, half a second difference apart.
    for (k, pair) in robot.sent.windows(2).enumerate() {
        let mean = 0.5 * (pair[0].1.velocity_m_s + pair[1].1.velocity_m_s);
        assert!((mean - d1[k]).norm() < l.jerk_m_s3 * PERIOD_S.powi(2) / 12.0 + 1e-5, "{k}");
        let turned =
            so3::log(&(pair[1].1.base_from_tool.rotation * pair[0].1.base_from_tool.rotation.inverse()))
                / PERIOD_S;
        let mean = 0.5 * (pair[0].1.angular_velocity_rad_s + pair[1].1.angular_velocity_rad_s);
        assert!((mean - turned).norm() < 2e-3, "{k}: {mean} {turned}");
    }
}

#[test]
fn begins_where_the_robot_is() {
    let mut robot = Follower::new();
    robot.robot.translation.vector += Vector3::new(0.004, -0.003, 0.002);
    robot.robot.rotation *= so3::exp(&Vector3::new(0.01, 0.02, -0.01));
    let start = robot.robot;
    robot.go(4);
    for (_, sent) in &robot.sent {
        assert!((sent.base_from_tool.translation.vector - start.translation.vector).norm() < 1e-5);
        assert!(sent.base_from_tool.rotation.angle_to(&start.rotation) < 1e-5);
    }
    // And the motion goes on from there: it has hardly begun to move after ten frames.
    robot.go(40);
    let first = robot.sent.iter().position(|(_, sent)| !sent.is_rest()).unwrap();
    for (_, sent) in &robot.sent[first..first + 5] {
        assert!((sent.base_from_tool.translation.vector - start.translation.vector).norm() < 1e-4);
        assert!(sent.base_from_tool.rotation.angle_to(&start.rotation) < 1e-3);
    }
    robot.go(2500);
    assert_eq!(robot.end_reason(), Some(EndReason::Travelled));
}

#[test]
fn nothing_is_sent_before_the_robot_was_heard_twice() {
    let mut robot = Follower::new();
    assert_eq!(robot.input(None, OperatorCommand::Go), None);
    assert_eq!(robot.tick(OperatorCommand::Go, |_| {}), None);
    assert!(robot.tick(OperatorCommand::Go, |_| {}).is_some());
}

#[test]
fn nothing_begins_too_far_from_the_path() {
    let mut robot = Follower::new();
    robot.robot.translation.vector.y += 0.02;
    let start = robot.robot;
    robot.go(100);
    assert!(matches!(robot.end_reason(), Some(EndReason::StartTooFar { .. })));
    assert!(robot.sent.iter().all(|(_, r)| r.base_from_tool == start) && robot.last_is_rest());
}

#[test]
fn waits_and_echoes_until_the_controller_is_ready() {
    let not_ready: [fn(&mut RobotFrame); 4] = [
        |f| f.motors = MotorState::Off,
        |f| f.motors = MotorState::Undefined,
        |f| f.mci = MciState::Stopped,
        |f| f.rapid = RapidState::Stopped,
    ];
    for change in not_ready {
        let mut robot = Follower::new();
        let start = robot.robot;
        for _ in 0..100 {
            robot.tick(OperatorCommand::Go, change);
        }
        assert_eq!(robot.state.phase, Phase::Waiting);
        assert!(robot.sent.iter().all(|(_, r)| *r == Reference::rest(start)));
        robot.tick(OperatorCommand::Go, |f| f.rapid = RapidState::Undefined);
        assert!(matches!(robot.state.phase, Phase::Travelling { .. }));
    }
}

#[test]
fn a_stop_is_smooth_and_ends_in_rest_on_the_path() {
    let mut robot = Follower::new();
    robot.go(500);
    let before = robot.sent.len();
    for _ in 0..600 {
        robot.tick(OperatorCommand::Stop, |_| {});
    }
    assert_eq!(robot.end_reason(), Some(EndReason::Stopped));
    assert!(robot.last_is_rest());
    let v: Vec<Vector3<f64>> = robot.sent[before - 1..].iter().map(|(_, r)| r.velocity_m_s).collect();
    for pair in v.windows(2) {
        assert!((pair[1] - pair[0]).norm() <= limits().acceleration_m_s2 * PERIOD_S + 1e-5 * 0.12);
    }
    // Once stopped it stays so, whatever the operator wishes then.
    let at = robot.robot;
    robot.go(100);
    assert!(robot.robot == at && robot.last_is_rest());
}

#[test]
fn silence_is_wished_once_and_ends_with_rest() {
    let mut robot = Follower::new();
    robot.go(500);
    let robot_at = robot.robot;
    let last = robot.tick(OperatorCommand::Silence, |_| {}).unwrap();
    assert_eq!(last, Reference::rest(robot_at));
    for _ in 0..100 {
        assert_eq!(robot.tick(OperatorCommand::Go, |_| {}), None);
    }
}

#[test]
fn what_goes_wrong_on_the_way_holds_the_robot_where_it_is() {
    type Fault = (fn(&mut RobotFrame), fn(&EndReason) -> bool);
    let faults: [Fault; 6] = [
        (|f| f.motors = MotorState::Off, |e| *e == EndReason::LeftGuidance),
        (|f| f.mci = MciState::Stopped, |e| *e == EndReason::LeftGuidance),
        (|f| f.mci = MciState::Error, |e| *e == EndReason::LeftGuidance),
        (|f| f.rapid = RapidState::Stopped, |e| *e == EndReason::LeftGuidance),
        (|f| f.collided = true, |e| *e == EndReason::Collision),
        // 2 mm a frame, believable, until it is 30 mm away.
        (|f| f.base_from_tool.translation.vector.z -= 0.002, |e| matches!(e, EndReason::Deviation { .. })),
    ];
    for (fault, is_it) in faults {
        let mut robot = Follower::new();
        robot.go(500);
        let mut robot_at = robot.robot;
        for _ in 0..60 {
            let mut frame = frame(robot.k, robot_at);
            fault(&mut frame);
            robot_at = frame.base_from_tool;
            robot.input(Some(frame), OperatorCommand::Go);
        }
        assert!(robot.end_reason().as_ref().is_some_and(is_it), "{:?}", robot.end_reason());
        assert!(robot.last_is_rest());
        // When all is well again, motion does not begin again.
        let held = robot.robot;
        for _ in 0..300 {
            let frame = frame(robot.k, held);
            robot.input(Some(frame), OperatorCommand::Go);
        }
        assert!((robot.robot.translation.vector - held.translation.vector).norm() < 1e-12);
    }
}

#[test]
fn a_robot_that_cannot_follow_is_stopped_smoothly() {
    let mut robot = Follower::new();
    robot.go(500);
    robot.tick(OperatorCommand::Go, |f| f.utilization_percent = Some(120.0));
    assert!(matches!(robot.state.phase, Phase::Stopping { why: EndReason::Overload { .. }, .. }));
    robot.go(600);
    assert!(matches!(robot.end_reason(), Some(EndReason::Overload { .. })) && robot.last_is_rest());
}

#[test]
fn a_silent_robot_gets_one_last_word_and_no_more() {
    let mut robot = Follower::new();
    robot.go(500);
    let sent = robot.sent.len();
    // 0.24 s: longer than the controller's own timeout.
    for _ in 0..60 {
        robot.input(None, OperatorCommand::Go);
    }
    assert_eq!(robot.sent.len(), sent + 1);
    assert!(robot.last_is_rest());
    assert!(matches!(robot.end_reason(), Some(EndReason::RobotSilent { .. })));
    robot.go(500);
    assert_eq!(robot.sent.len(), sent + 1, "it comes back, and is not led any more");
}

#[test]
fn after_a_short_silence_the_ride_goes_on_from_rest_if_all_is_as_it_was() {
    for with_ticks in [true, false] {
        let mut robot = Follower::new();
        robot.go(500);
        let sent = robot.sent.len();
        for _ in 0..12 {
            if with_ticks {
                robot.input(None, OperatorCommand::Go);
            } else {
                robot.k += 1;
            }
        }
        robot.go(2);
        assert!(matches!(robot.state.phase, Phase::Travelling { .. }), "{:?}", robot.state.phase);
        assert_eq!(robot.state.pauses, 1);
        let rested = &robot.sent[sent..];
        assert!(rested.iter().all(|(_, r)| *r == Reference::rest(robot.robot)), "at rest where it was");
        robot.go(2500);
        assert_eq!(robot.end_reason(), Some(EndReason::Travelled));
    }
    // Not in another session, not when moved away meanwhile, not when the operator wants it to stop, not unguided.
    type Change = (fn(&mut RobotFrame), OperatorCommand);
    let changes: [Change; 4] = [
        (|f| f.device_ns += 1_000_000_000, OperatorCommand::Go),
        (|f| f.base_from_tool.translation.vector.z += 0.04, OperatorCommand::Go),
        (|_| (), OperatorCommand::Stop),
        (|f| f.mci = MciState::Stopped, OperatorCommand::Go),
    ];
    for (change, command) in changes {
        let mut robot = Follower::new();
        robot.go(500);
        for _ in 0..12 {
            robot.input(None, OperatorCommand::Go);
        }
        for _ in 0..100 {
            robot.tick(command, change);
        }
        assert!(robot.end_reason().is_some() && robot.last_is_rest());
    }
}

#[test]
fn a_hold_up_pauses_the_ride_without_a_leap() {
    let mut robot = Follower::new();
    robot.go(500);
    let before = robot.sent.last().unwrap().1;
    robot.k += 3;
    let after = robot.tick(OperatorCommand::Go, |_| {}).unwrap();
    let leap = (after.base_from_tool.translation.vector - before.base_from_tool.translation.vector).norm();
    assert!(leap <= 0.12 * PERIOD_S, "{leap}");
    assert_eq!(robot.state.pauses, 1);
    robot.go(20);
    assert!(robot.sent.last().unwrap().1.velocity_m_s.norm() < before.velocity_m_s.norm());
    robot.go(2500);
    assert_eq!(robot.end_reason(), Some(EndReason::Travelled));
}

#[test]
fn a_leap_of_the_feedback_is_not_believed() {
    let mut robot = Follower::new();
    robot.go(500);
    let sent = robot.tick(OperatorCommand::Go, |f| f.base_from_tool.translation.vector.x += 0.5);
    assert_eq!((sent, robot.state.jumps), (None, 1));
    robot.go(2500);
    assert_eq!(robot.end_reason(), Some(EndReason::Travelled));
}

#[test]
fn paths_outside_the_limits_are_refused_with_the_place() {
    let refused = |change: fn(&mut MotionLimits)| {
        let mut limits = limits();
        change(&mut limits);
        CheckedPath::new(&s_path(1.0), 1.0, &limits).unwrap_err()
    };
    assert!(
        matches!(refused(|l| l.box_m[1].x = 1.15), PathError::OutsideBox { at_s, .. } if (5.0..6.0).contains(&at_s))
    );
    assert!(matches!(refused(|l| l.cone_rad = 0.15), PathError::OutsideCone { .. }));
    assert!(matches!(refused(|l| l.speed_m_s = 0.05), PathError::TooMuch { what: "the speed", .. }));
    assert!(matches!(
        refused(|l| l.acceleration_m_s2 = 0.1),
        PathError::TooMuch { what: "the acceleration", .. }
    ));
    assert!(matches!(refused(|l| l.jerk_m_s3 = 0.2), PathError::TooMuch { what: "the jerk", .. }));
    assert!(matches!(refused(|l| l.turn_rad_s = 0.2), PathError::TooMuch { what: "the angular speed", .. }));
    assert!(matches!(refused(|l| l.turn_acceleration_rad_s2 = 0.3), PathError::TooMuch { .. }));
    assert!(matches!(refused(|l| l.acceleration_m_s2 = 0.14), PathError::NoRoomToStop { .. }));
    let twice_as_fast = CheckedPath::new(&s_path(0.4), 1.0, &limits());
    assert!(matches!(twice_as_fast, Err(PathError::TooMuch { .. })));
    assert!(CheckedPath::new(&s_path(0.4), 0.4, &limits()).is_ok(), "at less than its own pace it will do");
}

#[derive(Clone, Debug)]
enum Received {
    Good,
    Nothing,
    Anywhere([f64; 3], [f64; 3]),
    Drift([f64; 3]),
    States(u8, u8, u8, bool, f64),
    DeviceClock(i64),
    Restart,
}

fn received() -> impl Strategy<Value = Received> {
    prop_oneof![
        40 => Just(Received::Good),
        2 => Just(Received::Nothing),
        1 => (prop::array::uniform3(-3.0..3.0), prop::array::uniform3(-3.0..3.0)).prop_map(|(p, r)| Received::Anywhere(p, r)),
        3 => prop::array::uniform3(-0.002..0.002).prop_map(Received::Drift),
        1 => (0_u8..3, 0_u8..4, 0_u8..3, any::<bool>(), 0.0..200.0).prop_map(|(a, b, c, d, e)| Received::States(a, b, c, d, e)),
        1 => any::<i64>().prop_map(Received::DeviceClock),
        1 => Just(Received::Restart),
    ]
}

fn command() -> impl Strategy<Value = OperatorCommand> {
    prop_oneof![300 => Just(OperatorCommand::Go), 2 => Just(OperatorCommand::Stop), 1 => Just(OperatorCommand::Silence)]
}

fn told(robot: Pose, k: i64, received: &Received) -> Option<RobotFrame> {
    let mut frame = frame(k, robot);
    match received {
        Received::Good | Received::Restart => {}
        Received::Nothing => return None,
        Received::Anywhere(position, turn) => {
            frame.base_from_tool = Pose::new(Vector3::from(*position), Vector3::from(*turn));
        }
        Received::Drift(by) => frame.base_from_tool.translation.vector += Vector3::from(*by),
        Received::States(motors, mci, rapid, collided, utilization) => {
            frame.motors = [MotorState::Undefined, MotorState::On, MotorState::Off][*motors as usize];
            frame.mci =
                [MciState::Undefined, MciState::Error, MciState::Stopped, MciState::Running][*mci as usize];
            frame.rapid = [RapidState::Undefined, RapidState::Stopped, RapidState::Running][*rapid as usize];
            frame.collided = *collided;
            frame.utilization_percent = Some(*utilization);
        }
        Received::DeviceClock(ns) => frame.device_ns = *ns,
    }
    Some(frame)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Every command is in box and cone and under every speed. It is rest, or the path. For the path, the way since rest is
    /// within full speed for the elapsed time here, whatever the controller's clock says, and the velocity changes within
    /// the acceleration. Whenever the motion has ended or is interrupted, the last word was rest.
    #[test]
    fn no_sequence_of_events_makes_the_gate_leave_the_limits(
        events in prop::collection::vec((received(), command(), 0.2..8.0_f64, 0_u32..60), 1..120),
        start in prop::array::uniform3(-0.02..0.02),
        clock in prop_oneof![3 => Just(1.0), 2 => 0.2..4.0_f64],
    ) {
        let gate = gate();
        let l = limits();
        let mut robot = gate.path().at(0.0).base_from_tool;
        robot.translation.vector += Vector3::from(start);
        robot.rotation *= UnitQuaternion::from_scaled_axis(Vector3::new(start[1], start[2], start[0]));
        let (mut state, mut now_ns, mut k) = (GateState::default(), 0_i64, 0_i64);
        let mut last: Option<Reference> = None;
        // Time and way since the motion last began from rest.
        let (mut began_ns, mut way_m, mut speed_m_s) = (0, 0.0, Vector3::zeros());
        for (received, command, periods, repeats) in events {
            for repeat in 0..=repeats {
                let (received, periods) = if repeat == 0 { (received.clone(), periods) } else { (Received::Good, 1.0) };
                now_ns += (periods * PERIOD_S * 1e9) as i64;
                k += periods.round().max(1.0) as i64;
                let mut frame = told(robot, k, &received);
                if let (Some(frame), false) = (&mut frame, matches!(received, Received::DeviceClock(_))) {
                    frame.device_ns = (frame.device_ns as f64 * clock) as i64;
                }
                let is_first = k == 1 || matches!(received, Received::Restart);
                let received = frame.map(|frame| ReceivedFrame { frame, arrival_ns: now_ns, is_first });
                let (next, sent) = gate.step(state, &Input { received, now_ns, command });
                state = next;
                let moves = matches!(state.phase, Phase::Travelling { .. } | Phase::Stopping { .. });
                if let Some(sent) = sent {
                    let Reference { base_from_tool, velocity_m_s, angular_velocity_rad_s } = sent;
                    prop_assert!(l.in_box(&base_from_tool.translation.vector, 0.0), "{base_from_tool}");
                    prop_assert!(l.cone_angle_rad(&base_from_tool) <= l.cone_rad);
                    prop_assert!(velocity_m_s.norm() <= l.speed_m_s && angular_velocity_rad_s.norm() <= l.turn_rad_s);
                    if sent.is_rest() {
                        (began_ns, way_m, speed_m_s) = (now_ns, 0.0, Vector3::zeros());
                    } else if let Some(before) = last {
                        prop_assert!(moves);
                        let period_s = state.period_s().unwrap();
                        let step_m = (base_from_tool.translation.vector - before.base_from_tool.translation.vector).norm();
                        way_m += step_m;
                        // One period may be ahead, and up to three that came late are made up for.
                        let may_s = (now_ns - began_ns) as f64 * 1e-9 + 4.0 * period_s;
                        prop_assert!(way_m <= l.speed_m_s * may_s + 1e-9, "{way_m} m in {may_s} s");
                        let change = (velocity_m_s - speed_m_s).norm();
                        let step_s = (periods * PERIOD_S).min(3.0 * period_s) + 4.0 * period_s;
                        prop_assert!(change <= l.acceleration_m_s2 * step_s + 1e-5, "{change} m/s at once");
                        speed_m_s = velocity_m_s;
                    }
                    last = Some(sent);
                    robot = base_from_tool;
                }
                if matches!(state.phase, Phase::Holding { .. } | Phase::Silent { .. } | Phase::Interrupted { .. }) {
                    prop_assert!(last.is_none_or(|last| last.is_rest()), "the last word was a movement: {:?}", state.phase);
                }
            }
        }
    }
}

#[test]
fn rest_is_said_even_where_the_robot_itself_is_outside() {
    // The robot sags out of the cone, or of the box, or collides there: rest at its own pose may not be sent.
    let faults: [fn(&mut RobotFrame); 3] = [
        |f| {
            f.base_from_tool.rotation *= so3::exp(&Vector3::new(0.7, 0.0, 0.0));
            f.collided = true;
        },
        |f| f.base_from_tool.translation.vector.z = 0.39,
        |f| {
            f.base_from_tool.translation.vector.z = 0.39;
            f.mci = MciState::Stopped;
        },
    ];
    for fault in faults {
        let mut robot = Follower::new();
        robot.go(500);
        // Believed: the jump is spread over frames that come late.
        for _ in 0..4 {
            robot.k += 4;
            robot.tick(OperatorCommand::Go, fault);
        }
        for _ in 0..20 {
            robot.tick(OperatorCommand::Go, fault);
        }
        assert!(robot.last_is_rest(), "{:?}", robot.state.phase);
        for (_, sent) in &robot.sent {
            assert!(limits().contain(&sent.base_from_tool));
        }
    }
}

#[test]
fn attitudes_count_as_places_do() {
    let turned = |angle: f64| so3::exp(&Vector3::new(0.0, angle, 0.0));
    let mut robot = Follower::new();
    robot.robot.rotation *= turned(0.06);
    robot.go(100);
    assert!(
        matches!(robot.end_reason(), Some(EndReason::StartTooFar { angle_rad, .. }) if (angle_rad - 0.06).abs() < 1e-9)
    );

    let mut robot = Follower::new();
    robot.go(500);
    let mut lag = 0.0;
    while robot.end_reason().is_none() && lag < 0.3 {
        // 0.3°, believable, frame by frame.
        lag += 0.005;
        let reference = robot.robot;
        let mut frame = frame(robot.k, reference);
        frame.base_from_tool.rotation *= turned(lag);
        let input = robot.input(Some(frame), OperatorCommand::Go);
        if robot.end_reason().is_none() {
            robot.robot = input.unwrap().base_from_tool;
        }
    }
    assert!(matches!(robot.end_reason(), Some(EndReason::Deviation { .. })), "{:?}", robot.end_reason());
    assert!((0.19..0.22).contains(&lag), "{lag}");

    let mut robot = Follower::new();
    robot.go(500);
    let sent = robot
        .tick(OperatorCommand::Go, |f| f.base_from_tool.rotation *= so3::exp(&Vector3::new(0.1, 0.0, 0.0)));
    assert_eq!((sent, robot.state.jumps), (None, 1), "0.1 rad in 4 ms");
}

#[test]
fn sparse_paths_are_checked_between_their_poses() {
    // The tool axis turns along a small circle: at both poses it leans 0.5 rad, half way more or less than that.
    let pose = |turn: f64, t_ms: i64| {
        let down = so3::exp(&Vector3::new(std::f64::consts::PI, 0.0, 0.0));
        let leaning = so3::exp(&Vector3::new(0.0, 0.0, turn)) * so3::exp(&Vector3::new(0.5, 0.0, 0.0)) * down;
        RobotSample {
            stamp_ns: t_ms * 1_000_000,
            device_ns: None,
            base_from_tool: Pose::from_parts(Vector3::new(1.0, 0.0, 0.6).into(), leaning),
        }
    };
    let sparse: Vec<RobotSample> = (0..6).map(|k| pose(0.3 * f64::from(k), 1000 * i64::from(k))).collect();
    let dense: Vec<RobotSample> = (0..=500).map(|k| pose(0.003 * f64::from(k), 10 * i64::from(k))).collect();
    let within = |cone_rad: f64| MotionLimits { cone_rad, ..limits() };
    assert!(CheckedPath::new(&dense, 1.0, &within(0.56)).is_ok());
    let refused = CheckedPath::new(&sparse, 1.0, &within(0.56));
    assert!(matches!(refused, Err(PathError::OutsideCone { .. })), "{refused:?}");
    // An accepted path is inside everywhere, checked at ten thousand points.
    let accepted = CheckedPath::new(&sparse, 1.0, &within(0.75)).unwrap();
    for k in 0..10_000 {
        let at = accepted.at(accepted.duration_s() * f64::from(k) / 1e4).base_from_tool;
        assert!(within(0.75).contain(&at));
    }
    let mut twisted = s_path(1.0);
    twisted[300].base_from_tool.rotation *= so3::exp(&Vector3::new(0.0, 0.0, 1.0));
    assert!(matches!(CheckedPath::new(&twisted, 1.0, &limits()), Err(PathError::Attitude { .. })));
}

#[test]
fn the_robots_rhythm_is_learnt_whatever_it_is() {
    for every in [1_i64, 2, 4] {
        let mut robot = Follower::new();
        for _ in 0..4000 {
            let mut frame = frame(robot.k, robot.robot);
            frame.sequence = (robot.k / every) as u32;
            robot.input(Some(frame), OperatorCommand::Go);
            robot.k += every - 1;
            if robot.end_reason().is_some() {
                break;
            }
        }
        let period_s = robot.state.period_s().unwrap();
        assert!((period_s - every as f64 * PERIOD_S).abs() < 1e-4, "{period_s} s");
        assert_eq!(
            (robot.end_reason(), robot.state.pauses),
            (Some(EndReason::Travelled), 0),
            "every {every}"
        );
    }
}

#[test]
fn a_robot_that_speaks_too_rarely_is_not_guided() {
    // 24 ms and 190 ms between frames.
    for every in [6_i64, 47] {
        let mut robot = Follower::new();
        for k in 0..100 {
            let mut frame = frame(robot.k, robot.robot);
            frame.sequence = k;
            robot.input(Some(frame), OperatorCommand::Go);
            robot.k += every - 1;
        }
        assert!(matches!(robot.end_reason(), Some(EndReason::TooSlow { .. })), "{:?}", robot.end_reason());
        assert!(robot.sent.iter().all(|(_, sent)| sent.is_rest()));
    }
}

#[test]
fn another_session_ends_the_ride() {
    let mut robot = Follower::new();
    robot.go(500);
    let received =
        ReceivedFrame { frame: frame(0, robot.robot), arrival_ns: robot.k * PERIOD_NS, is_first: true };
    let input = Input { received: Some(received), now_ns: received.arrival_ns, command: OperatorCommand::Go };
    let (state, sent) = robot.gate.step(robot.state, &input);
    assert!(matches!(state.phase, Phase::Holding { why: EndReason::Restarted, .. }));
    assert!(sent.unwrap().is_rest());
}

#[test]
fn an_old_frame_is_not_acted_upon() {
    let mut robot = Follower::new();
    robot.go(500);
    let frame = frame(robot.k, robot.robot);
    let received = ReceivedFrame { frame, arrival_ns: robot.k * PERIOD_NS, is_first: false };
    let late =
        Input { received: Some(received), now_ns: (robot.k + 8) * PERIOD_NS, command: OperatorCommand::Go };
    let (state, sent) = robot.gate.step(robot.state, &late);
    assert!(matches!(state.phase, Phase::Interrupted { .. }) && sent.unwrap().is_rest(), "{:?}", state.phase);
}
