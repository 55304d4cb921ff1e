//! Faulty recordings: reported, or refused with the reason.

use crate::common;

use common::{
    Foreign, Unpacked, about, compressed_image, png, pose, pose_stamped, pose_xyzw, profiler, robot, tf,
    unpack, write_foreign,
};
use foxglove::messages::{self as fx, Quaternion, Timestamp, Vector3};
use prost::Message;
use std::path::PathBuf;
use trueline_dataset::{RobotSample, Sensor, gray_png, images, robot_csv};
use trueline_geometry::{Pose, se3};
use trueline_mcap::{Choice, ContentError, Entry, FeaturesEntry, ImportError, Recorder, RobotEntry};

struct Scan {
    folder: tempfile::TempDir,
}

impl Scan {
    fn of(messages: &[Foreign]) -> Self {
        let scan = Self { folder: tempfile::tempdir().unwrap() };
        write_foreign(&scan.file(), messages);
        scan
    }

    fn own(entries: Vec<Entry>, sensor: &str) -> Self {
        let scan = Self { folder: tempfile::tempdir().unwrap() };
        let about = trueline_mcap::About { sensor_toml: Some(sensor.to_owned()), ..about() };
        let recorder = Recorder::create(&scan.file(), &about).unwrap();
        for entry in entries {
            assert!(recorder.handle().offer(entry));
        }
        recorder.finish().unwrap();
        scan
    }

    fn file(&self) -> PathBuf {
        self.folder.path().join("a.mcap")
    }

    fn out(&self) -> PathBuf {
        self.folder.path().join("scan")
    }

    fn unpack(&self, choice: &Choice) -> Result<Unpacked, ImportError> {
        unpack(&self.file(), choice, &self.out())
    }

    fn robot(&self) -> Vec<RobotSample> {
        let file = self.out().join("robot.csv");
        robot_csv::read(&file, std::fs::read(&file).unwrap().as_slice()).unwrap()
    }
}

fn choice() -> Choice {
    Choice { sensor: profiler(), ..Choice::default() }
}

fn framed(base: &str, tool: &str) -> Choice {
    Choice { base_frame: Some(base.to_owned()), tool_frame: Some(tool.to_owned()), ..choice() }
}

fn at(ms: i64) -> i64 {
    5_000_000_000 + ms * 1_000_000
}

#[test]
fn poses_out_of_order_are_sorted_and_told() {
    let stamps = [0, 10, 20, 15, 15, 30];
    let poses: Vec<_> =
        stamps.iter().zip(0..).map(|(ms, k)| pose_stamped("/pose", at(*ms), "base", &pose(k))).collect();
    let scan = Scan::of(&poses);
    let unpacked = scan.unpack(&choice()).unwrap();
    assert_eq!(
        unpacked.notes,
        [
            "2 robot poses were recorded behind later ones and have been sorted by stamp",
            "1 robot poses have the stamp of the one before",
            "the recording has neither pictures nor profiles nor seam points"
        ]
    );
    let robot = scan.robot();
    assert_eq!(robot.iter().map(|s| s.stamp_ns).collect::<Vec<_>>(), [0, 10, 15, 15, 20, 30].map(at));
    // Items of one stamp in their order of arrival.
    for (sample, k) in robot.iter().zip([0, 1, 3, 4, 2, 5]) {
        assert!((sample.base_from_tool.translation.vector - pose(k).translation.vector).norm() < 1e-15);
    }
}

#[test]
fn own_poses_that_repeat_a_stamp_are_told() {
    let entry = |k: u32, ms| Entry::Robot(RobotEntry { steady_ns: at(ms), ..robot(k) });
    let scan = Scan::own(vec![entry(0, 4), entry(1, 4), entry(2, 0)], "kind = \"profiler\"");
    let unpacked = scan.unpack(&Choice::default()).unwrap();
    assert_eq!(unpacked.robot, 3);
    assert_eq!(
        unpacked.notes[0],
        "1 robot poses were recorded behind later ones and have been sorted by stamp"
    );
    assert_eq!(unpacked.notes[1], "1 robot poses have the stamp of the one before");
    assert_eq!(scan.robot()[0].device_ns, Some(robot(2).device_ns));
}

