//! Every way a datagram can be wrong is counted with its reason, and changes nothing.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use std::net::SocketAddr;
use trueline_geometry::Pose;
use trueline_live::egm::{
    EgmClock, EgmFeedBack, EgmHeader, EgmPose, EgmQuaternion, EgmRobot, Message, MessageType,
};
use trueline_live::{FrameFilter, Rejection, SequenceStatus};

const MS: i64 = 1_000_000;

fn robot() -> SocketAddr {
    "192.0.2.1:50000".parse().unwrap()
}

fn message(sequence: u32) -> EgmRobot {
    EgmRobot {
        header: Some(EgmHeader::new(sequence, sequence.wrapping_mul(4), MessageType::Data)),
        feed_back: Some(EgmFeedBack {
            cartesian: Some(EgmPose::full(&Pose::translation(0.5, 0.1, 0.7))),
            time: Some(EgmClock { sec: Some(10), usec: Some(4000 * u64::from(sequence % 250)) }),
            ..EgmFeedBack::default()
        }),
        ..EgmRobot::default()
    }
}

/// A filter that has received frames 0 to 99 at 4 ms.
fn listening() -> FrameFilter {
    let mut frame_filter = FrameFilter::new(None);
    for k in 0..100 {
        frame_filter.judge(&message(k).encode_to_vec(), robot(), 4 * MS * i64::from(k) + 1000 * MS).unwrap();
    }
    frame_filter
}

const NOW: i64 = 1400 * MS;

fn refused(bytes: &[u8], from: SocketAddr) -> String {
    let mut frame_filter = listening();
    let reason = frame_filter.judge(bytes, from, NOW).unwrap_err().to_string();
    assert_eq!(frame_filter.rejected().get(&reason), Some(&1));
    assert_eq!((frame_filter.accepted(), frame_filter.robot()), (100, Some(robot())));
    // The robot is received as before.
    let next = frame_filter.judge(&message(100).encode_to_vec(), robot(), NOW + MS).unwrap();
    assert_eq!(next.1, SequenceStatus::Newest { skipped: 0 });
    reason
}

#[test]
fn junk() {
    assert!(refused(&[0xff, 0xff, 0xff], robot()).contains("not an EGM message"));
    assert!(refused(b"GET / HTTP/1.1\r\n\r\n", robot()).contains("not an EGM message"));
    assert_eq!(refused(&[], robot()), "empty");
}

#[test]
fn truncated() {
    let whole = message(100).encode_to_vec();
    for length in 1..whole.len() {
        refused(&whole[..length], robot());
    }
}

#[test]
fn oversized() {
    let mut bytes = message(100).encode_to_vec();
    // Field 99, a text of 2000 bytes: a good message but for its length.
    bytes.extend([0x9a, 0x06, 0xd0, 0x0f]);
    bytes.resize(bytes.len() + 2000, 0);
    assert_eq!(refused(&bytes, robot()), "longer than any EGM message");
}

#[test]
fn nan_poses() {
    for place in 0..3 {
        for bad in [f64::NAN, f64::INFINITY] {
            let mut message = message(100);
            let pose = message.feed_back.as_mut().unwrap().cartesian.as_mut().unwrap();
            let position = pose.pos.as_mut().unwrap();
            *[&mut position.x, &mut position.y, &mut position.z][place] = Some(bad);
            assert!(refused(&message.encode_to_vec(), robot()).contains("not finite"));
        }
    }
}

#[test]
fn zero_quaternions() {
    for wxyz in [[0.0; 4], [0.5, 0.0, 0.0, 0.0], [f64::NAN, 0.0, 0.0, 1.0]] {
        let mut message = message(100);
        let [u0, u1, u2, u3] = wxyz.map(Some);
        let orient = Some(EgmQuaternion { u0, u1, u2, u3 });
        message.feed_back.as_mut().unwrap().cartesian.as_mut().unwrap().orient = orient;
        refused(&message.encode_to_vec(), robot());
    }
}

#[test]
fn stale_and_repeated_sequence_numbers() {
    assert_eq!(refused(&message(99).encode_to_vec(), robot()), "a repetition");
    assert_eq!(refused(&message(80).encode_to_vec(), robot()), "a repetition");
    assert_eq!(refused(&message(20).encode_to_vec(), robot()), "a stale sequence number");
    assert_eq!(refused(&message(0).encode_to_vec(), robot()), "a stale sequence number");
}

#[test]
fn a_rogue_sender() {
    let port = "192.0.2.1:50001".parse().unwrap();
    let machine = "192.0.2.9:50000".parse().unwrap();
    for rogue in [port, machine] {
        assert_eq!(refused(&message(100).encode_to_vec(), rogue), "from another sender");
    }
    let mut allowed = FrameFilter::new(Some("192.0.2.7".parse().unwrap()));
    assert_eq!(allowed.judge(&message(0).encode_to_vec(), robot(), 0), Err(Rejection::OtherSender));
    assert_eq!(allowed.robot(), None);
}

#[test]
fn overtaken_frames_are_kept_but_not_the_newest() {
    let mut frame_filter = listening();
    let mut receive =
        |k: u32| frame_filter.judge(&message(k).encode_to_vec(), robot(), NOW).map(|(_, status)| status);
    assert_eq!(receive(103), Ok(SequenceStatus::Newest { skipped: 3 }));
    assert_eq!(receive(101), Ok(SequenceStatus::Late));
    assert_eq!(receive(101), Err(Rejection::Repeated));
    assert_eq!(receive(100), Ok(SequenceStatus::Late));
    assert_eq!(receive(104), Ok(SequenceStatus::Newest { skipped: 0 }));
}

