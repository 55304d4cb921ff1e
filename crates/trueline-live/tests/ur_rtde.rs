//! RTDE: the PC's side against the simulated controller, and against bytes and habits of others.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use nalgebra::Vector3;
use std::net::{Ipv4Addr, SocketAddr, TcpListener};
use std::ops::ControlFlow;
use std::thread;
use std::time::{Duration, Instant};
use trueline_geometry::{Pose, Trajectory, so3};
use trueline_live::HostClock;
use trueline_live::SequenceStatus;
use trueline_live::frame_filter::PacketError;
use trueline_live::pose_feed::PoseFeed;
use trueline_live::robot_source::{PoseMeaning, RobotPose, RobotSource, RobotStatus, SourceError};
use trueline_live::ur::controller::{Connection, Moment};
use trueline_live::ur::session::{Session, SessionError, Told};
use trueline_live::ur::wire::{DATA, OUTPUTS, START, TEXT, VERSION, first, package};
use trueline_live::ur::{RtdeServer, RtdeSource, ServerSettings};

fn moment(stamp_s: f64) -> Moment {
    let pose =
        Pose::from_parts(Vector3::new(0.3654, -0.2, 0.5).into(), so3::exp(&Vector3::new(0.0, 3.1, 0.05)));
    Moment { stamp_s, base_from_tool: pose, robot_mode: 7, inputs: 0x8005 }
}

/// Carries bytes to and fro until nobody has anything to say; `at_once` bytes at a time.
fn agree(session: &mut Session, first: Vec<u8>, controller: &mut Connection, at_once: usize) -> Vec<Told> {
    let (mut to_robot, mut told) = (first, Vec::new());
    while !to_robot.is_empty() {
        let (mut to_pc, mut next) = (Vec::new(), Vec::new());
        for bytes in to_robot.chunks(at_once) {
            controller.take(bytes, &mut to_pc).unwrap();
        }
        for bytes in to_pc.chunks(at_once) {
            session.take(bytes, &mut next, |_, what| told.push(what)).unwrap();
        }
        to_robot = next;
    }
    told
}

fn poses(session: &mut Session, bytes: &[u8]) -> Vec<Result<RobotPose, PacketError>> {
    let (mut found, mut send) = (Vec::new(), Vec::new());
    session
        .take(bytes, &mut send, |_, told| {
            if let Told::Pose(pose) = told {
                found.push(pose);
            }
        })
        .unwrap();
    assert!(send.is_empty(), "a listener says nothing while it listens");
    found
}

#[test]
fn both_versions_agree_and_the_pose_comes_out_as_it_went_in_however_bytes_are_cut() {
    for (version, at_once) in [(2, usize::MAX), (2, 1), (2, 7), (1, usize::MAX), (1, 1)] {
        let (mut session, first) = Session::begin();
        let mut controller = Connection::new(version);
        let told = agree(&mut session, first, &mut controller, at_once);
        assert!(session.is_streaming() && session.version() == version);
        assert_eq!(told, [Told::Controller([5, 11, 0, 108])]);
        // Three packages in one piece, then one byte by byte.
        let glued: Vec<u8> =
            (0..3).flat_map(|k| controller.data(k, &moment(100.0 + 0.002 * k as f64)).unwrap()).collect();
        let mut found = poses(&mut session, &glued);
        for byte in controller.data(3, &moment(100.006)).unwrap() {
            found.extend(poses(&mut session, &[byte]));
        }
        assert_eq!(found.len(), 4);
        for (k, pose) in found.into_iter().enumerate() {
            let pose = pose.unwrap();
            assert_eq!(pose.device_ns, 100_000_000_000 + 2_000_000 * k as i64);
            let truth = moment(0.0).base_from_tool;
            assert!((pose.base_from_tool.translation.vector - truth.translation.vector).norm() < 1e-12);
            assert!(pose.base_from_tool.rotation.angle_to(&truth.rotation) < 1e-12);
            assert_eq!((pose.status, pose.inputs), (RobotStatus::Ready, Some(0x8005)));
        }
    }
}

