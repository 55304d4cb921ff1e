//! The live view: what is recorded reaches viewers as it is, and a viewer that stalls costs a bounded memory and nobody's time.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "it/viewer/mod.rs"]
mod viewer;

use foxglove::messages::{FrameTransform, PointCloud};
use peak_alloc::PeakAlloc;
use prost::Message;
use serde_json::Value;
use std::net::{SocketAddr, TcpStream};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;
use trueline_geometry::Pose;
use trueline_mcap::live::{LiveChannels, LiveView, LogLevel, WELD_TOPIC};
use trueline_mcap::{About, CLOUD_TOPIC, Entry, Listener, Recorder, RobotEntry};
use viewer::Viewer;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

fn view() -> LiveView {
    LiveView::start(SocketAddr::from(([127, 0, 0, 1], 0)), "a test").unwrap()
}

/// Until the server has heard what a viewer asked for.
fn until_wanted(channels: &LiveChannels, topic: &str) {
    while !channels.is_wanted(topic) {
        thread::sleep(Duration::from_millis(5));
    }
}

/// Publishes what a recorder writes.
struct Passes(LiveChannels);

impl Listener for Passes {
    fn entry(&self, _: &Entry) {}

    fn message(&self, topic: &str, log_ns: i64, bytes: &[u8]) {
        self.0.message(topic, log_ns, bytes);
    }
}

fn packet(k: i64) -> Entry {
    Entry::Robot(RobotEntry {
        is_egm: false,
        datagram: vec![1, 2, 3],
        from: SocketAddr::from(([127, 0, 0, 1], 5)),
        steady_ns: 1_700_000_000_000_000_000 + 4_000_000 * k,
        kernel_wall_ns: None,
        read_wall_ns: 0,
        sequence: k as u32,
        device_ns: 7,
        ptp_ns: None,
        base_from_tool: Pose::translation(1e-3 * k as f64, 0.0, 0.5),
    })
}

#[test]
fn what_is_recorded_is_shown_as_it_is() {
    let view = view();
    let mut viewer = Viewer::connect(view.address());
    assert_eq!(view.viewers(), 1);
    assert_eq!(viewer.channels["/tf"]["schemaName"], "foxglove.FrameTransform");
    assert_eq!(viewer.channels["/estimate"]["schemaEncoding"], "jsonschema");
    viewer.subscribe(&["/tf"]);
    until_wanted(&view.channels(), "/tf");
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("recording.mcap");
    let passes = Arc::new(Passes(view.channels()));
    let recorder = Recorder::create_heard(&file, &About::default(), Some(passes)).unwrap();
    assert!((0..10).all(|k| recorder.handle().offer(packet(k))));
    recorder.finish().unwrap();
    for k in 0..10 {
        let (topic, stamp_ns, bytes) = viewer.message();
        let pose = FrameTransform::decode(&bytes[..]).unwrap();
        assert_eq!((topic.as_str(), stamp_ns), ("/tf", 1_700_000_000_000_000_000 + 4_000_000 * k));
        assert_eq!((pose.parent_frame_id.as_str(), pose.child_frame_id.as_str()), ("base", "tool"));
        assert_eq!(pose.translation.unwrap().x, 1e-3 * k as f64);
    }
}

#[test]
fn points_and_words_and_welds_are_shown() {
    let view = view();
    let channels = view.channels();
    let mut viewer = Viewer::connect(view.address());
    viewer.subscribe(&[CLOUD_TOPIC, "/log", WELD_TOPIC]);
    for topic in [CLOUD_TOPIC, "/log", WELD_TOPIC] {
        until_wanted(&channels, topic);
    }
    channels.points(CLOUD_TOPIC, 5_000_000_000, &[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]], &[1e-4, 2e-4]);
    let (_, stamp_ns, bytes) = viewer.message();
    let cloud = PointCloud::decode(&bytes[..]).unwrap();
    let names: Vec<&str> = cloud.fields.iter().map(|field| field.name.as_str()).collect();
    let numbers: Vec<f32> =
        cloud.data.chunks_exact(4).map(|bytes| f32::from_le_bytes(bytes.try_into().unwrap())).collect();
    assert_eq!((stamp_ns, cloud.frame_id.as_str(), cloud.point_stride), (5_000_000_000, "base", 16));
    assert_eq!(names, ["x", "y", "z", "sigma"]);
    assert_eq!(numbers, [1.0, 2.0, 3.0, 1e-4, 4.0, 5.0, 6.0, 2e-4]);
    channels.log(6, LogLevel::Warning, "late");
    assert_eq!(viewer.message().0, "/log");
    channels.json(WELD_TOPIC, 7, &serde_json::json!({ "weld": "a", "alarm": null }));
    let (topic, _, bytes) = viewer.message();
    let weld: Value = serde_json::from_slice(&bytes).unwrap();
    assert_eq!((topic.as_str(), &weld["weld"]), (WELD_TOPIC, &Value::from("a")));
}

