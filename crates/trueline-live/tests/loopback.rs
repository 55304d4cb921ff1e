//! Endpoint and simulated controller over real sockets of this machine.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use std::net::{SocketAddr, UdpSocket};
use std::ops::ControlFlow;
use std::thread;
use std::time::{Duration, Instant};
use trueline_geometry::Pose;
use trueline_live::controller::{Controller, ControllerSettings, Network, NetworkSettings, RealTime, Task};
use trueline_live::egm::{EgmClock, EgmFeedBack, EgmHeader, EgmPose, EgmRobot, Message, MessageType};
use trueline_live::{Endpoint, HostClock, LinkWatch, SequenceStatus};

fn endpoint() -> (Endpoint, SocketAddr) {
    let endpoint = Endpoint::bind("127.0.0.1:0".parse().unwrap(), None, HostClock::start()).unwrap();
    let address = endpoint.local_address().unwrap();
    (endpoint, address)
}

fn frame(sequence: u32) -> Vec<u8> {
    EgmRobot {
        header: Some(EgmHeader::new(sequence, 0, MessageType::Data)),
        feed_back: Some(EgmFeedBack {
            cartesian: Some(EgmPose::full(&Pose::identity())),
            time: Some(EgmClock { sec: Some(7), usec: Some(u64::from(sequence) * 4000) }),
            ..EgmFeedBack::default()
        }),
        ..EgmRobot::default()
    }
    .encode_to_vec()
}

#[test]
fn all_that_waits_is_heard_and_the_newest_is_answered() {
    let (mut endpoint, pc) = endpoint();
    let robot = UdpSocket::bind("127.0.0.1:0").unwrap();
    for k in [0, 1, 2, 4, 3] {
        robot.send_to(&frame(k), pc).unwrap();
    }
    robot.send_to(b"junk", pc).unwrap();
    let before = endpoint.clock().read().steady_ns;
    let mut received = Vec::new();
    let newest = endpoint
        .receive(Duration::from_secs(1), |h| {
            // The kernel's stamp is from before the reading, and this machine has one.
            assert!(h.datagram.arrival.kernel_wall_ns.is_some() || !cfg!(target_os = "linux"));
            assert!(h.datagram.arrival.steady_ns <= h.datagram.arrival.read.steady_ns);
            received.push(h.judged.map(|(frame, status)| (frame.sequence, status)));
        })
        .unwrap()
        .unwrap();
    assert_eq!(received.len(), 6);
    assert_eq!(received[0], Ok((0, SequenceStatus::First)));
    assert_eq!(received[3], Ok((4, SequenceStatus::Newest { skipped: 1 })));
    assert_eq!(received[4], Ok((3, SequenceStatus::Late)));
    assert!(received[5].is_err());
    assert_eq!((newest.frame.sequence, newest.from), (4, robot.local_addr().unwrap()));
    assert!(newest.arrival.steady_ns <= before, "stamped when it came, not when it was read");
    endpoint.send(newest.from, b"answer").unwrap();
    let mut buffer = [0; 16];
    robot.set_read_timeout(Some(Duration::from_secs(1))).unwrap();
    assert_eq!(robot.recv(&mut buffer).unwrap(), 6);
    assert!(endpoint.receive(Duration::from_millis(1), |_| ()).unwrap().is_none());
}

#[test]
fn a_datagram_longer_than_any_is_refused_as_such() {
    let (mut endpoint, pc) = endpoint();
    let robot = UdpSocket::bind("127.0.0.1:0").unwrap();
    let mut long = frame(0);
    long.extend([0x9a, 0x06, 0xd0, 0x0f]);
    long.resize(long.len() + 2000, 0);
    robot.send_to(&long, pc).unwrap();
    robot.send_to(&[], pc).unwrap();
    let mut reasons = Vec::new();
    endpoint.receive(Duration::from_secs(1), |h| reasons.push(h.judged.unwrap_err().to_string())).unwrap();
    endpoint.receive(Duration::from_millis(50), |h| reasons.push(h.judged.unwrap_err().to_string())).unwrap();
    assert_eq!(reasons, ["longer than any EGM message", "empty"]);
}

#[test]
fn a_simulated_controller_is_heard_as_what_it_is() {
    let (mut endpoint, pc) = endpoint();
    let settings = ControllerSettings::new(Task::Guidance { start: Pose::translation(0.8, 0.1, 0.6) });
    let controller = Controller::new(settings);
    let robot = thread::spawn(move || {
        let mut robot = RealTime::bind(
            controller,
            Network::new(NetworkSettings { loss: 0.05, ..NetworkSettings::typical() }, 3),
            Network::new(NetworkSettings::none(), 4),
            "127.0.0.1:0".parse().unwrap(),
            pc,
        )
        .unwrap();
        robot
            .run(|cycle| {
                if cycle.passed > Duration::from_millis(1500) {
                    ControlFlow::Break(())
                } else {
                    ControlFlow::Continue(())
                }
            })
            .unwrap();
        (robot.counts().sent, robot.lost())
    });
    let mut watch = LinkWatch::default();
    let start = Instant::now();
    while start.elapsed() < Duration::from_millis(1800) {
        endpoint.receive(Duration::from_millis(20), |received| watch.note(received)).unwrap();
    }
    let (sent, lost) = robot.join().unwrap();
    let report = watch.report();
    assert_eq!(report.stream.frames, sent, "what was sent arrived");
    // Losses after the last frame that came are not seen.
    assert!(
        lost > 0 && report.stream.lost <= lost && report.stream.lost + 3 >= lost,
        "{} of {lost}",
        report.stream.lost
    );
    let timing = report.stream.timing.unwrap();
    assert!((timing.period_s - 0.004_032).abs() < 2e-6);
    assert_eq!(report.stream.sessions, 1);
    let (from, frame) = report.robot.unwrap();
    assert_eq!(report.talkers[&from].accepted, sent);
    assert!((frame.base_from_tool.translation.vector.x - 0.8).abs() < 1e-3);
}
