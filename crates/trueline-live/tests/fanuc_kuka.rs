//! FANUC's HSPO and Stream Motion, KUKA's RSI: what their packets say, and what is not believed.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use nalgebra::Vector3;
use proptest::prelude::*;
use std::net::SocketAddr;
use trueline_geometry::{Pose, so3};
use trueline_live::fanuc::stream_motion_packets::{STOP, head, status, word, words};
use trueline_live::fanuc::stream_motion_sim::StreamMotionController;
use trueline_live::fanuc::{Hspo, Signal, StreamMotion, hspo_sim};
use trueline_live::frame_filter::PacketError;
use trueline_live::kuka::rob_message::{Inputs, RobMessage};
use trueline_live::kuka::{InputElement, Rsi, rob_message, rsi_sim};
use trueline_live::robot_source::{PoseMeaning, RobotPose, RobotStatus};
use trueline_live::udp_source::DatagramProtocol;
use trueline_live::{FrameFilter, Rejection, SequenceStatus};

fn robot() -> SocketAddr {
    "192.168.1.20:40001".parse().unwrap()
}

/// Three angles of different size, so that none can be confused with another.
fn pose() -> Pose {
    let turn = so3::exp(&Vector3::new(0.1, 0.2, 0.3)) * so3::exp(&Vector3::new(3.0, 0.0, 0.0));
    Pose::from_parts(Vector3::new(0.50025, -0.123, 0.4).into(), turn)
}

fn near(found: &Pose, wanted: &Pose, tolerance: f64) {
    assert!((found.translation.vector - wanted.translation.vector).norm() < tolerance);
    assert!(found.rotation.angle_to(&wanted.rotation) < tolerance);
}

fn read(bytes: &[u8]) -> Result<RobMessage, PacketError> {
    rob_message::read(bytes, &InputElement::default())
}

type Judged = Result<(RobotPose, SequenceStatus), Rejection>;

fn judge<P: DatagramProtocol>(protocol: &mut P, filter: &mut FrameFilter, bytes: &[u8], ms: i64) -> Judged {
    let judged = filter.judge_as(bytes, robot(), ms * 1_000_000, |bytes| protocol.decode(bytes));
    protocol.notice(bytes, ms * 1_000_000);
    judged.map(|(raw, status)| protocol.place(raw, status))
}

#[test]
fn hspo_poses_come_with_a_clock_that_goes_on_where_the_counter_wraps() {
    let (mut hspo, mut filter) = (Hspo::default(), FrameFilter::new(None));
    let mut stamps = Vec::new();
    for k in 0..200_u32 {
        // R-30iB's counter wraps at about 129 s.
        let clock_us = (128_600_000 + 8000 * k) % 129_000_000;
        let [tool, joints] = hspo_sim::packets(k + 1, clock_us, &pose(), k % 3);
        assert_eq!((tool.len(), joints.len()), (48, 60));
        if k % 50 == 49 {
            continue;
        }
        let (found, status) = judge(&mut hspo, &mut filter, &tool, 8 * i64::from(k)).unwrap();
        // Single precision: 500 mm to 0.03 µm, 180° to 1e-5°.
        near(&found.base_from_tool, &pose(), 1e-6);
        assert_eq!(found.inputs, Some((k % 3).into()));
        stamps.push((k, found.device_ns));
        let lost = k > 0 && k % 50 == 0;
        assert_eq!(status == SequenceStatus::Newest { skipped: 1 }, lost, "{k}");
        let not_needed = judge(&mut hspo, &mut filter, &joints, 8 * i64::from(k));
        assert!(matches!(not_needed, Err(Rejection::Packet(PacketError::NotNeeded(_)))));
    }
    for (k, stamp_ns) in &stamps {
        assert_eq!(stamp_ns - stamps[0].1, 8_000_000 * i64::from(*k));
    }
}

