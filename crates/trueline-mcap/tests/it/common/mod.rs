//! Helpers of the tests: entries to record, files to read, and messages in other programs' form.
#![allow(dead_code, reason = "each test uses its part")]

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use std::collections::BTreeMap;
use std::io::{self, Cursor, Write};
use std::path::Path;
use std::sync::{Arc, Mutex};
use trueline_dataset::{Feature, FrameSignals, Measured, PictureSource, Sensor, SensorFile};
use trueline_geometry::{Pose, se3, so3};
use trueline_mcap::{
    About, AnswerEntry, Choice, ClockEntry, Damage, DamagedFile, DatasetFolder, Entry, FeaturesEntry,
    FrameEntry, ImportError, Item, LogReader, NoteEntry, NoteLevel, Recorder, RejectedEntry, RobotEntry,
    Sink, import,
};

pub(crate) const T0: i64 = 1_700_000_000_000_000_000;
pub(crate) const SENSOR: &str = "kind = \"profiler\"\n# in its own words\n";

pub(crate) fn about() -> About {
    About {
        sensor_toml: Some(SENSOR.to_owned()),
        stamp_meaning: "middle of the exposure".to_owned(),
        command: "trueline record".to_owned(),
        tool: "tool0".to_owned(),
    }
}

pub(crate) fn pose(k: u32) -> Pose {
    let t = f64::from(k) * 0.004;
    se3::from_parts(so3::exp(&Vector3::new(0.1 * t, 0.3, -0.2 * t)), Vector3::new(0.5 + t, -0.2, 0.4 - t))
}

pub(crate) fn robot(k: u32) -> RobotEntry {
    // Not to be pressed together: a chunk must be able to be full.
    let mut x = u64::from(k).wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let noise = || {
        x ^= x << 13;
        x ^= x >> 7;
        x ^= x << 17;
        x as u8
    };
    RobotEntry {
        is_egm: true,
        // A field that no EgmRobot has yet, with anything in it.
        datagram: [0x7a, 90].into_iter().chain(std::iter::repeat_with(noise).take(90)).collect(),
        from: "192.168.125.1:6510".parse().unwrap(),
        steady_ns: T0 + 4_000_000 * i64::from(k) + i64::from(k % 7),
        kernel_wall_ns: (!k.is_multiple_of(3)).then(|| T0 + i64::from(k)),
        read_wall_ns: T0 - 1,
        sequence: u32::MAX - 5 + k.min(5),
        device_ns: 4_000_000 * i64::from(k),
        ptp_ns: k.is_multiple_of(2).then_some(0),
        base_from_tool: pose(k),
    }
}

pub(crate) fn frame(k: u32) -> FrameEntry {
    FrameEntry {
        frame: (1 << 33) + u64::from(k),
        stamp_ns: T0 + 33_000_000 * i64::from(k),
        first_packet_ns: Some(0),
        complete_ns: None,
        device_ns: Some(7 + 33_000_000 * i64::from(k)),
        exposure_us: Some(0.0),
        signals: FrameSignals {
            encoder: Some(-1 - i64::from(k)),
            lines: Some(0b101),
            counter: None,
            camera_frame: Some(0),
        },
        status: "success".to_owned(),
        png: png(k as u8),
    }
}

/// The smallest head that a gray PNG has, and some bytes; only a picture that is looked at must be one.
pub(crate) fn png(fill: u8) -> Vec<u8> {
    let mut bytes = vec![0x89, b'P', b'N', b'G', 0x0d, 0x0a, 0x1a, 0x0a, 0, 0, 0, 13, b'I', b'H', b'D', b'R'];
    bytes.extend([0, 0, 0, 2, 0, 0, 0, 1, 8, 0, 0, 0, 0]);
    bytes.extend([fill; 40]);
    bytes
}

pub(crate) fn profile(k: u32) -> Feature {
    Feature {
        stamp_ns: T0 + 5_000_000 * i64::from(k),
        line: k % 2,
        frame: Some(u64::from(k)),
        device_ns: Some(0),
        measured: Measured::Profile([0.001 * f64::from(k), 0.25]),
        sigma: Some([1e-5, 2e-5]),
        correlation: -0.75,
    }
}