#[test]
fn messages_without_stamps_are_refused() {
    let poses = [0, 1].map(|k| pose_stamped("/pose", 0, "base", &pose(k)));
    let error = Scan::of(&poses).unpack(&choice()).unwrap_err();
    assert!(matches!(&error, ImportError::NotStamped { topic } if topic == "/pose"), "{error}");
    let links = [0, 1].map(|k| tf("/tf", &[(0, "a", "b", pose(k))]));
    let error = Scan::of(&links).unpack(&choice()).unwrap_err();
    assert!(matches!(&error, ImportError::NotStamped { topic } if topic == "a → b"), "{error}");
    let mut messages = Vec::from([1, 2].map(|k| pose_stamped("/pose", at(k), "base", &pose(0))));
    messages.extend([0, 0].map(|ns| compressed_image("/image", ns, "png", &png(0))));
    let error = Scan::of(&messages).unpack(&choice()).unwrap_err();
    assert!(matches!(&error, ImportError::NotStamped { topic } if topic == "/image"), "{error}");
}

#[test]
fn a_jpeg_is_refused_whatever_it_says_it_is() {
    let mut messages = vec![pose_stamped("/pose", at(0), "base", &pose(0))];
    messages.push(compressed_image("/image", at(0), "mono8; png compressed", &png(0)));
    messages.push(compressed_image("/image", at(5), "png", &[0xff, 0xd8, 0xff, 0xe0]));
    let error = Scan::of(&messages).unpack(&choice()).unwrap_err();
    assert_eq!(error.to_string(), "/image, message 2 at 0.000000007 s: the picture is a JPEG");
    assert!(error.hint().contains("record raw pictures"), "{}", error.hint());
    // A palette, and nothing known.
    let mut color = png(0);
    color[25] = 3;
    for (bytes, words) in [(color.as_slice(), "png of 8 bits, colour type 3"), (b"RIFF", "webp")] {
        messages.truncate(1);
        messages.push(compressed_image("/image", at(0), "webp", bytes));
        let error = Scan::of(&messages).unpack(&choice()).unwrap_err();
        assert!(error.to_string().contains(words), "{error}");
    }
}

#[test]
fn a_message_that_cannot_be_used_is_named() {
    let mut broken = pose(1);
    broken.translation.vector.x = f64::NAN;
    let messages =
        [pose_stamped("/pose", at(0), "base", &pose(0)), pose_stamped("/pose", at(1), "base", &broken)];
    let error = Scan::of(&messages).unpack(&choice()).unwrap_err();
    assert_eq!(error.to_string(), "/pose, message 2 at 0.000000006 s: position is not finite");
    let mut long = pose_stamped("/pose", at(1), "base", &pose(0));
    let w = long.bytes.len() - 8;
    long.bytes[w..].copy_from_slice(&2.0_f64.to_le_bytes());
    let error = Scan::of(&[long]).unpack(&choice()).unwrap_err();
    assert!(matches!(error, ImportError::Message { problem: ContentError::QuaternionNotUnit { .. }, .. }));
    // Unneeded parts may be broken.
    let mut messages = Vec::from(messages);
    messages[1].topic = "/other";
    let wanted = Choice { pose_topic: Some("/pose".to_owned()), ..choice() };
    let survey = trueline_mcap::survey(&Scan::of(&messages).file()).unwrap();
    assert_eq!(survey.topics[0].problem, Some(ContentError::NotFinite { field: "position" }));
    assert_eq!(Scan::of(&messages).unpack(&wanted).unwrap().robot, 1);
}

#[test]
fn several_candidates_are_listed() {
    let poses = ["/a", "/b"].map(|topic| pose_stamped(topic, at(0), "base", &pose(0)));
    let error = Scan::of(&poses).unpack(&choice()).unwrap_err();
    assert_eq!(error.to_string(), "several topics have robot poses: /a, /b");
    let mut messages = vec![pose_stamped("/pose", at(0), "base", &pose(0))];
    messages.extend(["/left", "/right"].map(|topic| compressed_image(topic, at(0), "png", &png(0))));
    let error = Scan::of(&messages).unpack(&choice()).unwrap_err();
    assert_eq!(error.to_string(), "several topics have pictures or profiles: /left, /right");
    let scan = Scan::of(&messages);
    let right = Choice { image_topic: Some("/right".to_owned()), ..choice() };
    assert_eq!(scan.unpack(&right).unwrap().frames, 1);
}