/// A packet by hand: 100, 200, 300 mm and 90° about z alone, in the third of the angles.
#[test]
fn an_hspo_packet_is_read_as_it_is_laid_out() {
    let mut bytes = words(&[1, 7, 16_000]);
    bytes.extend([0, 1, 0, 1]);
    for figure in [100.0_f32, 200.0, 300.0, 0.0, 0.0, 90.0] {
        bytes.extend(figure.to_be_bytes());
    }
    bytes.extend([0; 8]);
    let (found, _) = judge(&mut Hspo::default(), &mut FrameFilter::new(None), &bytes, 0).unwrap();
    near(
        &found.base_from_tool,
        &Pose::from_parts(
            Vector3::new(0.1, 0.2, 0.3).into(),
            so3::exp(&(Vector3::z() * std::f64::consts::FRAC_PI_2)),
        ),
        1e-7,
    );
    assert_eq!((found.sequence, found.device_ns), (7, 16_000_000));
    bytes[16..20].copy_from_slice(&f32::NAN.to_be_bytes());
    let refused = judge(&mut Hspo::default(), &mut FrameFilter::new(None), &bytes, 0);
    assert_eq!(refused, Err(PacketError::NotFinite.into()));
    for length in [0, 11, 13, 47, 49] {
        bytes.resize(length, 0);
        assert!(judge(&mut Hspo::default(), &mut FrameFilter::new(None), &bytes, 0).is_err());
    }
}

/// Carries the conversation of a listener and a controller for some virtual time.
fn stream(version: u32, for_ms: i64) -> (StreamMotion, StreamMotionController, Vec<Judged>, Vec<Vec<u8>>) {
    stream_of(StreamMotion::default(), version, for_ms)
}

fn stream_of(
    mut pc: StreamMotion,
    version: u32,
    for_ms: i64,
) -> (StreamMotion, StreamMotionController, Vec<Judged>, Vec<Vec<u8>>) {
    let mut filter = FrameFilter::new(Some(robot().ip()));
    let mut controller = StreamMotionController::new(version, 8);
    let me = "192.168.1.10:5000".parse().unwrap();
    let (mut heard, mut said) = (Vec::new(), Vec::new());
    for ms in (0..for_ms).step_by(8) {
        for packet in pc.ask(ms * 1_000_000) {
            if let Some(answer) = controller.receive(&packet, me) {
                let _ = judge(&mut pc, &mut filter, &answer, ms);
            }
            said.push(packet);
        }
        if let Some((to, bytes)) = controller.status(ms as u32, &pose(), ms % 16 == 8) {
            assert_eq!(to, me);
            heard.push(judge(&mut pc, &mut filter, &bytes, ms));
        }
    }
    (pc, controller, heard, said)
}

#[test]
fn stream_motion_is_listened_to_in_all_four_versions_and_no_command_is_ever_sent() {
    for version in 1..=4 {
        let (pc, controller, heard, said) = stream(version, 4000);
        // Versions 1 and 2 are asked for only when the question of versions 3 and 4 was not answered for a second.
        let expected = if version >= 3 { 498 } else { 372 };
        assert!(heard.len() >= expected, "{version}: {}", heard.len());
        for (k, judged) in heard.iter().enumerate() {
            let (found, status) = judged.unwrap();
            near(&found.base_from_tool, &pose(), 1e-6);
            assert_eq!(found.status, RobotStatus::Ready);
            assert_eq!(status == SequenceStatus::First, k == 0);
        }
        let (first, last) = (heard[0].unwrap().0, heard.last().unwrap().unwrap().0);
        assert_eq!(last.device_ns - first.device_ns, 8_000_000 * (heard.len() as i64 - 1));
        assert_eq!(controller.counts().1, 0, "commands of motion");
        let kinds: Vec<u32> = said.iter().map(|packet| word(packet, 0).unwrap()).collect();
        let wanted: &[u32] = if version >= 3 { &[2, 7, 200] } else { &[2, 7, 6, 0] };
        assert_eq!(kinds, wanted, "{version}");
        assert_eq!(pc.about().pose, PoseMeaning::FlangeInWorld);
        assert!(pc.about().protocol.ends_with(&format!("version {version}")));
        assert_eq!(pc.farewell(), Some(head(STOP, version)));
    }
}

