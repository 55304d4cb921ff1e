//! An entry as messages.

use crate::wire::frame_names::{BASE, TOOL, low_bits};
use crate::wire::proto;
use crate::wire::topics::{
    ANSWER, CLOCK, FEATURES, FRAME, IMAGE, INPUTS, LOG, PACKET, POINTS, REJECTED, ROBOT, TF,
};
use crate::write::entry::{
    Entry, FeaturesEntry, FrameEntry, NoteEntry, NoteLevel, POINT_BYTES, ProfileEntry, RobotEntry,
};
use foxglove::messages::{
    CompressedImage, FrameTransform, Log, PackedElementField, PointCloud, Quaternion, Timestamp, Vector3,
    log::Level, packed_element_field::NumericType,
};
use prost::Message;
use trueline_dataset::{Feature, Measured};
use trueline_geometry::Pose;

/// A message before it has a file.
pub(crate) struct Outgoing {
    pub topic: u16,
    pub sequence: u32,
    pub log_ns: i64,
    pub publish_ns: i64,
    pub bytes: Vec<u8>,
}

impl Outgoing {
    fn at(topic: u16, stamp_ns: i64, message: &impl Message) -> Self {
        Self { topic, sequence: 0, log_ns: stamp_ns, publish_ns: stamp_ns, bytes: message.encode_to_vec() }
    }

    fn numbered(self, sequence: u32) -> Self {
        Self { sequence, ..self }
    }
}

/// The messages of an entry, in the order in which they are written.
pub(crate) fn messages(entry: Entry) -> Vec<Outgoing> {
    match entry {
        Entry::Robot(robot) => robot_messages(robot).into(),
        Entry::Rejected(rejected) => {
            let message = proto::RejectedDatagram {
                datagram: rejected.datagram,
                source: rejected.from.to_string(),
                steady_ns: rejected.steady_ns,
                reason: rejected.reason,
            };
            vec![Outgoing::at(REJECTED, rejected.steady_ns, &message)]
        }
        Entry::Answer(answer) => {
            let message = proto::Answer {
                sensor: answer.datagram,
                destination: answer.to.to_string(),
                steady_ns: answer.steady_ns,
                sequence: answer.sequence,
            };
            vec![Outgoing::at(ANSWER, answer.steady_ns, &message).numbered(answer.sequence)]
        }
        Entry::Clock(clock) => {
            let message = proto::Clock { steady_ns: clock.steady_ns, wall_ns: clock.wall_ns };
            vec![Outgoing::at(CLOCK, clock.steady_ns, &message)]
        }
        Entry::Inputs(inputs) => {
            let [before_ns, steady_ns] = inputs.between_ns;
            let [device_before_ns, device_ns] = inputs.device_ns;
            let [bits_before, bits] = inputs.bits;
            let message =
                proto::Inputs { before_ns, steady_ns, device_before_ns, device_ns, bits_before, bits };
            vec![Outgoing::at(INPUTS, steady_ns, &message)]
        }
        Entry::Note(note) => vec![note_message(note)],
        Entry::Frame(frame) => frame_messages(frame),
        Entry::Profile(profile) => vec![profile_message(&profile)],
        Entry::Features(features) => features_message(&features).into_iter().collect(),
    }
}

fn transform(base_from_tool: &Pose, steady_ns: i64) -> FrameTransform {
    let (p, q) = (base_from_tool.translation.vector, base_from_tool.rotation.quaternion());
    FrameTransform {
        timestamp: Some(timestamp(steady_ns)),
        parent_frame_id: BASE.to_owned(),
        child_frame_id: TOOL.to_owned(),
        translation: Some(Vector3 { x: p.x, y: p.y, z: p.z }),
        rotation: Some(Quaternion { x: q.i, y: q.j, z: q.k, w: q.w }),
    }
}

fn robot_messages(robot: RobotEntry) -> [Outgoing; 2] {
    let pose = transform(&robot.base_from_tool, robot.steady_ns);
    // A `RobotPacket` is the same as long as it has no IEEE 1588 time.
    let topic = if robot.is_egm { ROBOT } else { PACKET };
    let datagram = proto::RobotDatagram {
        robot: robot.datagram,
        source: robot.from.to_string(),
        kernel_wall_ns: robot.kernel_wall_ns,
        read_wall_ns: robot.read_wall_ns,
        steady_ns: robot.steady_ns,
        device_ns: robot.device_ns,
        ptp_ns: robot.ptp_ns.filter(|_| robot.is_egm),
    };
    let pose = Outgoing::at(TF, robot.steady_ns, &pose);
    [
        Outgoing { publish_ns: robot.device_ns, ..pose }.numbered(robot.sequence),
        Outgoing::at(topic, robot.steady_ns, &datagram).numbered(robot.sequence),
    ]
}