/// Bytes as the maker's own client and controllers exchange them.
#[test]
fn the_bytes_are_those_of_the_guide() {
    let (mut session, hello) = Session::begin();
    assert_eq!(hello, [0, 5, b'V', 0, 2]);
    let mut send = Vec::new();
    session.take(&[0, 4, b'V', 1], &mut send, |_, _| {}).unwrap();
    assert_eq!(send, [0, 3, b'v']);
    send.clear();
    let software = [0, 0, 0, 5, 0, 0, 0, 11, 0, 0, 0, 0, 0, 0, 0, 108];
    session.take(&package(b'v', &software), &mut send, |_, _| {}).unwrap();
    // 500 Hz as a double, then the names.
    assert_eq!(send[2..11], [b'O', 0x40, 0x7f, 0x40, 0, 0, 0, 0, 0]);
    assert!(send[11..].starts_with(b"timestamp,actual_TCP_pose,"));
}

/// A controller of an old software: one field it does not have, none of the others.
#[test]
fn a_field_that_is_not_known_is_left_out_unless_it_is_the_pose() {
    let (mut session, _) = Session::begin();
    let (mut send, mut told) = (Vec::new(), Vec::new());
    let mut say = |session: &mut Session, bytes: &[u8]| {
        send.clear();
        session.take(bytes, &mut send, |_, what| told.push(what)).map(|()| send.clone())
    };
    say(&mut session, &package(VERSION, &[1])).unwrap();
    let asked = say(&mut session, &package(b'v', &[0; 16])).unwrap();
    let names = String::from_utf8_lossy(first(&asked).unwrap().unwrap().payload[8..].into()).into_owned();
    let types: Vec<&str> = names
        .split(',')
        .map(|name| {
            if name == "tcp_offset" {
                "NOT_FOUND"
            } else {
                trueline_live::ur::variables::output(name).unwrap().name()
            }
        })
        .collect();
    let mut payload = vec![0];
    payload.extend(types.join(",").as_bytes());
    let again = say(&mut session, &package(OUTPUTS, &payload)).unwrap();
    let again = String::from_utf8_lossy(&again[11..]).into_owned();
    assert!(!again.contains("tcp_offset") && again.starts_with("timestamp,actual_TCP_pose,actual_q"));
    let mut session_2 = session.clone();
    let known: Vec<&str> = types.into_iter().filter(|kind| *kind != "NOT_FOUND").collect();
    let mut payload = vec![3];
    payload.extend(known.join(",").as_bytes());
    assert_eq!(say(&mut session, &package(OUTPUTS, &payload)).unwrap(), package(START, &[]));
    assert!(say(&mut session, &package(START, &[1])).is_ok() && session.is_streaming());
    // A test server of the maker's repeats the names.
    let mut payload = vec![1];
    payload.extend(again.as_bytes());
    assert_eq!(say(&mut session_2, &package(OUTPUTS, &payload)).unwrap(), package(START, &[]));
    let refused = say(&mut session_2, &package(START, &[0]));
    assert_eq!(refused, Err(SessionError::NotStarted));

    let (mut session, _) = Session::begin();
    session.take(&package(VERSION, &[1]), &mut Vec::new(), |_, _| {}).unwrap();
    session.take(&package(b'v', &[0; 16]), &mut Vec::new(), |_, _| {}).unwrap();
    let none =
        [&[0][..], "DOUBLE,NOT_FOUND,VECTOR6D,VECTOR6D,INT32,INT32,UINT32,DOUBLE,UINT64".as_bytes()].concat();
    let refused = session.take(&package(OUTPUTS, &none), &mut Vec::new(), |_, _| {});
    assert_eq!(refused, Err(SessionError::NotFound { name: "actual_TCP_pose" }));
}

