//! The codec against bytes that other people's encoders made (`interop/golden.py`), and against junk.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use proptest::prelude::*;
use serde_json::Value;
use std::fs;
use std::path::Path;
use trueline_geometry::Pose;
use trueline_live::egm::{Generation, MessageKind, RobotMessage, RobotState, SensorMessage};
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

fn check_state(expect: &Value, what: &str, state: Option<&RobotState>, file: &str) {
    let key = |name: &str| &expect[format!("{what}_{name}")];
    let list = |values: Option<&[f64]>| values.map(<[f64]>::to_vec);
    let pose = state.and_then(|s| s.cartesian);
    assert_eq!(
        numbers(key("position_mm")),
        list(pose.as_ref().and_then(|p| p.position_mm.as_ref().map(|v| v.as_slice()))),
        "{file}"
    );
    assert_eq!(
        numbers(key("quaternion_wxyz")),
        list(pose.as_ref().and_then(|p| p.quaternion_wxyz.as_ref().map(|v| v.as_slice()))),
        "{file}"
    );
    assert_eq!(
        numbers(key("euler_zyx_deg")),
        list(pose.as_ref().and_then(|p| p.euler_xyz_deg.as_ref().map(|v| v.as_slice()))),
        "{file}"
    );
    assert_eq!(
        numbers(key("joints_deg")),
        list(state.and_then(|s| s.joints_deg.as_ref()).map(|a| a.as_slice())),
        "{file}"
    );
    assert_eq!(
        numbers(key("external_joints_deg")),
        list(state.and_then(|s| s.external_joints.as_ref()).map(|a| a.as_slice())),
        "{file}"
    );
    assert_eq!(key("time_s").as_u64(), state.and_then(|s| s.time_s_us).map(|t| t.0), "{file}");
    assert_eq!(key("time_us").as_u64(), state.and_then(|s| s.time_s_us).map(|t| t.1), "{file}");
    assert_eq!(key("timestamp_sec").as_u64(), state.and_then(|s| s.ptp_s_ns).map(|t| t.0), "{file}");
    assert_eq!(key("timestamp_nsec").as_u64(), state.and_then(|s| s.ptp_s_ns).map(|t| t.1), "{file}");
}

#[test]
fn robots_are_read_as_they_were_written() {
    for case in cases().iter().filter(|case| case.message == "EgmRobot") {
        let Case { file, expect, .. } = case;
        let read = RobotMessage::decode(&case.bytes);
        assert_eq!(read.is_ok(), case.valid, "{file}: {read:?}");
        let Ok(message) = read else { continue };
        let header = message.header.unwrap();
        assert_eq!(expect["seqno"].as_u64(), header.sequence.map(u64::from), "{file}");
        assert_eq!(expect["tm_ms"].as_u64(), header.sent_ms.map(u64::from), "{file}");
        check_state(expect, "feedback", message.feedback.as_ref(), file);
        check_state(expect, "planned", message.planned.as_ref(), file);
        assert_eq!(expect["motor_state"].as_u64(), message.motors.map(|s| s as u64), "{file}");
        assert_eq!(expect["mci_state"].as_u64(), message.mci.map(|s| s as u64), "{file}");
        assert_eq!(expect["rapid_state"].as_u64(), message.rapid.map(|s| s as u64), "{file}");
        assert_eq!(expect["convergence_met"].as_bool(), message.converged, "{file}");
        assert_eq!(expect["utilization_percent"].as_f64(), message.utilization_percent, "{file}");
        assert_eq!(expect["move_index"].as_u64(), message.move_index.map(u64::from), "{file}");
        assert_eq!(expect["force_active"].as_bool(), message.force.and_then(|f| f.active), "{file}");
        assert_eq!(
            numbers(&expect["force_n_nm"]),
            message.force.map(|f| f.force.as_slice().to_vec()),
            "{file}"
        );
        assert_eq!(
            expect["collision_triggered"].as_bool(),
            message.collision.and_then(|c| c.triggered),
            "{file}"
        );
        assert_eq!(
            numbers(&expect["collision_quota"]),
            message.collision.map(|c| c.quota.as_slice().to_vec()),
            "{file}"
        );
        assert_eq!(expect["rapid_digital"].as_bool(), message.rapid_data.and_then(|d| d.digital), "{file}");
        assert_eq!(
            numbers(&expect["rapid_numbers"]),
            message.rapid_data.map(|d| d.numbers.as_slice().to_vec()),
            "{file}"
        );
        assert_eq!(
            numbers(&expect["torque_ref"]),
            message.torque_reference.map(|t| t.as_slice().to_vec()),
            "{file}"
        );
        assert_eq!(RobotMessage::decode(&message.encode()).unwrap(), message, "{file}");
    }
}