#[test]
fn a_restart_is_a_new_session_after_a_silence_only() {
    let mut frame_filter = listening();
    let port = "192.0.2.1:50777".parse().unwrap();
    let at = |silence_ms: i64| 1396 * MS + silence_ms * MS;
    assert_eq!(frame_filter.judge(&message(0).encode_to_vec(), robot(), at(50)), Err(Rejection::Stale));
    assert_eq!(frame_filter.judge(&message(0).encode_to_vec(), port, at(60)), Err(Rejection::OtherSender));
    let (_, status) = frame_filter.judge(&message(0).encode_to_vec(), port, at(110)).unwrap();
    assert_eq!((status, frame_filter.robot()), (SequenceStatus::First, Some(port)));
    let (_, status) = frame_filter.judge(&message(1).encode_to_vec(), port, at(114)).unwrap();
    assert_eq!(status, SequenceStatus::Newest { skipped: 0 });
    // The old port is a stranger now, and a strange machine stays one.
    assert_eq!(
        frame_filter.judge(&message(2).encode_to_vec(), robot(), at(118)),
        Err(Rejection::OtherSender)
    );
    let machine = "192.0.2.9:50000".parse().unwrap();
    assert_eq!(
        frame_filter.judge(&message(0).encode_to_vec(), machine, at(900)),
        Err(Rejection::OtherSender)
    );
}

#[test]
fn one_number_far_ahead_does_not_make_the_robot_stale() {
    assert_eq!(refused(&message(1_000_000).encode_to_vec(), robot()), "a sequence number far ahead");
    let mut frame_filter = listening();
    let (_, status) =
        frame_filter.judge(&message(1_000_000).encode_to_vec(), robot(), NOW + 500 * MS).unwrap();
    assert_eq!(status, SequenceStatus::Newest { skipped: 999_900 }, "after a silence it may be");
}

#[test]
fn a_robot_that_speaks_rarely_is_not_replayed() {
    let mut frame_filter = FrameFilter::new(None);
    for k in 0..20 {
        frame_filter.judge(&message(k).encode_to_vec(), robot(), 120 * MS * i64::from(k)).unwrap();
    }
    let now = 120 * MS * 19;
    assert_eq!(
        frame_filter.judge(&message(3).encode_to_vec(), robot(), now + 119 * MS),
        Err(Rejection::Repeated)
    );
    assert_eq!(
        frame_filter.judge(&message(20).encode_to_vec(), robot(), now + 120 * MS).unwrap().1,
        SequenceStatus::Newest { skipped: 0 }
    );
    // A second later it may have begun anew.
    assert_eq!(
        frame_filter.judge(&message(0).encode_to_vec(), robot(), now + 1120 * MS).unwrap().1,
        SequenceStatus::First
    );
}

#[test]
fn parts_of_another_form_beside_the_pose_do_not_cost_the_frame() {
    let mut bytes = message(100).encode_to_vec();
    // Field 10, utilizationRate, as a varint; field 14 as one; both are other things in no known RobotWare.
    bytes.extend([0x50, 0x07, 0x70, 0x01]);
    let read = EgmRobot::read(&bytes).unwrap();
    assert_eq!((read.utilization_rate, read.torque_ref), (None, None));
    let mut frame_filter = listening();
    assert!(frame_filter.judge(&bytes, robot(), NOW).is_ok());
}

/// An arm of another kind.
#[test]
fn more_joints_than_six_do_not_cost_the_frame() {
    let mut bytes = message(100).encode_to_vec();
    // feedBack, joints: seven numbers, each a field; then the same number in one packed list.
    let each = [0x09, 0, 0, 0, 0, 0, 0, 0, 0].repeat(7);
    let packed = [&[0x0a, 56][..], &[0; 56]].concat();
    for joints in [each, packed] {
        let length = joints.len() as u8;
        bytes.extend([0x12, length + 2, 0x0a, length].iter().chain(&joints));
        let read = EgmRobot::read(&bytes).unwrap();
        assert!(read.feed_back.unwrap().joints.unwrap().as_slice().is_empty());
        assert!(listening().judge(&bytes, robot(), NOW).is_ok());
    }
}

#[test]
fn sequence_numbers_may_wrap() {
    let mut frame_filter = FrameFilter::new(None);
    let mut receive =
        |k: u32, ms: i64| frame_filter.judge(&message(k).encode_to_vec(), robot(), ms * MS).map(|(_, s)| s);
    assert_eq!(receive(u32::MAX - 1, 0), Ok(SequenceStatus::First));
    assert_eq!(receive(u32::MAX, 4), Ok(SequenceStatus::Newest { skipped: 0 }));
    assert_eq!(receive(0, 8), Ok(SequenceStatus::Newest { skipped: 0 }));
    assert_eq!(receive(2, 12), Ok(SequenceStatus::Newest { skipped: 1 }));
    assert_eq!(receive(u32::MAX, 13), Err(Rejection::Repeated));
    assert_eq!(receive(1, 14), Ok(SequenceStatus::Late));
}
