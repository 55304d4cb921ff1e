//! Accepted data are never lost, and losses are counted.

use crate::common;

use common::{Memory, SENSOR, about, entries, frame, messages, profile, read_items, recorded, robot, unpack};
use prost::Message;
use std::io::{self, Write};
use std::path::Path;
use std::sync::{Arc, Condvar, Mutex};
use std::time::{Duration, Instant};
use trueline_dataset::{GrayImage, Pixels, folder, gray_png, images};
use trueline_mcap::{
    Choice, Content, Entry, FeaturesEntry, FrameEntry, InputsEntry, Item, RecordError, Recorder, RobotEntry,
    Sink, message,
};

/// The fields of a message written by hand here: an independent reading of the file.
#[derive(Clone, PartialEq, Message)]
struct RobotDatagram {
    #[prost(bytes = "vec", tag = "1")]
    robot: Vec<u8>,
    #[prost(string, tag = "2")]
    source: String,
    #[prost(int64, optional, tag = "3")]
    kernel_wall_ns: Option<i64>,
    #[prost(int64, tag = "4")]
    read_wall_ns: i64,
    #[prost(int64, tag = "5")]
    steady_ns: i64,
    #[prost(int64, tag = "6")]
    device_ns: i64,
    #[prost(int64, optional, tag = "7")]
    ptp_ns: Option<i64>,
}

/// Changes of inputs come back as they were given in, whatever the bits.
#[test]
fn changes_of_digital_inputs_are_kept_with_both_clocks() {
    let change = InputsEntry {
        between_ns: [1_700_000_000_000_000_001, 1_700_000_000_002_000_003],
        device_ns: [-5, 1_999_995],
        bits: [u64::MAX, 1 << 63],
    };
    let (items, damages) = read_items(&recorded(vec![Entry::Inputs(change)]));
    assert!(damages.is_empty());
    let found = messages(&items, "/robot/inputs");
    let [(_, log_ns, _, bytes)] = found[..] else { panic!("{} messages", found.len()) };
    assert_eq!(log_ns, 1_700_000_000_002_000_003);
    let content = trueline_mcap::message::decode("trueline.Inputs", "protobuf", bytes).unwrap();
    assert_eq!(content, Content::Inputs(change));
}

#[test]
fn everything_comes_back_bit_for_bit() {
    let (items, damages) = read_items(&recorded(entries(64)));
    assert!(damages.is_empty(), "{damages:?}");
    let datagrams = messages(&items, "/robot/egm");
    let poses = messages(&items, "/tf");
    assert_eq!((datagrams.len(), poses.len()), (64, 64));
    for (k, (datagram, pose)) in (0..64).zip(datagrams.iter().zip(&poses)) {
        let RobotEntry { datagram: bytes, from, steady_ns, kernel_wall_ns, read_wall_ns, .. } = robot(k);
        let RobotEntry { sequence, device_ns, ptp_ns, base_from_tool, .. } = robot(k);
        let wire = RobotDatagram {
            robot: bytes,
            source: from.to_string(),
            kernel_wall_ns,
            read_wall_ns,
            steady_ns,
            device_ns,
            ptp_ns,
        };
        assert_eq!(RobotDatagram::decode(datagram.3).unwrap(), wire);
        assert_eq!((pose.0, pose.1, pose.2), (sequence, steady_ns as u64, device_ns as u64));
        let Content::Transforms(read) =
            message::decode("foxglove.FrameTransform", "protobuf", pose.3).unwrap()
        else {
            panic!("no transform")
        };
        assert_eq!((read[0].parent.as_str(), read[0].child.as_str()), ("base", "tool"));
        assert_eq!(read[0].stamp_ns, steady_ns);
        assert_eq!(read[0].parent_from_child.translation, base_from_tool.translation);
        // Brought to length 1 once more, which may move the last bit.
        assert!(read[0].parent_from_child.rotation.angle_to(&base_from_tool.rotation) < 1e-15);
    }
    for (topic, count) in [
        ("/robot/rejected", 8),
        ("/robot/answer", 8),
        ("/clock", 8),
        ("/log", 8),
        ("/camera/image", 8),
        ("/camera/frame", 16),
        ("/sensor/features", 8),
    ] {
        assert_eq!(messages(&items, topic).len(), count, "{topic}");
    }
}