#[test]
fn stream_motion_reports_an_input_that_it_is_asked_for_and_versions_that_cannot_are_refused() {
    let signal: Signal = "DI101".parse().unwrap();
    for version in [3, 4] {
        let (pc, controller, heard, said) = stream_of(StreamMotion::new(Some(signal)), version, 800);
        let inputs: Vec<_> = heard.iter().map(|judged| judged.unwrap().0.inputs.unwrap()).collect();
        assert!(inputs.len() > 90 && inputs.windows(2).all(|pair| pair[0] + pair[1] == 1), "{inputs:?}");
        let kinds: Vec<u32> = said.iter().map(|packet| word(packet, 0).unwrap()).collect();
        assert_eq!((kinds.as_slice(), controller.counts()), (&[2, 7, 203, 200][..], (0, 0)));
        assert_eq!(pc.about().notes, ["input 0 is DI[101]"]);
        // By hand: head, then the state (2) of a DI (1) from 101 on, one of them, and 31 entries without anything.
        let request: Vec<u32> = (0..130).map(|place| word(&said[2], place).unwrap()).collect();
        assert_eq!((&request[..6], said[2].len()), (&[203, version, 2, 1, 101, 1][..], 520));
        assert!(request[6..].chunks(4).all(|entry| entry == [0, 0, 1, 0]));
        // Nobody asked for one: what stands there means nothing.
        let (_, _, heard, _) = stream(version, 200);
        assert!(heard.iter().all(|judged| judged.unwrap().0.inputs.is_none()));
    }
    for version in [1, 2] {
        let (pc, _, heard, said) = stream_of(StreamMotion::new(Some(signal)), version, 4000);
        let why = pc.refusal().unwrap();
        assert!(why.contains("DI[101]") && heard.is_empty() && said.len() == 3, "{why}");
    }
    let (mut pc, ..) = stream_of(StreamMotion::new(Some("RI513".parse().unwrap())), 3, 200);
    assert!(pc.refusal().unwrap().contains("does not report RI[513] (error 1)"));
    assert!(pc.ask(100_000_000_000).is_empty());
    for bad in ["", "DI", "DI0", "DI+1", "DO1", "101", "DIx", "Ü1", "DI4294967296"] {
        assert!(bad.parse::<Signal>().is_err(), "{bad}");
    }
}

/// Versions 1 and 2 by hand: type 1 (DI), first number 5, mask and value.
#[test]
fn what_a_command_of_another_pc_had_reported_is_read_in_the_old_versions() {
    let (_, mut controller, ..) = stream(2, 2400);
    let (_, mut bytes) = controller.status(1000, &pose(), true).unwrap();
    assert_eq!(status(&bytes).unwrap().signals, None);
    bytes[13..20].copy_from_slice(&[1, 0, 5, 0x00, 0xf3, 0x0f, 0x0a]);
    assert_eq!(status(&bytes).unwrap().signals, Some(0x0002));
}

#[test]
fn a_controller_that_does_not_know_the_request_for_an_input_is_named() {
    let mut pc = StreamMotion::new(Some("DI1".parse().unwrap()));
    let capability = words(&[7, 3, 1, 8, 0, 3, 0]);
    let mut asked = 0;
    for ms in (0..20_000).step_by(100) {
        for packet in pc.ask(ms * 1_000_000) {
            match word(&packet, 0) {
                Some(7) => pc.notice(&capability, ms * 1_000_000),
                Some(203) => asked += 1,
                Some(200) => panic!("started without the input"),
                _ => {}
            }
        }
    }
    assert_eq!((asked, pc.refusal().unwrap().contains("does not answer")), (3, true));
}

