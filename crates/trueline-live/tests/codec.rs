//! The codec against bytes that other people's encoders made (`interop/golden.py`), and against junk.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use proptest::prelude::*;
use serde_json::Value;
use std::fs;
use std::path::Path;
use trueline_geometry::Pose;
use trueline_live::egm::numbers::Numbers;
use trueline_live::egm::{
    EgmCartesian, EgmEuler, EgmFeedBack, EgmQuaternion, EgmRobot, EgmSensor, Generation, Message,
    MessageType, PoseError,
};
use trueline_live::motion::Reference;
use trueline_live::robot_frame::FrameError;
use trueline_live::{RobotFrame, guide};

struct Case {
    file: String,
    bytes: Vec<u8>,
    message: String,
    valid: bool,
    expect: Value,
    derived: Value,
}

fn cases() -> Vec<Case> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden");
    let mut cases = Vec::new();
    for package in ["ABBRobotEGM", "abb-robot-client"] {
        let text = fs::read_to_string(folder.join(format!("{package}.json"))).unwrap();
        let listed: Value = serde_json::from_str(&text).unwrap();
        for case in listed["cases"].as_array().unwrap() {
            let file = case["file"].as_str().unwrap().to_owned();
            cases.push(Case {
                bytes: fs::read(folder.join(&file)).unwrap(),
                message: case["message"].as_str().unwrap().to_owned(),
                valid: case["valid"].as_bool().unwrap(),
                expect: case.get("expect").cloned().unwrap_or_default(),
                derived: case.get("derived").cloned().unwrap_or_default(),
                file,
            });
        }
    }
    assert_eq!(cases.len(), 45);
    cases
}

fn numbers(value: &Value) -> Option<Vec<f64>> {
    value.as_array().map(|list| list.iter().map(|v| v.as_f64().unwrap()).collect())
}

fn slice<const N: usize, const ALONE: u32>(list: Option<Numbers<N, ALONE>>) -> Option<Vec<f64>> {
    list.map(|list| list.as_slice().to_vec())
}

/// Coordinates, if all are there.
fn whole<const N: usize>(coordinates: [Option<f64>; N]) -> Option<Vec<f64>> {
    coordinates.into_iter().collect()
}

fn position(at: EgmCartesian) -> Option<Vec<f64>> {
    whole([at.x, at.y, at.z])
}

fn quaternion(q: EgmQuaternion) -> Option<Vec<f64>> {
    whole([q.u0, q.u1, q.u2, q.u3])
}

/// Of what is there, nothing is missing.
fn is_whole(state: &EgmFeedBack) -> bool {
    let pose = state.cartesian.unwrap_or_default();
    pose.pos.is_none_or(|at| position(at).is_some()) && pose.orient.is_none_or(|q| quaternion(q).is_some())
}

fn check_state(expect: &Value, what: &str, state: Option<EgmFeedBack>, file: &str) {
    let key = |name: &str| &expect[format!("{what}_{name}")];
    let state = state.unwrap_or_default();
    let pose = state.cartesian.unwrap_or_default();
    assert_eq!(numbers(key("position_mm")), pose.pos.and_then(position), "{file}");
    assert_eq!(numbers(key("quaternion_wxyz")), pose.orient.and_then(quaternion), "{file}");
    let euler = pose.euler.and_then(|EgmEuler { x, y, z }| whole([x, y, z]));
    assert_eq!(numbers(key("euler_zyx_deg")), euler, "{file}");
    assert_eq!(numbers(key("joints_deg")), slice(state.joints), "{file}");
    assert_eq!(numbers(key("external_joints_deg")), slice(state.external_joints), "{file}");
    assert_eq!(key("time_s").as_u64(), state.time.and_then(|t| t.sec), "{file}");
    assert_eq!(key("time_us").as_u64(), state.time.and_then(|t| t.usec), "{file}");
    assert_eq!(key("timestamp_sec").as_u64(), state.time_stamp.and_then(|t| t.sec), "{file}");
    assert_eq!(key("timestamp_nsec").as_u64(), state.time_stamp.and_then(|t| t.nsec), "{file}");
}