#[test]
fn answers_are_read_as_they_were_written() {
    for case in cases().iter().filter(|case| case.message == "EgmSensor") {
        let Case { file, expect, bytes, .. } = case;
        let message = SensorMessage::decode(bytes).unwrap();
        let header = message.header.unwrap();
        assert_eq!(expect["seqno"].as_u64(), header.sequence.map(u64::from), "{file}");
        assert_eq!(expect["tm_ms"].as_u64(), header.sent_ms.map(u64::from), "{file}");
        let planned =
            RobotState { cartesian: message.pose, joints_deg: message.joints_deg, ..RobotState::default() };
        let pose_alone: Value =
            ["planned_position_mm", "planned_quaternion_wxyz", "planned_euler_zyx_deg", "planned_joints_deg"]
                .into_iter()
                .map(|key| (key.to_owned(), expect[key].clone()))
                .collect();
        check_state(&pose_alone, "planned", Some(&planned), file);
        assert_eq!(
            numbers(&expect["speed_cartesian"]),
            message.speed.map(|s| s.as_slice().to_vec()),
            "{file}"
        );
        assert_eq!(
            numbers(&expect["speed_joints_deg_s"]),
            message.joint_speed_deg_s.map(|s| s.as_slice().to_vec()),
            "{file}"
        );
        assert_eq!(SensorMessage::decode(&message.encode()).unwrap(), message, "{file}");
        // Wire-compatible with EgmRobot: only the message type tells them apart.
        if let Ok(as_robot) = RobotMessage::decode(bytes) {
            assert_eq!(RobotFrame::of(&as_robot), Err(FrameError::NotData), "{file}");
        }
    }
}

#[test]
fn our_answers_have_the_bytes_of_other_peoples() {
    let wanted = cases().into_iter().find(|case| case.file == "ABBRobotEGM-sensor-pose-speed.bin").unwrap();
    let message = SensorMessage::decode(&wanted.bytes).unwrap();
    assert_eq!(message.encode(), wanted.bytes);
}

#[test]
fn generations_are_told_by_what_is_filled() {
    let of = |name: &str| {
        let case =
            cases().into_iter().find(|case| case.file == format!("ABBRobotEGM-robot-{name}.bin")).unwrap();
        Generation::of(&RobotMessage::decode(&case.bytes).unwrap())
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
        let frame = RobotFrame::of(&RobotMessage::decode(&case.bytes).unwrap()).unwrap();
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
        RobotFrame::of(&RobotMessage::decode(&case.bytes).unwrap())
    };
    assert_eq!(of("minimal"), Err(FrameError::NoFeedback));
    assert_eq!(of("pose-only"), Err(FrameError::OldRobotWare));
}

/// What leaves for the robot, number by number: mm, mm/s and degrees/s, the attitude as w, x, y, z, no Euler angles.
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
    let sent = SensorMessage::decode(&guide::message(77, 5_000_000_000, &reference).encode()).unwrap();
    let header = sent.header.unwrap();
    assert_eq!((header.sequence, header.kind), (Some(77), Some(MessageKind::Correction)));
    let near = |found: &[f64], expected: &[f64]| {
        assert_eq!(found.len(), expected.len());
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-12, "{found} is not {expected}");
        }
    };
    let sent_pose = sent.pose.unwrap();
    near(&sent_pose.position_mm.unwrap(), &[100.0, -200.0, 300.0]);
    let norm = 0.79_f64.sqrt();
    near(&sent_pose.quaternion_wxyz.unwrap(), &[0.5 / norm, -0.1 / norm, 0.7 / norm, 0.2 / norm]);
    assert_eq!(sent_pose.euler_xyz_deg, None);
    let degrees = 180.0 / std::f64::consts::PI;
    near(sent.speed.unwrap().as_slice(), &[10.0, -20.0, 30.0, 0.4 * degrees, -0.5 * degrees, 0.6 * degrees]);
}

proptest! {
    #[test]
    fn junk_is_refused_or_read_but_never_breaks_anything(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        if let Ok(message) = RobotMessage::decode(&bytes) {
            let _ = RobotFrame::of(&message);
            // NaN is not equal to itself; compare what is written.
            prop_assert_eq!(RobotMessage::decode(&message.encode()).unwrap().encode(), message.encode());
        }
        let _ = SensorMessage::decode(&bytes);
    }

    #[test]
    fn damaged_messages_never_break_anything(case in 0_usize..45, cut in 0_usize..700, flips in prop::collection::vec((0_usize..700, 0_u8..8), 0..6)) {
        let mut bytes = cases().swap_remove(case).bytes;
        bytes.truncate(cut.max(1));
        for (place, bit) in flips {
            let place = place % bytes.len();
            bytes[place] ^= 1 << bit;
        }
        if let Ok(message) = RobotMessage::decode(&bytes)
            && let Ok(frame) = RobotFrame::of(&message)
        {
            prop_assert!(frame.base_from_tool.translation.vector.iter().all(|v| v.is_finite()));
            prop_assert!((frame.base_from_tool.rotation.norm() - 1.0).abs() < 1e-12);
        }
        let _ = SensorMessage::decode(&bytes);
    }
}