#[test]
fn a_viewer_that_stalls_delays_nobody_and_takes_a_bounded_memory() {
    const PICTURE: usize = 1 << 18;
    let view = view();
    let channels = view.channels();
    let mut stalls = Viewer::connect(view.address());
    let mut looks = Viewer::connect(view.address());
    stalls.subscribe(&["/camera/image"]);
    looks.subscribe(&["/log"]);
    until_wanted(&channels, "/camera/image");
    until_wanted(&channels, "/log");
    let picture = vec![7_u8; PICTURE];
    let before = MEMORY.current_usage();
    MEMORY.reset_peak_usage();
    // 256 MB, and the viewer never reads: whoever waited for it would wait for ever.
    for k in 0..1024 {
        channels.message("/camera/image", k, &picture);
    }
    let grown = MEMORY.peak_usage().saturating_sub(before);
    // 64 messages in the queue; as many again for what is on its way through the socket.
    assert!(grown < 2 * 64 * PICTURE, "{grown}");
    channels.log(1, LogLevel::Info, "still here");
    assert_eq!(looks.message().0, "/log");
    drop(stalls);
}

/// Hangs at its first entry until the other end of the channel is gone.
struct Hangs(Mutex<Receiver<()>>);

impl Listener for Hangs {
    fn entry(&self, _: &Entry) {
        let _released = self.0.lock().unwrap().recv();
    }

    fn message(&self, _: &str, _: i64, _: &[u8]) {}
}

#[test]
fn a_listener_that_hangs_delays_no_pose_and_costs_none() {
    /// A minute at 250 Hz.
    const POSES: i64 = 15_000;
    let folder = tempfile::tempdir().unwrap();
    let (release, hangs) = channel();
    let listener = Arc::new(Hangs(Mutex::new(hangs)));
    let file = folder.path().join("recording.mcap");
    let recorder = Recorder::create_heard(&file, &About::default(), Some(listener)).unwrap();
    let handle = recorder.handle();
    // A source that waited for the listener would wait for ever.
    assert!((0..POSES).all(|k| handle.offer(packet(k))));
    assert_eq!(handle.state().written, 0);
    drop(release);
    let recorded = recorder.finish().unwrap();
    assert_eq!((recorded.of_cell, recorded.refused), (POSES as u64, 0));
}

#[cfg(target_os = "linux")]
#[test]
fn it_is_listened_at_the_named_address_alone() {
    let view = view();
    let other = SocketAddr::from(([127, 0, 0, 2], view.address().port()));
    assert!(TcpStream::connect(view.address()).is_ok());
    assert!(TcpStream::connect(other).is_err());
}

#[test]
fn an_address_that_is_taken_is_refused_with_words() {
    let view = view();
    let error = LiveView::start(view.address(), "another").err().expect("it is taken");
    assert!(error.to_string().contains(&view.address().to_string()), "{error}");
    assert!(error.hint().contains("port"));
}

#[test]
fn the_layout_that_is_shipped_shows_topics_that_there_are() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/foxglove.json");
    let layout: Value = serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap();
    let view = view();
    let channels = view.channels();
    let topics: Vec<&str> = channels.topics().collect();
    let mut named = 0;
    let mut look = |text: &str| {
        // `/estimate.time_offset_ms` is a field of a topic.
        if let Some(topic) = text.starts_with('/').then(|| text.split('.').next().unwrap()) {
            assert!(topics.contains(&topic), "{topic} is none of {topics:?}");
            named += 1;
        }
    };
    walk(&layout["configById"], &mut look);
    assert!(named >= 10, "{named}");
}

fn walk(value: &Value, look: &mut dyn FnMut(&str)) {
    match value {
        Value::String(text) => look(text),
        Value::Array(values) => values.iter().for_each(|value| walk(value, look)),
        Value::Object(values) => values.iter().for_each(|(key, value)| {
            look(key);
            walk(value, look);
        }),
        _ => {}
    }
}
