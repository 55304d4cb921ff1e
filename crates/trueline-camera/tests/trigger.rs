//! A camera that waits for a signal before each picture: its settings, the pictures that come and their times, and the
//! refusals by name.
#![cfg(feature = "gige")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod simulated;

use simulated::{Known, facts, patient, start, take, with};
use std::time::Duration;
use trueline_camera::device::{
    Chunks, Device, DeviceHandle, DeviceSettings, Edge, OutputMode, Pictures, RangeFeatures, TriggerOf,
};
use trueline_camera::{
    CameraError, CameraFrame, CameraSetup, FrameSource, GigeCamera, GigeSettings, Trigger, TriggerEdge,
};
use trueline_dataset::{GrayImage, Pixels};
use trueline_live::HostClock;

const MS: i64 = 1_000_000;
/// The signal is on for so long, ns.
const ON_NS: i64 = 7 * MS;

/// Its scene, and a signal on its input at irregular times.
struct Signalled<P> {
    looks_at: P,
    edges: Vec<Edge>,
}

impl<P: Pictures> Pictures for Signalled<P> {
    fn picture(&mut self, start_ns: i64, exposure_s: f64) -> Option<GrayImage> {
        self.looks_at.picture(start_ns, exposure_s)
    }

    fn edge_after(&mut self, steady_ns: i64) -> Option<Edge> {
        self.edges.iter().copied().find(|edge| edge.at_ns > steady_ns)
    }

    fn encoder(&mut self, steady_ns: i64) -> Option<i64> {
        // It counts downwards, below zero.
        Some(-(self.edges.iter().filter(|edge| edge.rises && edge.at_ns <= steady_ns).count() as i64))
    }

    fn line(&mut self, steady_ns: i64) -> bool {
        self.edges.iter().rfind(|edge| edge.at_ns <= steady_ns).is_some_and(|edge| edge.rises)
    }
}

/// A signal after each of so many milliseconds, over some seconds from now on.
fn signal(host: HostClock, apart_ms: &[i64]) -> Vec<Edge> {
    let mut at_ns = host.read().steady_ns;
    let steps = apart_ms.iter().cycle().take(100);
    let edges = steps.flat_map(|apart| {
        at_ns += apart * MS;
        [(at_ns, true), (at_ns + ON_NS, false)]
    });
    edges.map(|(at_ns, rises)| Edge { at_ns, rises }).collect()
}

fn known(settings: &DeviceSettings) -> Known {
    Known { width: settings.width as usize, height: settings.height as usize }
}

fn with_rate(mut settings: GigeSettings, fps: f64) -> GigeSettings {
    settings.setup.fps = Some(fps);
    settings
}

fn by_line(settings: &DeviceSettings, edge: Option<TriggerEdge>) -> GigeSettings {
    with(
        settings,
        CameraSetup {
            trigger: Trigger::Input { source: "Line1".to_owned(), edge },
            ..CameraSetup::default()
        },
    )
}

fn signalled(settings: &DeviceSettings, host: HostClock, edges: &[Edge]) -> DeviceHandle {
    let pictures = Signalled { looks_at: known(settings), edges: edges.to_vec() };
    Device::start(settings.clone(), host, pictures).unwrap()
}

/// When the pictures were exposed, ns.
fn exposed_ns(device: &DeviceHandle, frames: &[CameraFrame]) -> Vec<i64> {
    let sent = facts(device, frames);
    let of = |frame: &CameraFrame| sent.iter().find(|sent| Some(sent.device_ns) == frame.device_ns).unwrap();
    frames.iter().map(|frame| of(frame).exposure_start_ns).collect()
}

/// The signals that frames began with by their numbers, of which the first one's is known; ns. A number is left out where a busy machine
/// had no time for the picture; every signal has one all the same.
fn of_numbers(frames: &[CameraFrame], signals_ns: impl Iterator<Item = i64>, first_ns: i64) -> Vec<i64> {
    let signals_ns: Vec<i64> = signals_ns.skip_while(|at_ns| *at_ns < first_ns).collect();
    frames.iter().map(|frame| signals_ns[(frame.frame - frames[0].frame) as usize]).collect()
}