#[test]
fn inputs_of_rsi_are_whatever_element_or_attribute_holds_them() {
    let message = |middle: &str| {
        format!("<Rob Type='KUKA'><RIst X='1' Y='2' Z='3' A='4' B='5' C='6'/>{middle}<IPOC>1</IPOC></Rob>")
    };
    for (named, middle, wanted) in [
        ("DiL", "<DiL>5</DiL>", Inputs::Bits(5)),
        ("DiL", "<DiL>-128</DiL>", Inputs::Bits(0xffff_ff80)),
        ("DiL", "<DiL> TRUE </DiL>", Inputs::Bits(1)),
        ("DiL", "<DiL>0.5</DiL>", Inputs::Odd),
        ("DiL", "<DiL>-4294967296</DiL>", Inputs::Odd),
        ("DiL", "<Digin i1='1'/>", Inputs::Missing),
        ("DiL", "<Other><DiL>1</DiL></Other>", Inputs::Missing),
        // KUKA's manual has an attribute that XML does not allow.
        ("Out.02", "<Out 01='0' 02='1' 03='0'/>", Inputs::Bits(1)),
        ("Out.04", "<Out 01='0' 02='1' 03='0'/>", Inputs::Missing),
        ("Digout.o1", "<Digout o1='0' o2='1'></Digout>", Inputs::Bits(0)),
    ] {
        let found = rob_message::read(message(middle).as_bytes(), &named.parse().unwrap()).unwrap();
        assert_eq!(found.inputs, wanted, "{named}: {middle}");
    }
    for bad in ["", "IPOC", "RIst.X", "a b", "a.b.c", ".x", "x."] {
        assert!(bad.parse::<InputElement>().is_err(), "{bad}");
    }
    // One that was named and is not there is missed; the usual one is not.
    let judged = |rsi: &mut Rsi| {
        let bytes = message("").into_bytes();
        judge(rsi, &mut FrameFilter::new(None), &bytes, 0).unwrap().0.inputs
    };
    let (mut named, mut usual) = (Rsi::new(Some("Camera".parse().unwrap()), None), Rsi::default());
    assert_eq!((judged(&mut named), judged(&mut usual)), (None, None));
    assert!(named.about().notes[0].contains("no Camera") && usual.about().notes.is_empty());
}

#[test]
fn a_stream_that_awaits_commands_is_left_alone() {
    let (mut pc, mut controller, ..) = stream(3, 100);
    let (_, mut bytes) = controller.status(1000, &pose(), false).unwrap();
    bytes[12] |= 1;
    pc.notice(&bytes, 1_000_000_000);
    assert!(pc.refusal().unwrap().contains("another program streams motion"));
    assert!(pc.farewell().is_none() && pc.ask(100_000_000_000).is_empty());
}

#[test]
fn a_status_of_another_length_or_kind_is_none_and_stops_are_told() {
    let (_, mut controller, ..) = stream(3, 100);
    let (_, good) = controller.status(1000, &pose(), false).unwrap();
    let mut stop = good.clone();
    stop[13] = 4;
    assert_eq!(status(&stop).unwrap().stopped, Some("emergency stop"));
    for length in [8, 131, 387, 389, 416] {
        let mut bytes = good.clone();
        bytes.resize(length, 0);
        assert!(matches!(status(&bytes), Err(PacketError::Length { .. })), "{length}");
    }
    let mut other = good;
    other[3] = 99;
    assert_eq!(status(&other), Err(PacketError::Kind { found: 99 }));
}

#[test]
fn rsi_messages_are_read_whatever_their_order_and_cycle() {
    let text = "<?xml version='1.0'?>\n<!-- sent by a simulator -->\
        <Rob TYPE=\"KUKA\"><Delay D='0'/><RIst A='90' B=\"0\" C='0' Z='3e2' Y=\"-0.00\" X='100.0'/><EIPos E1='0'/>\
        <IPOC> 4208163634 </IPOC></Rob>\0";
    let found = read(text.as_bytes()).unwrap();
    near(
        &found.pose,
        &Pose::from_parts(
            Vector3::new(0.1, 0.0, 0.3).into(),
            so3::exp(&(Vector3::z() * std::f64::consts::FRAC_PI_2)),
        ),
        1e-12,
    );
    assert_eq!((found.ipoc.ms(), found.inputs), (4_208_163_634, Inputs::Missing));
    for cycle_ms in [1_u64, 4, 12] {
        let (mut rsi, mut filter) = (Rsi::default(), FrameFilter::new(None));
        for k in 0..100_u64 {
            if k == 50 {
                continue;
            }
            let ipoc = 4_294_967_200 + cycle_ms * k;
            let bytes = rsi_sim::message(&pose(), ipoc, k % 2 == 1, 0).into_bytes();
            let (found, status) = judge(&mut rsi, &mut filter, &bytes, (cycle_ms * k) as i64).unwrap();
            // Four decimals of mm and degrees.
            near(&found.base_from_tool, &pose(), 3e-6);
            assert_eq!((found.device_ns, found.inputs), (ipoc as i64 * 1_000_000, Some(k % 2)));
            let skipped = u32::from(k == 51);
            let expected = if k == 0 { SequenceStatus::First } else { SequenceStatus::Newest { skipped } };
            assert_eq!(status, expected, "{cycle_ms} ms, {k}");
        }
    }
}