#[test]
fn stamps_of_frames_and_seam_points_come_back() {
    let (items, _) = read_items(&recorded(entries(8)));
    let decoded = |topic, schema| {
        let bytes = messages(&items, topic)[0].3;
        message::decode(schema, "protobuf", bytes).unwrap()
    };
    let Content::Frame(stamps) = decoded("/camera/frame", "trueline.Frame") else { panic!() };
    let wanted = frame(0);
    // Zero is a time like others; it is not the same as none.
    assert_eq!((stamps.first_packet_ns, stamps.complete_ns), (Some(0), None));
    assert_eq!((stamps.frame, stamps.stamp_ns), (wanted.frame, wanted.stamp_ns));
    assert_eq!((stamps.device_ns, stamps.exposure_us), (wanted.device_ns, Some(0.0)));
    assert_eq!((stamps.signals, stamps.signals.counter), (wanted.signals, None));
    assert_eq!((stamps.status, stamps.picture_bytes), (wanted.status, wanted.png.len() as u64));
    let Content::Features(features) = decoded("/sensor/features", "trueline.Features") else { panic!() };
    assert_eq!(features, [profile(1), profile(2)]);
}

#[test]
fn a_recording_says_what_it_is() {
    let (items, _) = read_items(&recorded(Vec::new()));
    let mut told = 0;
    for item in items {
        match item {
            Item::Attachment { name, data } => {
                assert_eq!((name.as_str(), data.as_slice()), ("sensor.toml", SENSOR.as_bytes()));
                told += 1;
            }
            Item::Metadata { name, values } => {
                assert_eq!(name, "trueline");
                assert_eq!(values["stamp_meaning"], "middle of the exposure");
                assert_eq!(values["version"], env!("CARGO_PKG_VERSION"));
                told += 1;
            }
            Item::Message { .. } => panic!("nothing was recorded"),
        }
    }
    assert_eq!(told, 2);
}

#[test]
fn a_recording_becomes_a_dataset() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.mcap");
    let recorder = Recorder::create(&file, &about()).unwrap();
    for entry in entries(64) {
        assert!(recorder.handle().offer(entry));
    }
    let done = recorder.finish().unwrap();
    assert_eq!((done.refused, done.bytes), (0, file.metadata().unwrap().len()));
    let out = folder.path().join("scan");
    let unpacked = unpack(&file, &Choice::default(), &out).unwrap();
    assert!(unpacked.damages.is_empty());
    assert_eq!(unpacked.notes, ["8 frames did not come whole and have no picture"]);
    assert_eq!(std::fs::read_to_string(out.join("sensor.toml")).unwrap(), SENSOR);
    let recording = folder::read(&out).unwrap();
    for (k, sample) in (0..64).zip(&recording.robot) {
        assert_eq!((sample.stamp_ns, sample.device_ns), (robot(k).steady_ns, Some(robot(k).device_ns)));
        // Millimetres in decimals: a unit in the last place of a metre or two.
        let error = sample.base_from_tool.translation.vector - robot(k).base_from_tool.translation.vector;
        assert!(error.norm() < 1e-15);
    }
    assert_eq!(recording.features.len(), 16);
    assert_eq!(recording.features[1], profile(2));
    let frames = images::read_index(&out).unwrap();
    for (k, read) in (0..64).step_by(8).zip(&frames) {
        let FrameEntry { frame, stamp_ns, device_ns, png, .. } = frame(k);
        assert_eq!((read.frame, read.stamp_ns, read.device_ns), (frame, stamp_ns, device_ns));
        assert_eq!(std::fs::read(&read.path).unwrap(), png, "pictures are passed on as they are");
    }
    assert_eq!(frames.len(), 8);
}

#[test]
fn stored_pictures_shrink_in_the_recording_and_in_the_folder_and_come_back() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.mcap");
    // A dark picture with a stripe: 480 kB that shrink to nearly nothing.
    let mut levels = vec![7_u8; 800 * 600];
    levels[800 * 300..800 * 303].fill(200);
    let image = GrayImage { width: 800, height: 600, pixels: Pixels::Eight(levels) };
    let png = gray_png::encode_gray(&image).unwrap();
    // The same cut off: it is looked at by whoever wants to find a seam in it, and stops nothing here.
    let cut = [&png[..png.len() / 2], &vec![0; png.len() / 2 + 1]].concat();
    let recorder = Recorder::create(&file, &about()).unwrap();
    for entry in entries(64) {
        let entry = match entry {
            Entry::Frame(taken) if !taken.png.is_empty() => {
                let png = if taken.stamp_ns == frame(8).stamp_ns { &cut } else { &png };
                Entry::Frame(FrameEntry { png: png.clone(), ..taken })
            }
            other => other,
        };
        assert!(recorder.handle().offer(entry));
    }
    let done = recorder.finish().unwrap();
    // Two streams of the robot and the heads are about 60 kB; eight pictures stored would be 3,840 kB.
    assert!(done.bytes < 200_000, "{}", done.bytes);
    let out = folder.path().join("scan");
    assert!(unpack(&file, &Choice::default(), &out).unwrap().damages.is_empty());
    let frames = images::read_index(&out).unwrap();
    assert_eq!(frames.len(), 8);
    for (k, frame) in frames.iter().enumerate() {
        let bytes = std::fs::read(&frame.path).unwrap();
        if k == 1 {
            assert_eq!(bytes, cut);
            continue;
        }
        assert!(bytes.len() < 48_000, "{}", bytes.len());
        assert_eq!(gray_png::read(&frame.path, &mut Vec::new()).unwrap(), image);
    }
}