fn note_message(note: NoteEntry) -> Outgoing {
    let level = match note.level {
        NoteLevel::Info => Level::Info,
        NoteLevel::Warning => Level::Warning,
        NoteLevel::Error => Level::Error,
    };
    let message = Log {
        timestamp: Some(timestamp(note.steady_ns)),
        level: level as i32,
        message: note.text,
        name: "trueline".to_owned(),
        ..Log::default()
    };
    Outgoing::at(LOG, note.steady_ns, &message)
}

/// Stamps first: a picture without them is worth less than they without it.
fn frame_messages(frame: FrameEntry) -> Vec<Outgoing> {
    let stamps = proto::Frame {
        frame: frame.frame,
        stamp_ns: frame.stamp_ns,
        first_packet_ns: frame.first_packet_ns,
        complete_ns: frame.complete_ns,
        device_ns: frame.device_ns,
        exposure_us: frame.exposure_us,
        status: frame.status,
        picture_bytes: frame.png.len() as u64,
        encoder: frame.signals.encoder,
        lines: frame.signals.lines,
        counter: frame.signals.counter,
        camera_frame: frame.signals.camera_frame,
    };
    let sequence = low_bits(frame.frame);
    let mut messages = vec![Outgoing::at(FRAME, frame.stamp_ns, &stamps).numbered(sequence)];
    if !frame.png.is_empty() {
        let picture = CompressedImage {
            timestamp: Some(timestamp(frame.stamp_ns)),
            frame_id: "camera".to_owned(),
            data: frame.png.into(),
            format: "png".to_owned(),
        };
        messages.push(Outgoing::at(IMAGE, frame.stamp_ns, &picture).numbered(sequence));
    }
    messages
}

/// An organised cloud: a column without a return is a point that is not finite, as drivers of profilers have it.
fn profile_message(profile: &ProfileEntry) -> Outgoing {
    let number = |column: &Option<[f64; 2]>| column.unwrap_or([f64::NAN; 2]).map(f64::to_le_bytes).concat();
    let field = |name: &str, offset| PackedElementField {
        name: name.to_owned(),
        offset,
        r#type: NumericType::Float64.into(),
    };
    let cloud = PointCloud {
        timestamp: Some(timestamp(profile.stamp_ns)),
        frame_id: "profiler".to_owned(),
        pose: None,
        point_stride: POINT_BYTES as u32,
        fields: vec![field("x", 0), field("z", POINT_BYTES as u32 / 2)],
        data: profile.columns.iter().flat_map(number).collect::<Vec<u8>>().into(),
    };
    Outgoing::at(POINTS, profile.stamp_ns, &cloud).numbered(low_bits(profile.profile))
}

fn features_message(entry: &FeaturesEntry) -> Option<Outgoing> {
    let first = entry.features.first()?;
    let features = entry.features.iter().map(feature).collect();
    Some(Outgoing::at(FEATURES, first.stamp_ns, &proto::Features { features }))
}

fn feature(feature: &Feature) -> proto::Feature {
    let mut message = proto::Feature {
        stamp_ns: feature.stamp_ns,
        line: feature.line,
        frame: feature.frame,
        device_ns: feature.device_ns,
        sigma: feature.sigma.map_or_else(Vec::new, Vec::from),
        correlation: feature.correlation,
        ..proto::Feature::default()
    };
    match feature.measured {
        Measured::Pixel(pixel) => message.pixel = pixel.into(),
        Measured::Point(point) => message.point = point.into(),
        Measured::Profile(profile) => message.profile = profile.into(),
    }
    message
}

/// For viewers only, which know the years 1970 to 2106; the time of the message is read back. A stamp as Foxglove has
/// it.
pub(crate) fn timestamp(ns: i64) -> Timestamp {
    let seconds = u32::try_from(ns.div_euclid(1_000_000_000)).unwrap_or(0);
    Timestamp::new(seconds, ns.rem_euclid(1_000_000_000) as u32)
}