#[test]
fn every_signal_is_a_picture_at_its_time() {
    for (test, edge, heeded) in [
        (60, TriggerEdge::Rising, [true, false]),
        (61, TriggerEdge::Falling, [false, true]),
        (62, TriggerEdge::Any, [true, true]),
    ] {
        let host = HostClock::start();
        let settings = patient(test);
        let edges = signal(host, &[40, 23, 71, 30]);
        let device = signalled(&settings, host, &edges);
        let mut camera = GigeCamera::open(&by_line(&settings, Some(edge)), host).unwrap();
        assert_eq!(camera.about().trigger, Some(format!("Line1 {}", edge.name())));
        let frames = take(&mut camera, 12);
        assert_eq!(frames.len(), 12);
        let exposed = exposed_ns(&device, &frames);
        let heeded = edges.iter().filter(|edge| heeded[usize::from(!edge.rises)]).map(|edge| edge.at_ns);
        assert_eq!(exposed, of_numbers(&frames, heeded, exposed[0]), "{edge:?}");
        assert_eq!(device.counts().missed_triggers, 0);
    }
}

#[test]
fn signals_that_come_while_it_is_busy_are_missed_and_only_a_counter_tells() {
    let host = HostClock::start();
    let settings = DeviceSettings { chunks: Some(Chunks::Good), ..patient(63) };
    // Exposure and readout take 4 ms: of two signals, 2 ms apart, the second is missed.
    let mut edges = signal(host, &[50]);
    let more: Vec<Edge> = edges
        .iter()
        .filter(|edge| edge.rises)
        .flat_map(|edge| [(edge.at_ns + MS, false), (edge.at_ns + 2 * MS, true)])
        .map(|(at_ns, rises)| Edge { at_ns, rises })
        .collect();
    edges.extend(more);
    edges.sort_by_key(|edge| edge.at_ns);
    let device = signalled(&settings, host, &edges);
    let mut camera = GigeCamera::open(&by_line(&settings, Some(TriggerEdge::Rising)), host).unwrap();
    let frames = take(&mut camera, 8);
    assert!(device.counts().missed_triggers >= 7, "{:?}", device.counts());
    assert_eq!(camera.counts().missing, 0, "the stream's numbers know nothing of it");
    // It may have begun between two of them.
    for pair in frames[1..].windows(2) {
        let counted = |frame: &CameraFrame| frame.signals.counter.unwrap();
        assert_eq!((pair[1].frame - pair[0].frame, counted(&pair[1]) - counted(&pair[0])), (1, 2));
    }
}

#[test]
fn chunks_tell_what_was_on_the_inputs() {
    for (test, chunks) in [(64, Chunks::Good), (65, Chunks::Lying)] {
        let host = HostClock::start();
        let settings = DeviceSettings { chunks: Some(chunks), ..patient(test) };
        let edges = signal(host, &[31, 44]);
        let device = signalled(&settings, host, &edges);
        // By the falling edge the input is off when the picture begins.
        let mut camera = GigeCamera::open(&by_line(&settings, Some(TriggerEdge::Falling)), host).unwrap();
        let frames = take(&mut camera, 6);
        let exposed = exposed_ns(&device, &frames);
        for (frame, exposed_ns) in frames.iter().zip(exposed) {
            let steps = edges.iter().filter(|edge| edge.rises && edge.at_ns <= exposed_ns).count() as i64;
            let told = &frame.signals;
            if chunks == Chunks::Lying {
                assert!(told.is_empty(), "{told}");
            } else {
                assert_eq!((told.encoder, told.lines), (Some(-steps), Some(0b10)));
                assert_eq!((told.camera_frame, told.counter), (Some(frame.frame), Some(frame.frame as i64)));
            }
        }
        assert_eq!(camera.counts().bad_chunks, if chunks == Chunks::Lying { 6 } else { 0 });
    }
}

#[test]
fn a_camera_that_waits_gives_nothing_by_itself_and_off_lets_it_run() {
    let host = HostClock::start();
    let settings = patient(66);
    let device = start(&settings, host);
    for trigger in [TriggerOf::Frame, TriggerOf::Acquisition] {
        device.set_trigger(trigger, true);
        let as_set = with(&settings, CameraSetup { trigger: Trigger::AsSet, ..CameraSetup::default() });
        let mut camera = GigeCamera::open(&as_set, host).unwrap();
        let told = camera.about().trigger.clone().unwrap();
        assert!(told.starts_with("Line1 RisingEdge"), "{told}");
        assert!(camera.next(Duration::from_millis(400)).unwrap().is_none(), "nothing is wired");
        drop(camera);
        let mut camera = GigeCamera::open(&simulated::asked(&settings), host).unwrap();
        assert_eq!(camera.about().trigger, None);
        assert_eq!(take(&mut camera, 3).len(), 3);
        drop(camera);
    }
    // An input is named, and what would start the acquisition is turned off.
    device.set_trigger(TriggerOf::Acquisition, true);
    let camera = GigeCamera::open(&by_line(&settings, None), host).unwrap();
    assert_eq!(camera.about().trigger.as_deref(), Some("Line1 RisingEdge"));
}