#[test]
fn recordings_and_datasets_are_never_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.mcap");
    std::fs::write(&file, b"precious").unwrap();
    let error = Recorder::create(&file, &about()).err().unwrap();
    assert!(matches!(&error, RecordError::AlreadyExists { .. }) && error.to_string().contains("a.mcap"));
    assert_eq!(std::fs::read(&file).unwrap(), b"precious");
    std::fs::write(&file, recorded(entries(8))).unwrap();
    for (out, words) in
        [("scan", "it is not overwritten"), ("scan.unfinished", "`mine` in this folder would be lost")]
    {
        std::fs::create_dir(folder.path().join(out)).unwrap();
        std::fs::write(folder.path().join(out).join("mine"), b"precious").unwrap();
        let error = unpack(&file, &Choice::default(), &folder.path().join("scan")).unwrap_err();
        assert!(error.to_string().contains(words), "{error}");
        assert_eq!(std::fs::read(folder.path().join(out).join("mine")).unwrap(), b"precious");
        std::fs::remove_dir_all(folder.path().join(out)).unwrap();
    }
}

#[test]
fn a_file_that_cannot_be_made_is_told() {
    let error = Recorder::create(Path::new("/nowhere/a.mcap"), &about()).err().unwrap();
    assert!(matches!(error, RecordError::Create { .. }) && !error.hint().is_empty());
}

#[test]
fn nothing_is_accepted_behind_the_end() {
    let memory = Memory::default();
    let recorder = Recorder::onto(memory.clone(), Path::new("memory"), &about()).unwrap();
    let handle = recorder.handle();
    assert!(handle.offer(Entry::Robot(robot(0))));
    assert_eq!(recorder.finish().unwrap().written, 1);
    assert!(!handle.offer(Entry::Robot(robot(1))));
    let state = handle.state();
    assert_eq!((state.written, state.waiting, state.refused, state.failure), (1, 0, 1, None));
    assert_eq!(state.bytes, memory.bytes().len() as u64);
}

/// A recording that is never finished by its writer is whole all the same.
#[test]
fn a_dropped_recorder_ends_its_recording() {
    let memory = Memory::default();
    let recorder = Recorder::onto(memory.clone(), Path::new("memory"), &about()).unwrap();
    assert!(recorder.handle().offer(Entry::Robot(robot(0))));
    drop(recorder);
    let (items, damages) = read_items(&memory.bytes());
    assert!(damages.is_empty() && messages(&items, "/tf").len() == 1);
}

/// Accepted data reach the operating system a moment later, also if nothing follows.
#[test]
fn entries_are_handed_over_while_nothing_follows() {
    let memory = Memory::default();
    let recorder = Recorder::onto(memory.clone(), Path::new("memory"), &about()).unwrap();
    for k in 0..2 {
        assert!(recorder.handle().offer(Entry::Robot(robot(k))));
        let deadline = Instant::now() + Duration::from_secs(5);
        while recorder.handle().state().written < u64::from(k) + 1 && Instant::now() < deadline {
            std::thread::sleep(Duration::from_millis(5));
        }
        let (items, _) = read_items(&memory.bytes());
        assert_eq!(messages(&items, "/tf").len() as u32, k + 1);
    }
    recorder.finish().unwrap();
}

/// A disk with room for so many bytes.
struct Full {
    memory: Memory,
    room: usize,
}

