//! A camera's output on an input of a robot, in the words of each protocol, from its packets to what `calibrate` and `doctor` compare.
//!
//! A simulated scan gives poses and seam points; every pose becomes a packet as the simulated controller of a protocol makes
//! it, with the input as it was just then. The recording is opened and calibrated like any other.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use std::net::SocketAddr;
use std::path::Path;
use trueline::open::{How, MeasuredByInput, open};
use trueline_cell::{ARRIVAL, CellRecording, RecordingSettings};
use trueline_dataset::{FrameSignals, Recording, RobotSample, SensorFile, sensor_toml};
use trueline_live::egm::{
    EgmClock, EgmFeedBack, EgmHeader, EgmPose, EgmRobot, Message, MessageType, RapidData,
};
use trueline_live::fanuc::stream_motion_packets::words;
use trueline_live::fanuc::stream_motion_sim::StreamMotionController;
use trueline_live::fanuc::{Hspo, StreamMotion, hspo_sim};
use trueline_live::host_clock::Reading;
use trueline_live::kuka::{Rsi, rsi_sim};
use trueline_live::stamped_socket::{Arrival, Datagram};
use trueline_live::udp_source::DatagramProtocol;
use trueline_live::{FrameFilter, HostClock, Received, RobotPacket};
use trueline_mcap::{Entry, FeaturesEntry, FrameEntry};
use trueline_method::{Config, calibrate};
use trueline_sim::{Preset, simulate};

const EXPOSURE_S: f64 = 0.010;
/// Some day in 2025, ns: stamps of a steady clock.
const BEGAN_NS: i64 = 1_750_000_000_000_000_000;

fn robot() -> SocketAddr {
    "192.168.1.20:40001".parse().unwrap()
}

fn arrival(sample: &RobotSample) -> Arrival {
    let read = Reading { steady_ns: BEGAN_NS + sample.stamp_ns, wall_ns: BEGAN_NS + sample.stamp_ns };
    Arrival { steady_ns: read.steady_ns, is_of_reading: false, kernel_wall_ns: None, read }
}

/// Hands a datagram to the recording as the protocol's source would.
fn hear<P: DatagramProtocol>(
    protocol: &mut P,
    filter: &mut FrameFilter,
    bytes: &[u8],
    arrival: Arrival,
    recording: &mut CellRecording,
) {
    let judged = filter.judge_as(bytes, robot(), arrival.steady_ns, |bytes| protocol.decode(bytes));
    protocol.notice(bytes, arrival.steady_ns);
    let judged = judged.map(|(raw, status)| protocol.place(raw, status));
    recording.packet(&RobotPacket { bytes, from: robot(), arrival, judged, egm: None });
}

fn egm(sample: &RobotSample, k: u64, input: bool) -> Vec<u8> {
    EgmRobot {
        header: Some(EgmHeader::new(k as u32, 4 * k as u32, MessageType::Data)),
        feed_back: Some(EgmFeedBack {
            cartesian: Some(EgmPose::full(&sample.base_from_tool)),
            time: Some(EgmClock { sec: Some(4 * k / 1000), usec: Some(4 * k % 1000 * 1000) }),
            ..EgmFeedBack::default()
        }),
        rapid_data: Some(RapidData::default().with_flag(Some(input))),
        ..EgmRobot::default()
    }
    .encode_to_vec()
}

/// All packets of a robot, into the recording.
fn stream(name: &str, scan: &Recording, inputs: &[bool], recording: &mut CellRecording) {
    let mut filter = FrameFilter::new(Some(robot().ip()));
    let (mut hspo, mut rsi) = (Hspo::default(), Rsi::default());
    let mut stream_motion = StreamMotion::new(Some("RI1".parse().unwrap()));
    let version = if name == "stream motion 4" { 4 } else { 3 };
    let mut controller = StreamMotionController::new(version, 4);
    for (step, answer) in
        (0_i64..3).zip([words(&[7, version, 1, 4, 0, version, 0]), words(&[203, 0, 0]), Vec::new()])
    {
        for packet in stream_motion.ask(step) {
            let _answer = controller.receive(&packet, robot());
        }
        stream_motion.notice(&answer, step);
    }
    for ((k, sample), input) in (0_u64..).zip(&scan.robot).zip(inputs) {
        let (arrival, pose) = (arrival(sample), &sample.base_from_tool);
        match name {
            "egm" => {
                let bytes = egm(sample, k, *input);
                let judged = filter.judge(&bytes, robot(), arrival.steady_ns);
                let datagram = Datagram { bytes: &bytes, from: robot(), arrival, dropped_by_kernel: 0 };
                recording.packet(&RobotPacket::from(&Received { datagram, judged }));
            }
            "hspo" => {
                // The input is the fifth of its word here.
                let both = hspo_sim::packets(k as u32, 4000 * k as u32, pose, u32::from(*input) << 4);
                for bytes in both {
                    hear(&mut hspo, &mut filter, &bytes, arrival, recording);
                }
            }
            "rsi" => {
                let bytes = rsi_sim::message(pose, 4_294_960_000 + 4 * k, *input, 0).into_bytes();
                hear(&mut rsi, &mut filter, &bytes, arrival, recording);
            }
            _ => {
                let (_, bytes) = controller.status(4 * k as u32, pose, *input).unwrap();
                hear(&mut stream_motion, &mut filter, &bytes, arrival, recording);
            }
        }
    }
}