#[test]
fn words_odd_lengths_and_senseless_figures_are_told_and_survived() {
    let (mut session, hello) = Session::begin();
    let mut controller = Connection::new(2);
    agree(&mut session, hello, &mut controller, usize::MAX);
    let mut told = Vec::new();
    let mut words = vec![5];
    words.extend(b"hello");
    words.extend([2, b'm', b'e', 1]);
    session.take(&package(TEXT, &words), &mut Vec::new(), |_, what| told.push(what)).unwrap();
    assert_eq!(told, [Told::Text(1, "hello".to_owned())]);
    let good = controller.data(0, &moment(1.0)).unwrap();
    let mut nan = good.clone();
    nan[12..20].copy_from_slice(&f64::NAN.to_be_bytes());
    assert_eq!(poses(&mut session, &nan), [Err(PacketError::NotFinite)]);
    let short = package(DATA, &good[3..good.len() - 1]);
    assert!(matches!(poses(&mut session, &short)[..], [Err(PacketError::Length { .. })]));
    assert!(poses(&mut session, &good)[0].is_ok());
    for size in [0_u16, 1, 2] {
        let [high, low] = size.to_be_bytes();
        let mut broken = session.clone();
        let result = broken.take(&[high, low, DATA], &mut Vec::new(), |_, _| {});
        assert!(matches!(result, Err(SessionError::Size(_))), "{size}");
    }
}

fn feed() -> PoseFeed {
    let at =
        |x: f64| Pose::from_parts(Vector3::new(x, 0.0, 0.5).into(), so3::exp(&Vector3::new(3.0, 0.1, 0.0)));
    PoseFeed::new(Trajectory::new(vec![0.0, 10.0], &[at(0.5), at(1.0)]).unwrap(), 0.0)
}

/// Over sockets, a quarter of a second: connects, is cut off, connects again by itself.
#[test]
fn a_source_connects_hears_and_comes_back_after_it_was_cut_off() {
    let settings = ServerSettings { feed: feed(), epoch_s: 100.0, drift_ppm: 0.0, version: 2 };
    let any = SocketAddr::from((Ipv4Addr::LOCALHOST, 0));
    let mut server = RtdeServer::bind(any, settings.clone()).unwrap();
    let address = server.local_address().unwrap();
    let mut source = RtdeSource::new(address, HostClock::start());
    let mut heard = Vec::new();
    for session in 0..2 {
        if session == 1 {
            server = RtdeServer::bind(address, settings.clone()).unwrap();
        }
        let mut running = server;
        let robot = thread::spawn(move || {
            running
                .run(|_, passed| match passed > Duration::from_millis(1200) {
                    true => ControlFlow::Break(()),
                    false => ControlFlow::Continue(()),
                })
                .unwrap();
        });
        let before = heard.len();
        let patience = Instant::now();
        while heard.len() < before + 40 && patience.elapsed() < Duration::from_secs(20) {
            // Whatever error the connection reports, the next call connects again.
            let _ =
                source.receive(Duration::from_millis(20), &mut |packet| heard.push(packet.judged.unwrap()));
        }
        robot.join().unwrap();
        let closed = (0..100).find_map(|_| source.receive(Duration::from_millis(20), &mut |_| {}).err());
        assert!(matches!(closed, Some(SourceError::Closed { .. } | SourceError::Io { .. })), "{closed:?}");
        server = RtdeServer::bind(any, settings.clone()).unwrap();
    }
    let firsts = heard.iter().filter(|(_, status)| *status == SequenceStatus::First).count();
    assert_eq!(firsts, 2);
    for (pose, _) in &heard {
        // 50 mm/s from 0.5 m on, stamped by the controller's clock.
        let along_m = 0.5 + 0.05 * (pose.device_ns as f64 * 1e-9 - 100.0);
        assert!((pose.base_from_tool.translation.x - along_m).abs() < 1e-9);
    }
    assert_eq!(source.about().pose, PoseMeaning::TcpInBase);
    assert_eq!(source.about().controller.unwrap(), "URControl 5.11.0.108");
}

#[test]
fn what_is_not_there_or_is_no_robot_is_an_error() {
    let nobody = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap().local_addr().unwrap();
    let mut source = RtdeSource::new(nobody, HostClock::start());
    assert!(matches!(source.receive(Duration::ZERO, &mut |_| {}), Err(SourceError::Io { .. })));
}