#[test]
fn what_cannot_be_triggered_is_refused_by_name() {
    let host = HostClock::start();
    let settings = patient(67);
    let _device = start(&settings, host);
    let refused = |wanted: GigeSettings| GigeCamera::open(&wanted, host).err().unwrap().to_string();
    let input = |source: &str| Trigger::Input { source: source.to_owned(), edge: None };
    let told = refused(with(&settings, CameraSetup { trigger: input("Line7"), ..CameraSetup::default() }));
    assert_eq!(
        told,
        "camera feature `TriggerSource`: Line7 was requested; the camera offers Software, Line1, Line2"
    );
    let told = refused(with(&settings, CameraSetup { trigger: input("Software"), ..CameraSetup::default() }));
    assert!(told.contains("`TriggerSource`") && told.contains("this program does not support"), "{told}");
    let told = refused(with_rate(by_line(&settings, None), 20.0));
    assert!(told.contains("`AcquisitionFrameRate`") && told.contains("the trigger sets the rate"), "{told}");

    let without = DeviceSettings { can_be_triggered: false, ..patient(68) };
    let _device = start(&without, host);
    let error = GigeCamera::open(&by_line(&without, None), host).err().unwrap();
    assert_eq!(
        error.to_string(),
        "camera feature `TriggerMode`: the camera has no such feature: it cannot be triggered"
    );
    // It runs by itself all the same.
    assert_eq!(take(&mut GigeCamera::open(&simulated::asked(&without), host).unwrap(), 2).len(), 2);
}

/// Rows of a profiler that say when they were exposed.
struct Rows;

impl Pictures for Rows {
    fn picture(&mut self, exposure_start_ns: i64, _: f64) -> Option<GrayImage> {
        let pixels = Pixels::Sixteen(vec![1 + (exposure_start_ns / 1000 % 60_000) as u16; 64]);
        Some(GrayImage { width: 64, height: 1, pixels })
    }
}

#[test]
fn rows_that_an_encoder_begins_have_their_time_one_a_frame_and_are_refused_otherwise() {
    let range = RangeFeatures {
        along_mm: [0.125, 0.0],
        range_mm: [0.001, 0.0],
        invalid: 0,
        lines_hz: 400.0,
        output_mode: OutputMode::RectifiedC,
    };
    for (test, height) in [(69, 1), (70, 3)] {
        let host = HostClock::start();
        let small = DeviceSettings { width: 64, height, range: Some(range), ..patient(test) };
        let settings = DeviceSettings { exposure_us: 200.0, ..small };
        let edges = signal(host, &[33, 52, 24]);
        let pictures = Signalled { looks_at: Rows, edges: edges.clone() };
        let device = Device::start(settings.clone(), host, pictures).unwrap();
        device.set_trigger(TriggerOf::Row, true);
        let as_set = with(
            &settings,
            CameraSetup { trigger: Trigger::AsSet, profiles: true, ..CameraSetup::default() },
        );
        let opened = GigeCamera::open(&as_set, host);
        if height > 1 {
            let error = opened.err().unwrap();
            assert!(
                matches!(&error, CameraError::Feature { name, why } if name == "TriggerMode"
                    && why.contains("Line1 RisingEdge") && why.contains("Set Height to 1")),
                "{error}"
            );
            continue;
        }
        let mut camera = opened.unwrap();
        assert_eq!(camera.about().trigger.as_deref(), Some("Line1 RisingEdge, each a row"));
        let frames = take(&mut camera, 8);
        let exposed = exposed_ns(&device, &frames);
        let rising = edges.iter().filter(|edge| edge.rises).map(|edge| edge.at_ns);
        assert_eq!(exposed, of_numbers(&frames, rising, exposed[0]));
        for (frame, exposed_ns) in frames.iter().zip(exposed) {
            let [_, range_m] = frame.profiles[0].columns[5].unwrap();
            assert!((range_m - (1 + exposed_ns / 1000 % 60_000) as f64 * 1e-6).abs() < 1e-12);
            assert_eq!((frame.profiles.len(), frame.profiles[0].after_first_ns), (1, 0));
        }
    }
}