#[test]
fn a_recording_without_a_robot_is_refused() {
    let error = Scan::of(&[compressed_image("/image", at(0), "png", &png(0))]).unpack(&choice()).unwrap_err();
    assert_eq!(
        error.to_string(),
        "the recording has no robot poses; its topics are: /image (sensor_msgs/CompressedImage)"
    );
    assert!(matches!(
        Scan::own(Vec::new(), "kind = \"profiler\"").unpack(&choice()),
        Err(ImportError::NoRobot { .. })
    ));
}

#[test]
fn frames_that_are_not_what_they_should_be_are_refused() {
    let still = Pose::identity();
    let moving = |k: u32, parent, child| tf("/tf", &[(at(i64::from(k)), parent, child, pose(k))]);
    let refusal = |messages: &[Foreign], choice: &Choice| Scan::of(messages).unpack(choice).unwrap_err();

    let two = [moving(0, "a", "b"), moving(1, "c", "d")];
    assert!(matches!(refusal(&two, &framed("a", "d")), ImportError::NoChain { .. }));
    assert!(matches!(refusal(&two, &framed("a", "a")), ImportError::NoChain { .. }));
    assert!(matches!(refusal(&two, &choice()), ImportError::FramesNeeded { .. }));

    let parents = [moving(0, "a", "tool"), moving(1, "b", "tool"), tf("/tf_static", &[(0, "a", "b", still)])];
    assert!(matches!(refusal(&parents, &framed("a", "tool")), ImportError::SeveralParents { .. }));

    let mut moved = vec![moving(0, "a", "b"), moving(1, "a", "b")];
    moved.extend([0, 1].map(|k| tf("/tf_static", &[(0, "b", "tool", pose(k))])));
    let error = refusal(&moved, &framed("a", "tool"));
    assert!(matches!(&error, ImportError::StaticChanged { link } if link == "b → tool"), "{error}");

    let apart: Vec<Foreign> =
        (0..4).map(|k| moving(k, "a", "b")).chain((10..14).map(|k| moving(k, "b", "tool"))).collect();
    assert!(matches!(refusal(&apart, &framed("a", "tool")), ImportError::NeverTogether { .. }));
}

/// A slow link between fast ones: at constant speed and without rotation, interpolation is exact but for rounding.
#[test]
fn transforms_with_stamps_of_their_own_are_interpolated_within_their_span() {
    let x = |metres: f64| pose_xyzw([metres, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]);
    let mut messages = Vec::new();
    for k in 0..50 {
        messages.push(tf("/tf", &[(at(10 * k), "base", "rail", x(k as f64 * 0.01))]));
        if k % 4 == 2 {
            messages.push(tf("/rail_tf", &[(at(10 * k + 3), "rail", "tool", x(0.1 * (10 * k + 3) as f64))]));
        }
    }
    let scan = Scan::of(&messages);
    let unpacked = scan.unpack(&framed("base", "tool")).unwrap();
    let robot = scan.robot();
    // 50 stamps of the one and 12 of the other; known together from 23 ms to 463 ms, that is 44 and 12.
    assert_eq!(robot.len(), 56);
    assert_eq!(
        unpacked.notes[..3],
        [
            "56 robot poses were composed of 2 transforms",
            "6 stamps were left out, because a transform is missing there",
            "56 poses have a transform that was interpolated between its own stamps"
        ]
    );
    for sample in robot {
        let ms = (sample.stamp_ns - at(0)) as f64 * 1e-6;
        // Numbers below 50 with a relative error of a few 2⁻⁵³; times are seconds from the first stamp.
        assert!((sample.base_from_tool.translation.vector.x - (0.001 * ms + 0.1 * ms)).abs() < 1e-12);
    }
}