/// Something of everything.
pub(crate) fn entries(count: u32) -> Vec<Entry> {
    let mut entries = Vec::new();
    for k in 0..count {
        entries.push(Entry::Robot(robot(k)));
        let (steady_ns, from) = (robot(k).steady_ns, robot(k).from);
        match k % 8 {
            0 => entries.push(Entry::Frame(frame(k))),
            1 => entries.push(Entry::Features(FeaturesEntry { features: vec![profile(k), profile(k + 1)] })),
            2 => entries.push(Entry::Clock(ClockEntry { steady_ns, wall_ns: -1 })),
            3 => entries.push(Entry::Answer(AnswerEntry {
                datagram: vec![0x1a, 0],
                to: from,
                steady_ns,
                sequence: k,
            })),
            4 => entries.push(Entry::Rejected(RejectedEntry {
                datagram: vec![0xff; 3],
                from,
                steady_ns,
                reason: "a repetition".to_owned(),
            })),
            5 => entries.push(Entry::Note(NoteEntry {
                steady_ns,
                level: NoteLevel::Warning,
                text: "the clock was set".to_owned(),
            })),
            6 => entries.push(Entry::Frame(FrameEntry { png: Vec::new(), device_ns: None, ..frame(k) })),
            _ => {}
        }
    }
    entries
}

/// A sink whose bytes can be looked at.
#[derive(Clone, Default)]
pub(crate) struct Memory(pub Arc<Mutex<Vec<u8>>>);

impl Memory {
    pub(crate) fn bytes(&self) -> Vec<u8> {
        self.0.lock().unwrap().clone()
    }
}