/// Records the scan with an input that is late by so much, opens and calibrates it.
fn measured(name: &str, scan: &Recording, late_s: f64, folder: &Path) -> MeasuredByInput {
    let offset_s = scan.truth.as_ref().unwrap().parameters.time_offset_s;
    let began_ns: Vec<i64> = scan
        .features
        .iter()
        .map(|feature| feature.stamp_ns - ((offset_s + 0.5 * EXPOSURE_S - late_s) * 1e9).round() as i64)
        .collect();
    let length_ns = (EXPOSURE_S * 1e9) as i64;
    let is_on =
        |at_ns: i64| began_ns.iter().any(|began_ns| (*began_ns..began_ns + length_ns).contains(&at_ns));
    let inputs: Vec<bool> = scan.robot.iter().map(|sample| is_on(sample.stamp_ns)).collect();
    let settings = RecordingSettings {
        folder,
        sensor_toml: Some(sensor_toml::format_file(&SensorFile::from(scan.sensor.clone()))),
        tool: "tool0",
        robot: ARRIVAL,
        command: "a test".to_owned(),
        camera: Some("a number".to_owned()),
        estimate: None,
        welds: None,
        listener: None,
    };
    let mut recording = CellRecording::create(settings, HostClock::start()).unwrap();
    stream(name, scan, &inputs, &mut recording);
    for (frame, feature) in (0_u64..).zip(&scan.features) {
        let stamp_ns = BEGAN_NS + feature.stamp_ns;
        let features = vec![trueline_dataset::Feature { stamp_ns, ..*feature }];
        assert!(recording.handle().offer(Entry::Features(FeaturesEntry { features })));
        let (exposure_us, status) = (Some(1e6 * EXPOSURE_S), "not recorded".to_owned());
        let frame = FrameEntry {
            frame,
            stamp_ns,
            first_packet_ns: None,
            complete_ns: None,
            device_ns: None,
            exposure_us,
            signals: FrameSignals::default(),
            status,
            png: Vec::new(),
        };
        assert!(recording.handle().offer(Entry::Frame(frame)));
    }
    let finished = recording.finish();
    assert!(finished.is_complete(), "{name}: {:?}", finished.losses());
    // Joint positions beside each pose are no strangers.
    assert_eq!(finished.notes(), Vec::<String>::new(), "{name}");
    let opened = open(folder, &How::default(), &()).unwrap();
    assert_eq!(opened.recording.robot.len(), scan.robot.len(), "{name}");
    let calibration = calibrate(&opened.recording, None, &Config::default()).unwrap();
    opened.measured_offset(&calibration).unwrap_or_else(|| panic!("{name}: no input follows the exposures"))
}

#[test]
fn the_offset_is_measured_by_an_input_of_every_robot_and_a_late_one_is_contradicted() {
    let scan = simulate(&Preset::Quick.scenario(), 1).unwrap();
    let truth_s = scan.truth.as_ref().unwrap().parameters.time_offset_s;
    for (name, input) in [("egm", 0), ("hspo", 4), ("stream motion 3", 0), ("stream motion 4", 0), ("rsi", 0)]
    {
        let folder = tempfile::tempdir().unwrap();
        let good = measured(name, &scan, 0.0, &folder.path().join("good"));
        assert!(good.offset.agrees() && good.input == input, "{name}: {good}");
        let off_s = good.offset.offset_s - truth_s;
        assert!(off_s.abs() < 4.0 * good.offset.sigma_s, "{name}: {good}, truth {truth_s} s");
        // 5 ms late: the exposure seems to begin later, and so the stamp to be less late.
        let late = measured(name, &scan, 0.005, &folder.path().join("late"));
        assert!(!late.offset.agrees(), "{name}: {late}");
        let shift_s = late.offset.offset_s - good.offset.offset_s;
        assert!(
            (shift_s + 0.005).abs() < 4.0 * late.offset.sigma_s.hypot(good.offset.sigma_s),
            "{name}: {shift_s} s"
        );
    }
}