#[test]
fn a_transform_that_is_sent_twice_counts_once_and_the_last_time() {
    let mut messages: Vec<Foreign> =
        (0..5).map(|k| tf("/tf", &[(at(i64::from(k)), "/base", "tool", pose(k))])).collect();
    messages.push(tf("/tf", &[(at(2), "base", "/tool", pose(9))]));
    let scan = Scan::of(&messages);
    let unpacked = scan.unpack(&choice()).unwrap();
    assert_eq!(
        unpacked.notes[..3],
        [
            "5 robot poses were composed of 1 transforms",
            "1 transforms were recorded behind later ones and have been sorted by stamp",
            "1 transforms repeated a stamp; of those the last one counts"
        ]
    );
    let error = se3::difference_decoupled(&scan.robot()[2].base_from_tool, &pose(9));
    assert!(error.0.norm() < 1e-15 && error.1.norm() < 1e-15);
}

/// A robot that stands still publishes all the same.
#[test]
fn a_robot_that_does_not_move_has_poses() {
    let messages: Vec<Foreign> = (0..5).map(|k| tf("/tf", &[(at(k), "base", "tool", pose(0))])).collect();
    assert_eq!(Scan::of(&messages).unpack(&choice()).unwrap().robot, 5);
}

fn foxglove_stamp(ms: i64) -> Option<Timestamp> {
    let ns = at(ms);
    Some(Timestamp::new((ns / 1_000_000_000) as u32, (ns % 1_000_000_000) as u32))
}

fn foxglove_message(topic: &'static str, schema: &'static str, message: &impl Message) -> Foreign {
    Foreign { topic, schema, encoding: "protobuf", bytes: message.encode_to_vec() }
}

fn pose_in_frame(k: u32) -> fx::PoseInFrame {
    let (p, q) = (pose(k).translation.vector, pose(k).rotation);
    fx::PoseInFrame {
        timestamp: foxglove_stamp(i64::from(k)),
        frame_id: "base".to_owned(),
        pose: Some(fx::Pose {
            position: Some(Vector3 { x: p.x, y: p.y, z: p.z }),
            orientation: Some(Quaternion { x: q.i, y: q.j, z: q.k, w: q.w }),
        }),
    }
}

#[test]
fn colours_of_two_bytes_are_gray_levels_of_sixteen_bits() {
    let image = |k: i64, encoding: &str, samples: &[u16]| fx::RawImage {
        timestamp: foxglove_stamp(k),
        frame_id: "camera".to_owned(),
        width: 2,
        height: 2,
        encoding: encoding.to_owned(),
        step: samples.len() as u32,
        data: samples.iter().flat_map(|sample| sample.to_le_bytes()).collect::<Vec<u8>>().into(),
    };
    let [red, green, blue] = [60_000, 20_000, 8_000];
    let scan = Scan::of(&[
        foxglove_message("/pose", "foxglove.PoseInFrame", &pose_in_frame(3)),
        foxglove_message(
            "/image",
            "foxglove.RawImage",
            &image(1, "bayer_grbg16", &[green, red, blue, green]),
        ),
        foxglove_message("/image", "foxglove.RawImage", &image(2, "rgb16", &[red, green, blue].repeat(4))),
        foxglove_message("/image", "foxglove.RawImage", &image(3, "bgr16", &[blue, green, red].repeat(4))),
        foxglove_message("/image", "foxglove.RawImage", &image(4, "rgba16", &[65_535; 16])),
    ]);
    assert_eq!(scan.unpack(&choice()).unwrap().frames, 4);
    let frames = images::read_index(&scan.out()).unwrap();
    // A mosaic: (red + 2 green + blue) / 4. Colours: 0.299 red + 0.587 green + 0.114 blue. White stays white.
    for (frame, level) in frames.iter().zip([27_000, 30_592, 30_592, 65_535]) {
        let pixels = gray_png::read(&frame.path, &mut Vec::new()).unwrap().pixels;
        assert_eq!(pixels, trueline_dataset::Pixels::Sixteen(vec![level; 4]));
    }
    // Eight bits where sixteen are named: half of the bytes.
    let short = fx::RawImage { step: 2, ..image(1, "bayer_rggb16", &[1, 2]) };
    let scan = Scan::of(&[
        foxglove_message("/pose", "foxglove.PoseInFrame", &pose_in_frame(3)),
        foxglove_message("/image", "foxglove.RawImage", &short),
    ]);
    assert_ne!(scan.unpack(&choice()).map_or(0, |unpacked| unpacked.frames), 1);
}