#[test]
fn robots_are_read_as_they_were_written() {
    for case in cases().iter().filter(|case| case.message == "EgmRobot") {
        let Case { file, expect, .. } = case;
        let message = EgmRobot::read(&case.bytes).unwrap();
        let feedback = message.feed_back.unwrap_or_default();
        assert_eq!(is_whole(&feedback), case.valid, "{file}");
        if !case.valid {
            let refused = RobotFrame::of(&message).unwrap_err();
            assert_eq!(refused, FrameError::Pose(PoseError::Missing), "{file}");
            continue;
        }
        let header = message.header.unwrap();
        assert_eq!(expect["seqno"].as_u64(), header.seqno.map(u64::from), "{file}");
        assert_eq!(expect["tm_ms"].as_u64(), header.tm.map(u64::from), "{file}");
        check_state(expect, "feedback", message.feed_back, file);
        check_state(expect, "planned", message.planned, file);
        let motors = message.motor_state.and_then(|of| of.state);
        assert_eq!(expect["motor_state"].as_i64(), motors.map(i64::from), "{file}");
        let mci = message.mci_state.and_then(|of| of.state);
        assert_eq!(expect["mci_state"].as_i64(), mci.map(i64::from), "{file}");
        let rapid = message.rapid_exec_state.and_then(|of| of.state);
        assert_eq!(expect["rapid_state"].as_i64(), rapid.map(i64::from), "{file}");
        assert_eq!(expect["convergence_met"].as_bool(), message.mci_convergence_met, "{file}");
        assert_eq!(expect["utilization_percent"].as_f64(), message.utilization_rate, "{file}");
        assert_eq!(expect["move_index"].as_u64(), message.move_index.map(u64::from), "{file}");
        assert_eq!(expect["force_active"].as_bool(), message.measured_force.and_then(|f| f.flag), "{file}");
        assert_eq!(numbers(&expect["force_n_nm"]), slice(message.measured_force), "{file}");
        let triggered = message.collision_info.and_then(|of| of.flag);
        assert_eq!(expect["collision_triggered"].as_bool(), triggered, "{file}");
        assert_eq!(numbers(&expect["collision_quota"]), slice(message.collision_info), "{file}");
        assert_eq!(expect["rapid_digital"].as_bool(), message.rapid_data.and_then(|d| d.flag), "{file}");
        assert_eq!(numbers(&expect["rapid_numbers"]), slice(message.rapid_data), "{file}");
        assert_eq!(numbers(&expect["torque_ref"]), slice(message.torque_ref), "{file}");
        assert_eq!(EgmRobot::read(&message.encode_to_vec()).unwrap(), message, "{file}");
    }
}

#[test]
fn answers_are_read_as_they_were_written() {
    for case in cases().iter().filter(|case| case.message == "EgmSensor") {
        let Case { file, expect, bytes, .. } = case;
        let message = EgmSensor::decode(bytes.as_slice()).unwrap();
        let header = message.header.unwrap();
        assert_eq!(expect["seqno"].as_u64(), header.seqno.map(u64::from), "{file}");
        assert_eq!(expect["tm_ms"].as_u64(), header.tm.map(u64::from), "{file}");
        check_state(expect, "planned", message.planned, file);
        let speed = message.speed_ref.unwrap_or_default();
        assert_eq!(numbers(&expect["speed_cartesian"]), slice(speed.cartesians), "{file}");
        assert_eq!(numbers(&expect["speed_joints_deg_s"]), slice(speed.joints), "{file}");
        let external = &expect["speed_external_joints_deg_s"];
        assert_eq!(numbers(external), slice(speed.external_joints), "{file}");
        assert_eq!(EgmSensor::decode(message.encode_to_vec().as_slice()).unwrap(), message, "{file}");
        // Wire-compatible with EgmRobot: only the message type tells them apart.
        if let Ok(as_robot) = EgmRobot::read(bytes) {
            assert_eq!(RobotFrame::of(&as_robot), Err(FrameError::NotData), "{file}");
        }
    }
}

#[test]
fn our_answers_have_the_bytes_of_other_peoples() {
    let wanted = cases().into_iter().find(|case| case.file == "ABBRobotEGM-sensor-pose-speed.bin").unwrap();
    let message = EgmSensor::decode(wanted.bytes.as_slice()).unwrap();
    assert_eq!(message.encode_to_vec(), wanted.bytes);
}

#[test]
fn generations_are_told_by_what_is_filled() {
    let of = |name: &str| {
        let case =
            cases().into_iter().find(|case| case.file == format!("ABBRobotEGM-robot-{name}.bin")).unwrap();
        Generation::of(&EgmRobot::read(&case.bytes).unwrap())
    };
    assert_eq!(of("rw607"), Generation::From6_07);
    assert_eq!(of("rw610"), Generation::From6_10);
    assert_eq!(of("rw610-force"), Generation::From6_10);
    assert_eq!(of("rw77"), Generation::From7);
    assert_eq!(of("rw77-force-off"), Generation::From7);
    assert_eq!(of("rw716"), Generation::From7_16);
    assert_eq!(of("pose-only"), Generation::Before6_07);
}