impl Write for Memory {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().unwrap().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Sink for Memory {
    fn sync(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// A finished recording.
pub(crate) fn recorded(entries: Vec<Entry>) -> Vec<u8> {
    let memory = Memory::default();
    let recorder = Recorder::onto(memory.clone(), Path::new("memory"), &about()).unwrap();
    for entry in entries {
        assert!(recorder.handle().offer(entry));
    }
    recorder.finish().unwrap();
    memory.bytes()
}

/// The same as a program that was killed leaves it, in several chunks.
pub(crate) fn unfinished(entries: Vec<Entry>) -> Vec<u8> {
    let memory = Memory::default();
    let mut log = trueline_mcap::log_writer::LogWriter::new(memory.clone(), &about()).unwrap();
    for (k, entry) in entries.into_iter().enumerate() {
        log.write(entry).unwrap();
        if k % 10 == 9 {
            log.flush().unwrap();
        }
    }
    log.flush().unwrap();
    log.sync().unwrap();
    let bytes = memory.bytes();
    log.abandon();
    assert_eq!(memory.bytes(), bytes, "nothing is written behind a failure");
    bytes
}

pub(crate) fn read_items(bytes: &[u8]) -> (Vec<Item>, Vec<Damage>) {
    let mut reader = LogReader::open(Cursor::new(bytes)).unwrap();
    let mut items = Vec::new();
    while let Some(item) = reader.next_item().unwrap() {
        items.push(item);
    }
    (items, reader.damages().to_vec())
}

/// Messages of a topic.
pub(crate) fn messages<'a>(items: &'a [Item], topic: &str) -> Vec<(u32, u64, u64, &'a [u8])> {
    let of_topic = items.iter().filter_map(|item| match item {
        Item::Message { channel, sequence, log_time, publish_time, data, .. } if channel.topic == topic => {
            Some((*sequence, *log_time, *publish_time, data.as_slice()))
        }
        _ => None,
    });
    of_topic.collect()
}

/// A message of somebody else.
pub(crate) struct Foreign {
    pub topic: &'static str,
    pub schema: &'static str,
    pub encoding: &'static str,
    pub bytes: Vec<u8>,
}

/// Writes an MCAP file as somebody else would; times of recording are those of nothing in particular.
pub(crate) fn write_foreign(file: &Path, messages: &[Foreign]) {
    let out = std::fs::File::create(file).unwrap();
    let mut writer = mcap::WriteOptions::new().compression_threads(0).create(out).unwrap();
    for (k, message) in messages.iter().enumerate() {
        let schema = writer.add_schema(message.schema, "", b"").unwrap();
        let id = writer.add_channel(schema, message.topic, message.encoding, &BTreeMap::new()).unwrap();
        let time = 5 + k as u64;
        let header =
            mcap::records::MessageHeader { channel_id: id, sequence: 0, log_time: time, publish_time: time };
        writer.write_to_known_channel(&header, &message.bytes).unwrap();
    }
    writer.finish().unwrap();
}

fn ros1_header(stamp_ns: i64, frame: &str) -> Vec<u8> {
    let mut bytes = 0_u32.to_le_bytes().to_vec();
    bytes.extend(u32::try_from(stamp_ns / 1_000_000_000).unwrap().to_le_bytes());
    bytes.extend(u32::try_from(stamp_ns % 1_000_000_000).unwrap().to_le_bytes());
    bytes.extend(ros1_text(frame));
    bytes
}

pub(crate) fn ros1_text(text: &str) -> Vec<u8> {
    let mut bytes = u32::try_from(text.len()).unwrap().to_le_bytes().to_vec();
    bytes.extend(text.as_bytes());
    bytes
}

fn numbers(pose: &Pose) -> Vec<u8> {
    let (p, q) = (pose.translation.vector, pose.rotation.quaternion());
    [p.x, p.y, p.z, q.i, q.j, q.k, q.w].iter().flat_map(|v| v.to_le_bytes()).collect()
}

pub(crate) fn pose_stamped(topic: &'static str, stamp_ns: i64, frame: &str, pose: &Pose) -> Foreign {
    let bytes = [ros1_header(stamp_ns, frame), numbers(pose)].concat();
    Foreign { topic, schema: "geometry_msgs/PoseStamped", encoding: "ros1", bytes }
}

pub(crate) fn tf(topic: &'static str, transforms: &[(i64, &str, &str, Pose)]) -> Foreign {
    let mut bytes = u32::try_from(transforms.len()).unwrap().to_le_bytes().to_vec();
    for (stamp_ns, parent, child, pose) in transforms {
        bytes.extend([ros1_header(*stamp_ns, parent), ros1_text(child), numbers(pose)].concat());
    }
    Foreign { topic, schema: "tf2_msgs/TFMessage", encoding: "ros1", bytes }
}

pub(crate) fn compressed_image(topic: &'static str, stamp_ns: i64, format: &str, data: &[u8]) -> Foreign {
    let mut bytes = ros1_header(stamp_ns, "camera");
    bytes.extend(ros1_text(format));
    bytes.extend(u32::try_from(data.len()).unwrap().to_le_bytes());
    bytes.extend(data);
    Foreign { topic, schema: "sensor_msgs/CompressedImage", encoding: "ros1", bytes }
}

pub(crate) fn profiler() -> Option<SensorFile> {
    Some(Sensor::Profiler.into())
}

/// A pose of a position, m, and a quaternion in the order x, y, z, w.
pub(crate) fn pose_xyzw(p: [f64; 3], q: [f64; 4]) -> Pose {
    let rotation = UnitQuaternion::new_normalize(Quaternion::new(q[3], q[0], q[1], q[2]));
    se3::from_parts(rotation, Vector3::from(p))
}

/// The result of making a dataset folder from a recording.
#[derive(Debug)]
pub(crate) struct Unpacked {
    pub robot: usize,
    pub frames: usize,
    pub features: usize,
    pub stamp_meaning: Option<String>,
    pub notes: Vec<String>,
    pub damages: Vec<DamagedFile>,
}

/// Makes a dataset folder of a recording, and compares it with the read data: reading it gives the same numbers.
pub(crate) fn unpack(path: &Path, choice: &Choice, out: &Path) -> Result<Unpacked, ImportError> {
    let folder = DatasetFolder::begin(out, false)?;
    let imported = import(path, choice)?;
    folder.write(&imported)?;
    let recording = &imported.in_written_form().unwrap();
    let file = out.join("robot.csv");
    if !recording.robot.is_empty() {
        let written = trueline_dataset::robot_csv::read(&file, std::fs::read(&file).unwrap().as_slice());
        assert!(written.unwrap() == recording.robot, "the folder holds the numbers of the recording");
    }
    if !recording.features.is_empty() {
        let file = out.join("features.csv");
        let bytes = std::fs::read(&file).unwrap();
        let written = trueline_dataset::features_csv::read(&file, bytes.as_slice(), &recording.sensor);
        assert!(written.unwrap() == recording.features, "the folder holds the numbers of the recording");
    }
    Ok(Unpacked {
        robot: recording.robot.len(),
        frames: imported.pictures.as_ref().map_or(0, PictureSource::count),
        features: recording.features.len(),
        stamp_meaning: imported.stamp_meaning,
        notes: imported.notes,
        damages: imported.damages,
    })
}