#[test]
fn messages_of_foxglove_are_understood() {
    let image = |k: i64, encoding: &str, step, data: &'static [u8]| fx::RawImage {
        timestamp: foxglove_stamp(k),
        frame_id: "camera".to_owned(),
        width: 2,
        height: 2,
        encoding: encoding.to_owned(),
        step,
        data: data.into(),
    };
    let raw = "foxglove.RawImage";
    let scan = Scan::of(&[
        foxglove_message("/pose", "foxglove.PoseInFrame", &pose_in_frame(3)),
        foxglove_message("/image", raw, &image(1, "mono8", 3, &[1, 2, 0, 3, 4, 0])),
        foxglove_message("/image", raw, &image(2, "16UC1", 4, &[1, 2, 3, 4, 5, 6, 7, 8])),
    ]);
    assert_eq!(scan.unpack(&choice()).unwrap().frames, 2);
    assert_eq!(scan.robot()[0].stamp_ns, at(3));
    let frames = images::read_index(&scan.out()).unwrap();
    let pixels = |k: usize| gray_png::read(&frames[k].path, &mut Vec::new()).unwrap().pixels;
    assert_eq!(pixels(0), trueline_dataset::Pixels::Eight(vec![1, 2, 3, 4]));
    assert_eq!(pixels(1), trueline_dataset::Pixels::Sixteen(vec![0x0201, 0x0403, 0x0605, 0x0807]));

    let transform = |k: u32| {
        let fx::PoseInFrame { timestamp, pose, .. } = pose_in_frame(k);
        let pose = pose.unwrap();
        fx::FrameTransform {
            timestamp,
            parent_frame_id: "base".to_owned(),
            child_frame_id: "tool".to_owned(),
            translation: pose.position,
            rotation: pose.orientation,
        }
    };
    let both = fx::FrameTransforms { transforms: vec![transform(1), transform(2)] };
    let scan = Scan::of(&[
        foxglove_message("/tf", "foxglove.FrameTransform", &transform(0)),
        foxglove_message("/tfs", "foxglove.FrameTransforms", &both),
    ]);
    assert_eq!(scan.unpack(&choice()).unwrap().robot, 3);
    assert_eq!(scan.robot()[2].stamp_ns, at(2));
}

/// Nothing is a message too, and reads as zeros.
#[test]
fn messages_of_foxglove_with_parts_missing_are_refused() {
    let problem = |change: fn(&mut fx::PoseInFrame)| {
        let mut message = pose_in_frame(0);
        change(&mut message);
        let scan = Scan::of(&[foxglove_message("/pose", "foxglove.PoseInFrame", &message)]);
        match scan.unpack(&choice()).unwrap_err() {
            ImportError::Message { problem, .. } => problem,
            other => panic!("{other}"),
        }
    };
    let missing = |field| ContentError::Missing { field };
    assert_eq!(problem(|m| m.timestamp = None), missing("the timestamp"));
    assert_eq!(problem(|m| m.pose = None), missing("the pose"));
    assert_eq!(problem(|m| m.pose.as_mut().unwrap().position = None), missing("the position"));
    assert_eq!(problem(|m| m.pose.as_mut().unwrap().orientation = None), missing("the rotation"));
}

/// The crate of foxglove reads such seconds as zero.
#[test]
fn a_time_that_is_none_is_refused() {
    #[derive(Clone, PartialEq, Message)]
    struct Stamp {
        #[prost(message, optional, tag = "1")]
        timestamp: Option<prost_types::Timestamp>,
    }
    for (seconds, nanos) in [(i64::MAX, 0), (i64::MIN, 0), (5, -1), (5, 1_000_000_000)] {
        let mut message = pose_in_frame(0);
        message.timestamp = None;
        let mut bytes = message.encode_to_vec();
        bytes.extend(Stamp { timestamp: Some(prost_types::Timestamp { seconds, nanos }) }.encode_to_vec());
        let scan = Scan::of(&[Foreign {
            topic: "/pose",
            schema: "foxglove.PoseInFrame",
            encoding: "protobuf",
            bytes,
        }]);
        let error = scan.unpack(&choice()).unwrap_err();
        assert!(matches!(error, ImportError::Message { .. }), "{error}");
    }
}

