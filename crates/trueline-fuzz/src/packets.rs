//! Datagrams and streams of robots and cameras.

use std::net::{Ipv4Addr, SocketAddr};
use telegenic::emulator::{DeviceConfig, GigeDevice};
use telegenic::gige::proto::bootstrap::DeviceInfo;
use telegenic::gige::proto::gvcp::{Ack, Cmd};
use telegenic::gige::proto::gvsp::{GvspView, ImageLeader};
use trueline_camera::genicam::{ChunkNames, ChunkOrder, chunks};
use trueline_camera::{PixelFormat, gray_image};
use trueline_dataset::{Channel, Pixels};
use trueline_live::egm::{EgmRobot, EgmSensor, Message};
use trueline_live::fanuc::{Hspo, stream_motion_packets};
use trueline_live::kuka::{InputElement, rob_message};
use trueline_live::robot_source::RobotPose;
use trueline_live::udp_source::DatagramProtocol;
use trueline_live::ur::session::{Session, Told};
use trueline_live::{RobotFrame, SequenceStatus};

pub(crate) fn egm(bytes: &[u8]) {
    match EgmRobot::read(bytes) {
        Ok(message) => {
            drop(format!("{message:?}"));
            if let Ok(frame) = RobotFrame::of(&message) {
                assert!(frame.base_from_tool.translation.vector.iter().all(|x| x.is_finite()), "no pose");
            }
            // A decoded message is encoded and decoded again.
            let bytes = message.encode_to_vec();
            assert_eq!(EgmRobot::read(&bytes).map(|again| again.encode_to_vec()), Ok(bytes));
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
    if let Ok(message) = EgmSensor::decode(bytes) {
        drop(format!("{message:?}"));
    }
}

fn is_pose(pose: &RobotPose) {
    let pose = pose.base_from_tool;
    assert!(pose.translation.vector.iter().all(|x| x.is_finite()), "a pose that is no pose");
    assert!((pose.rotation.norm() - 1.0).abs() < 1e-9, "a rotation that is none");
}

pub(crate) fn hspo(bytes: &[u8]) {
    let mut protocol = Hspo::default();
    // A packet has 48 bytes: several in a row put the clock through its wraps.
    for packet in bytes.chunks(48) {
        match protocol.decode(packet) {
            Ok((_, raw)) => {
                for status in [SequenceStatus::Newest { skipped: 0 }, SequenceStatus::Late] {
                    is_pose(&protocol.place(raw, status).0);
                }
            }
            Err(rejection) => assert!(!rejection.to_string().is_empty()),
        }
    }
}

/// A stream: the first byte states the size of its pieces. Its content must not depend on that.
pub(crate) fn rtde(bytes: &[u8]) {
    let Some((&piece, stream)) = bytes.split_first() else { return };
    let told = |piece: usize| {
        let (mut session, mut send) = Session::begin();
        let mut told = Vec::new();
        for piece in stream.chunks(piece) {
            let each = |_: &[u8], what: Told| {
                if let Told::Pose(Ok(pose)) = &what {
                    is_pose(pose);
                }
                told.push(format!("{what:?}"));
            };
            if let Err(error) = session.take(piece, &mut send, each) {
                told.push(error.to_string());
                break;
            }
        }
        assert!(send.len() < 4096 + 8 * stream.len(), "answers without end");
        told
    };
    assert_eq!(told(usize::from(piece) + 1), told(stream.len().max(1)));
}

/// Commands to our simulated camera, and answers of cameras to us.
pub(crate) fn gvcp(bytes: &[u8]) {
    let from = SocketAddr::from(([127, 0, 0, 1], 50_000));
    let mut device = GigeDevice::new(Ipv4Addr::LOCALHOST, &DeviceConfig::default());
    // Length-prefixed: a command may lean on one before.
    let mut rest = bytes;
    while let Some((&length, after)) = rest.split_first() {
        let (datagram, after) = after.split_at(usize::from(length).min(after.len()));
        let command = Cmd::parse(datagram);
        if let Some(ack) = Ack::parse(datagram) {
            drop((
                ack.pending_ack_timeout_ms(),
                ack.register_values().count(),
                DeviceInfo::parse(ack.payload),
            ));
        }
        if command.is_some() {
            drop(device.handle_datagram(datagram, from));
        }
        rest = after;
    }
}

/// A packet of a picture: the claims of its leader, and the bytes that follow as pixels.
pub(crate) fn gvsp(bytes: &[u8]) {
    let Some(packet) = GvspView::parse(bytes) else { return };
    let Some(leader) = ImageLeader::parse(packet.data) else { return };
    let pixels = packet.data.get(36..).unwrap_or_default();
    for format in PixelFormat::pictures() {
        let size = [leader.width, leader.height];
        if let Some(image) = gray_image(pixels, size, format, usize::from(leader.x_padding), Channel::Gray) {
            let count = match image.pixels {
                Pixels::Eight(levels) => levels.len(),
                Pixels::Sixteen(levels) => levels.len(),
            };
            assert_eq!(count, image.width * image.height);
            // The smallest packed level has 10 bits.
            assert!(count <= pixels.len(), "pixels that did not come");
        }
    }
}

/// A frame and the description of its camera with its chunks; the last two bytes state its length.
pub(crate) fn gige_chunks(bytes: &[u8]) {
    let Some((bytes, &length)) = bytes.split_last_chunk::<2>() else { return };
    let length = usize::from(u16::from_be_bytes(length)).min(bytes.len());
    let (frame, description) = bytes.split_at(bytes.len() - length);
    let names = ChunkNames::of(&String::from_utf8_lossy(description));
    match chunks(frame, ChunkOrder::BigEndian) {
        Ok(found) => {
            let taken: usize = found.iter().map(|chunk| chunk.data.len() + 8).sum();
            assert_eq!(taken, frame.len(), "bytes that belong to no chunk");
            for name in ["ChunkTimestamp", "ChunkExposureTime"] {
                let (number, whole) = (names.number(name, &found), names.whole(name, &found));
                assert!(number.is_none_or(f64::is_finite), "a number that is none");
                // A whole number is the same number.
                assert!(
                    whole.is_none_or(|whole| number == Some(whole as f64)),
                    "{whole:?} is not {number:?}"
                );
            }
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}

pub(crate) fn stream_motion(bytes: &[u8]) {
    if let Err(error) = stream_motion_packets::status(bytes) {
        assert!(!error.to_string().is_empty());
    }
}

pub(crate) fn rsi(bytes: &[u8]) {
    if let Ok(message) = rob_message::read(bytes, &InputElement::default()) {
        assert!(message.pose.translation.vector.iter().all(|x| x.is_finite()), "a pose that is no pose");
    }
}