impl Write for Full {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let left = self.room - self.memory.bytes().len();
        if left == 0 {
            return Err(io::Error::from(io::ErrorKind::StorageFull));
        }
        self.memory.write(&bytes[..bytes.len().min(left)])
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Sink for Full {
    fn sync(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_full_disk_costs_what_was_not_written_and_nothing_else() {
    let whole = recorded(entries(4000)).len();
    let start = recorded(Vec::new()).len();
    // How the file is cut into chunks depends on when they are flushed: room for nearly all may be room for all.
    for room in (start..whole).step_by((whole - start) / 9).take(9) {
        let memory = Memory::default();
        let sink = Full { memory: memory.clone(), room };
        let recorder = Recorder::onto(sink, Path::new("disk"), &about()).unwrap();
        let handle = recorder.handle();
        let offered = entries(4000).len() as u64;
        let accepted = entries(4000).into_iter().filter(|entry| handle.offer(entry.clone())).count() as u64;
        let error = recorder.finish().err().unwrap();
        let RecordError::Stopped { written, refused, why, .. } = &error else { panic!("{error}") };
        assert!(accepted <= offered && *written < offered);
        assert_eq!(written + refused, offered);
        assert!(why.contains("no storage space"), "{why}");
        let state = handle.state();
        assert_eq!((state.written, state.waiting, state.refused), (*written, 0, *refused));
        assert!(!handle.offer(Entry::Robot(robot(0))), "after a failure nothing is accepted");

        let (items, damages) = read_items(&memory.bytes());
        assert!(!damages.is_empty(), "that it was not finished is told");
        let robots = messages(&items, "/tf").len() as u64;
        let expected =
            entries(4000).iter().take(*written as usize).filter(|e| matches!(e, Entry::Robot(_))).count();
        assert!(robots >= expected as u64, "what was flushed can be read");
        for (k, message) in (0..).zip(messages(&items, "/tf")) {
            assert_eq!(message.1, robot(k).steady_ns as u64);
        }
    }
}

#[test]
fn a_disk_that_is_full_from_the_start_leaves_no_file_behind() {
    let sink = Full { memory: Memory::default(), room: 100 };
    let error = Recorder::onto(sink, Path::new("disk"), &about()).err().unwrap();
    assert!(matches!(&error, RecordError::Create { why, .. } if why.contains("no storage space")), "{error}");
}

/// A disk that stands still until it is told to go on.
#[derive(Clone, Default)]
struct Stalled {
    memory: Memory,
    gate: Arc<(Mutex<Gate>, Condvar)>,
}

#[derive(Clone, Copy, Default, PartialEq)]
enum Gate {
    #[default]
    Open,
    Shut,
    Broken,
}

impl Stalled {
    fn set(&self, gate: Gate) {
        *self.gate.0.lock().unwrap() = gate;
        self.gate.1.notify_all();
    }
}

impl Write for Stalled {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let gate = self.gate.1.wait_while(self.gate.0.lock().unwrap(), |gate| *gate == Gate::Shut).unwrap();
        if *gate == Gate::Broken { Err(io::Error::other("broken")) } else { self.memory.write(bytes) }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Sink for Stalled {
    fn sync(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// If offering waited for the disk, this would not end: the disk goes on only after the last offer.
#[test]
fn a_disk_that_stands_still_refuses_entries_and_holds_up_nobody() {
    const OFFERED: u64 = 150_000;
    let sink = Stalled::default();
    let recorder = Recorder::onto(sink.clone(), Path::new("disk"), &about()).unwrap();
    let handle = recorder.handle();
    sink.set(Gate::Shut);
    let mut accepted = 0;
    for k in 0..OFFERED {
        accepted += u64::from(handle.offer(Entry::Robot(robot(k as u32))));
    }
    let state = handle.state();
    assert!((65_536..OFFERED).contains(&accepted), "{accepted}");
    assert_eq!(state.refused, OFFERED - accepted);
    assert_eq!(state.written + state.waiting, accepted);
    sink.set(Gate::Open);
    let done = recorder.finish().unwrap();
    assert_eq!((done.written, done.refused), (accepted, OFFERED - accepted));
    let (items, damages) = read_items(&sink.memory.bytes());
    assert!(damages.is_empty());
    assert_eq!(messages(&items, "/tf").len() as u64, accepted);
}

#[test]
fn pictures_that_wait_are_bounded_in_bytes() {
    const BYTES: usize = 100 << 20;
    let picture = |bytes| Entry::Frame(FrameEntry { png: vec![0; bytes], ..frame(0) });
    let sink = Stalled::default();
    let recorder = Recorder::onto(sink.clone(), Path::new("disk"), &about()).unwrap();
    let handle = recorder.handle();
    sink.set(Gate::Shut);
    // 1 GiB is ten of them; one more may be in a chunk, and one in the hands of the writer.
    let accepted = (0..20).filter(|_| handle.offer(picture(BYTES))).count();
    assert!((10..=12).contains(&accepted), "{accepted}");
    assert!(handle.offer(Entry::Robot(robot(0))), "the robot does not suffer from the camera");
    assert!(!handle.offer(picture(200 << 20)), "what could not be read back is not taken");
    assert_eq!(handle.state().refused, 21 - accepted as u64);
    sink.set(Gate::Broken);
    let error = recorder.finish().err().unwrap();
    assert!(matches!(&error, RecordError::Stopped { written: 0, .. }), "{error}");
}

#[test]
fn no_seam_points_are_no_message() {
    let (items, damages) = read_items(&recorded(vec![Entry::Features(FeaturesEntry { features: vec![] })]));
    assert!(damages.is_empty() && messages(&items, "/sensor/features").is_empty());
}