/// Of a frame of trueline, as far as it matters here.
#[derive(Clone, PartialEq, Message)]
struct Frame {
    #[prost(uint64, tag = "1")]
    frame: u64,
    #[prost(int64, tag = "2")]
    stamp_ns: i64,
    #[prost(int64, optional, tag = "5")]
    device_ns: Option<i64>,
    #[prost(uint64, tag = "8")]
    picture_bytes: u64,
}

/// Times of these messages are 5, 6, 7, … ns, and they have no numbers.
#[test]
fn own_pictures_and_records_that_lost_each_other_are_told() {
    let record = |frame, stamp_ns| {
        let frame = Frame { frame, stamp_ns, device_ns: Some(0), picture_bytes: 9 };
        foxglove_message("/camera/frame", "trueline.Frame", &frame)
    };
    let picture = || {
        let picture =
            fx::CompressedImage { data: png(1).into(), timestamp: foxglove_stamp(0), ..Default::default() };
        foxglove_message("/camera/image", "foxglove.CompressedImage", &picture)
    };
    let (p, q) = (Some(Vector3::default()), Some(Quaternion { w: 1.0, ..Default::default() }));
    let tf = fx::FrameTransform {
        timestamp: foxglove_stamp(0),
        parent_frame_id: "base".to_owned(),
        child_frame_id: "tool".to_owned(),
        translation: p,
        rotation: q,
    };
    let tf = foxglove_message("/tf", "foxglove.FrameTransform", &tf);
    // The one at 7 ns has its record, those at 8 and 10 have none, and the one of 77 ns has no picture.
    let messages = [tf, record(1 << 40, 7), picture(), picture(), record(0, 77), picture()];
    let scan = Scan::of(&messages);
    let unpacked = scan.unpack(&choice()).unwrap();
    assert_eq!(unpacked.notes.len(), 3, "{:?}", unpacked.notes);
    assert!(unpacked.notes[0].starts_with("1 frames have lost their picture"), "{:?}", unpacked.notes);
    assert!(unpacked.notes[1].starts_with("2 pictures have lost their record"), "{:?}", unpacked.notes);
    assert!(unpacked.notes[2].starts_with("2 frames have no stamp of the camera's own clock"));
    let frames = images::read_index(&scan.out()).unwrap();
    assert_eq!(
        frames.iter().map(|f| (f.stamp_ns, f.frame)).collect::<Vec<_>>(),
        [(7, 1 << 40), (8, 0), (10, 0)]
    );
    assert!(frames.iter().all(|f| f.device_ns.is_none()), "a column is there for all or for none");
    // The robot's stamp is the time of the message, and the controller's is when it was published.
    assert_eq!((scan.robot()[0].stamp_ns, scan.robot()[0].device_ns), (5, Some(5)));
}

#[test]
fn a_given_sensor_goes_before_the_recorded_one() {
    let scan = Scan::own(vec![Entry::Robot(robot(0))], "kind = \"points\"");
    let unpacked = scan.unpack(&choice()).unwrap();
    assert_eq!(unpacked.notes[0], "the recorded sensor was left aside for the given one");
    assert_eq!(trueline_dataset::folder::read_sensor(&scan.out()).unwrap(), Sensor::Profiler);
    let broken = Scan::own(vec![Entry::Robot(robot(0))], "kind = 7");
    assert!(matches!(broken.unpack(&Choice::default()), Err(ImportError::Dataset(_))));
}

#[test]
fn seam_points_of_another_sensor_are_refused() {
    let points = Entry::Features(FeaturesEntry { features: vec![common::profile(0)] });
    let scan = Scan::own(vec![Entry::Robot(robot(0)), points], "kind = \"points\"");
    let error = scan.unpack(&Choice::default()).unwrap_err();
    assert!(matches!(error, ImportError::OtherSensor { sensor: "points" }), "{error}");
}

#[test]
fn frames_of_an_own_recording_have_their_names() {
    let scan = Scan::own(vec![Entry::Robot(robot(0))], "kind = \"profiler\"");
    let error = scan.unpack(&framed("base", "tool0")).unwrap_err();
    assert_eq!(error.to_string(), "no frame `tool0`; there are: base, tool");
    assert_eq!(scan.unpack(&framed("base", "tool")).unwrap().robot, 1);
}