#[test]
fn what_is_no_rsi_message_is_refused_with_what_to_do() {
    for (text, word) in [
        ("", "no <Rob>"),
        ("<Rob><IPOC>1</IPOC></Rob>", "DEF_RIst"),
        ("<Rob><RIst X='1' Y='2' Z='3' A='4' B='5'/><IPOC>1</IPOC></Rob>", "X Y Z A B C"),
        ("<Rob><RIst X='1,5' Y='2' Z='3' A='4' B='5' C='6'/><IPOC>1</IPOC></Rob>", "decimal comma"),
        ("<Rob><RIst X='nan' Y='2' Z='3' A='4' B='5' C='6'/><IPOC>1</IPOC></Rob>", "not a number"),
        ("<Rob><RIst X='1' Y='2' Z='3' A='4' B='5' C='6'/></Rob>", "no IPOC"),
        ("<Rob><RIst X='1' Y='2' Z='3' A='4' B='5' C='6'/><IPOC>-1</IPOC></Rob>", "not a number"),
        ("<!DOCTYPE a [<!ENTITY b 'c'>]><Rob><IPOC>&b;</IPOC></Rob>", "document type"),
        ("<Rob><RIst", "well-formed"),
        ("<Rob><RIst X='1' Y='2' Z='3' A='4' B='5' C='6'/><IPOC>1</IPOC><IPOC>2</IPOC></Rob>", "IPOC twice"),
        ("<Rob><RIst X='1' Y='2' Z='3' A='4' B='5' C='6'/><IPOC>1<!-- -->2</IPOC></Rob>", "IPOC twice"),
        ("<Rob><RIst X='1' Y='2' Z='3' A='4' B='5' C='6'/><Other><IPOC>1</IPOC></Other></Rob>", "no IPOC"),
        ("<Rob><RIst X='1' Y='2' Z='3' A='4' B='5' C='6'/><IPOC>1</IPOC></Rob><Rob/>", "two messages"),
        ("<Rob><RIst X='1' Y='2' Z='3' A='4' B='5' C='6'/><IPOC>1</IPOC>", "well-formed"),
    ] {
        let refused = read(text.as_bytes()).unwrap_err().to_string();
        assert!(refused.contains(word), "{text}: {refused}");
    }
    assert!(read(&[0xff, 0xfe, 0x00]).is_err());
}

proptest! {
    /// Nothing panics on any input, and accepted input is finite.
    #[test]
    fn no_datagram_upsets_a_reader(mut bytes in prop::collection::vec(any::<u8>(), 0..450), kind in 0_usize..8) {
        let starts: [&[u8]; 8] = [&[], &[0, 0, 0, 1, 0, 0, 0, 9, 0, 0, 0, 9, 0, 1], &[0, 0, 0, 202], &[0, 0, 0, 204],
            &[0, 0, 0, 0], b"<Rob><RIst X='", b"<Rob Type=\"KUKA\"><IPOC>", &[0, 0, 0, 7]];
        bytes.splice(0..starts[kind].len().min(bytes.len()), starts[kind].iter().copied());
        for length in [48, 132, 388, 416] {
            let mut cut = bytes.clone();
            cut.resize(length, 0);
            if let Ok((_, raw)) = Hspo::default().decode(&cut) {
                let pose = Hspo::default().place(raw, SequenceStatus::First).0.base_from_tool;
                prop_assert!(pose.translation.vector.iter().all(|v| v.is_finite()));
            }
            if let Ok(status) = status(&cut) {
                prop_assert!(status.pose.translation.vector.iter().all(|v| v.is_finite()));
            }
        }
        if let Ok(message) = read(&bytes) {
            prop_assert!(message.pose.translation.vector.iter().all(|v| v.is_finite()));
        }
    }
}