/// Euler angles count where both are there; alone either will do. The quaternions are those of Python, with Rz·Ry·Rx.
#[test]
fn attitudes_follow_the_protocol() {
    for name in ["rw607", "euler-only", "orientations-disagree"] {
        let case =
            cases().into_iter().find(|c| c.file == format!("abb-robot-client-robot-{name}.bin")).unwrap();
        let frame = RobotFrame::of(&EgmRobot::read(&case.bytes).unwrap()).unwrap();
        let expected = numbers(&case.derived["feedback_quaternion_from_euler_wxyz"]).unwrap();
        let q = frame.base_from_tool.rotation.quaternion();
        let dot = q.w * expected[0] + q.i * expected[1] + q.j * expected[2] + q.k * expected[3];
        assert!((dot.abs() - 1.0).abs() < 1e-14, "{name}: {dot}");
        assert_eq!(frame.attitudes_differ, name == "orientations-disagree");
        let position = numbers(&case.expect["feedback_position_mm"]).unwrap();
        for (axis, mm) in position.into_iter().enumerate() {
            assert!((frame.base_from_tool.translation.vector[axis] - mm * 1e-3).abs() < 1e-15);
        }
    }
}

#[test]
fn what_lacks_something_is_no_frame() {
    let of = |name: &str| {
        let case = cases().into_iter().find(|c| c.file == format!("ABBRobotEGM-robot-{name}.bin")).unwrap();
        RobotFrame::of(&EgmRobot::read(&case.bytes).unwrap())
    };
    assert_eq!(of("minimal"), Err(FrameError::NoFeedback));
    assert_eq!(of("pose-only"), Err(FrameError::OldRobotWare));
}

/// The numbers sent to the robot: mm, mm/s and degrees/s, the attitude as w, x, y, z, no Euler angles.
#[test]
fn a_reference_is_sent_in_the_units_and_order_of_egm() {
    let pose = Pose::from_parts(
        Vector3::new(0.1, -0.2, 0.3).into(),
        UnitQuaternion::new_normalize(Quaternion::new(0.5, -0.1, 0.7, 0.2)),
    );
    let reference = Reference {
        base_from_tool: pose,
        velocity_m_s: Vector3::new(0.01, -0.02, 0.03),
        angular_velocity_rad_s: Vector3::new(0.4, -0.5, 0.6),
    };
    let bytes = guide::message(77, 5_000_000_000, &reference).encode_to_vec();
    let sent = EgmSensor::decode(bytes.as_slice()).unwrap();
    let header = sent.header.unwrap();
    assert_eq!((header.seqno, header.mtype()), (Some(77), MessageType::Correction));
    let near = |found: &[f64], expected: &[f64]| {
        assert_eq!(found.len(), expected.len());
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-12, "{found} is not {expected}");
        }
    };
    let sent_pose = sent.planned.unwrap().cartesian.unwrap();
    near(&position(sent_pose.pos.unwrap()).unwrap(), &[100.0, -200.0, 300.0]);
    let norm = 0.79_f64.sqrt();
    near(&quaternion(sent_pose.orient.unwrap()).unwrap(), &[0.5 / norm, -0.1 / norm, 0.7 / norm, 0.2 / norm]);
    assert_eq!(sent_pose.euler, None);
    let degrees = 180.0 / std::f64::consts::PI;
    let speed = sent.speed_ref.unwrap().cartesians.unwrap();
    near(speed.as_slice(), &[10.0, -20.0, 30.0, 0.4 * degrees, -0.5 * degrees, 0.6 * degrees]);
}

proptest! {
    #[test]
    fn junk_is_refused_or_read_but_never_breaks_anything(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        if let Ok(message) = EgmRobot::read(&bytes) {
            let _ = RobotFrame::of(&message);
            // NaN is not equal to itself; compare what is written.
            let again = EgmRobot::read(&message.encode_to_vec()).unwrap();
            prop_assert_eq!(again.encode_to_vec(), message.encode_to_vec());
        }
        let _ = EgmSensor::decode(bytes.as_slice());
    }

    #[test]
    fn damaged_messages_never_break_anything(case in 0_usize..45, cut in 0_usize..700, flips in prop::collection::vec((0_usize..700, 0_u8..8), 0..6)) {
        let mut bytes = cases().swap_remove(case).bytes;
        bytes.truncate(cut.max(1));
        for (place, bit) in flips {
            let place = place % bytes.len();
            bytes[place] ^= 1 << bit;
        }
        if let Ok(message) = EgmRobot::read(&bytes)
            && let Ok(frame) = RobotFrame::of(&message)
        {
            prop_assert!(frame.base_from_tool.translation.vector.iter().all(|v| v.is_finite()));
            prop_assert!((frame.base_from_tool.rotation.norm() - 1.0).abs() < 1e-12);
        }
        let _ = EgmSensor::decode(bytes.as_slice());
    }
}
