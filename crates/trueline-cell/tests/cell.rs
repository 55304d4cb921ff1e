//! A cell is recorded and estimated from without any hardware.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};
use trueline_camera::{CameraError, CameraFrame, FrameSource, FrameStatus, SourceAbout};
use trueline_cell::{CameraCounts, CameraRecorder, Cell, LiveEstimate, Progress, StampChoice, entries};
use trueline_dataset::{FrameSignals, GrayImage, Pixels, Recording};
use trueline_mcap::{About, Bag, BagItem, Content, Recorder, message};
use trueline_method::Requirement;
use trueline_sim::{Preset, simulate};
use trueline_vision::Joint;

/// Gives the frames of a list, then ends or fails.
struct Frames {
    frames: std::vec::IntoIter<CameraFrame>,
    fails: bool,
    about: SourceAbout,
}

impl FrameSource for Frames {
    fn next(&mut self, _: Duration) -> Result<Option<CameraFrame>, CameraError> {
        match self.frames.next() {
            None if self.fails => Err(CameraError::Unplugged { silent_s: 1.0 }),
            frame => Ok(frame),
        }
    }

    fn about(&self) -> &SourceAbout {
        &self.about
    }

    fn has_ended(&self) -> bool {
        !self.fails && self.frames.as_slice().is_empty()
    }
}

/// Frame `k`: stamps that differ in every digit, so that no two can be mistaken for each other.
fn frame(k: u64, is_whole: bool) -> CameraFrame {
    let image = GrayImage { width: 2, height: 1, pixels: Pixels::Eight(vec![k as u8, 7]) };
    CameraFrame {
        image: is_whole.then_some(image),
        profiles: Vec::new(),
        frame: k,
        device_ns: Some(500 + k as i64),
        first_packet_ns: Some(1_000 + k as i64),
        complete_ns: 2_000 + k as i64,
        exposure_us: Some(1.5),
        signals: FrameSignals { encoder: Some(-(k as i64)), ..FrameSignals::default() },
        status: if is_whole { FrameStatus::Complete } else { FrameStatus::Incomplete { missing: 3 } },
    }
}

fn source(frames: Vec<CameraFrame>, fails: bool) -> Box<dyn FrameSource> {
    let (name, stamp_meaning) = ("a list".to_owned(), "a number".to_owned());
    let about = SourceAbout { name, width: 2, height: 1, tick_hz: None, stamp_meaning, trigger: None };
    Box::new(Frames { frames: frames.into_iter(), fails, about })
}

fn recorder(folder: &Path) -> Recorder {
    Recorder::create(&folder.join("recording.mcap"), &About::default()).unwrap()
}

/// The stamps of all frames in a recording.
fn recorded_frames(folder: &Path) -> Vec<message::FrameStamps> {
    let mut frames = Vec::new();
    let visit = &mut |item: BagItem<'_>| {
        if let BagItem::Message(item) = item
            && let Content::Frame(stamps) = message::decode(item.schema, item.encoding, item.bytes).unwrap()
        {
            frames.push(stamps);
        }
        Ok(())
    };
    assert!(Bag::open(&folder.join("recording.mcap")).unwrap().read(visit).unwrap().is_empty());
    frames
}

#[test]
fn every_frame_is_recorded_with_all_its_stamps_and_losses_are_counted() {
    for (stamp, first_ns) in [(StampChoice::FirstPacket, 1_001), (StampChoice::Complete, 2_001)] {
        let folder = tempfile::tempdir().unwrap();
        let frames = vec![frame(1, true), frame(2, false), frame(5, true)];
        let camera = CameraRecorder::with_source(source(frames, false), stamp, Joint::Fillet, None).unwrap();
        let recorder = recorder(folder.path());
        let mut cell = Cell::new(Some(camera), None);
        let outcome = cell.run(&recorder.handle(), |_| thread::sleep(Duration::from_millis(50)), |_| {});
        assert!(outcome.camera.is_ok());
        recorder.finish().unwrap();
        // Numbers 3 and 4 never came, and frame 2 has no picture.
        let signals = FrameSignals { encoder: Some(-5), ..FrameSignals::default() };
        let counts = CameraCounts { frames: 3, unusable: 1, missing: 2, signals, ..CameraCounts::default() };
        assert!(counts.to_string().ends_with("; encoder -5"), "{counts}");
        assert_eq!(cell.state().camera, Some(counts));
        assert_eq!((counts.taken(), counts.lost(), counts.is_doubtful()), (5, 3, true));
        let recorded = recorded_frames(folder.path());
        let numbers: Vec<_> = recorded.iter().map(|f| (f.frame, f.stamp_ns - first_ns)).collect();
        assert_eq!(numbers, [(1, 0), (2, 1), (5, 4)]);
        assert_eq!(recorded[1].status, "3 packets missing");
        assert_eq!(recorded[1].picture_bytes, 0);
        assert_eq!(recorded[1].signals.encoder, Some(-2));
        assert_eq!((recorded[2].device_ns, recorded[2].complete_ns), (Some(505), Some(2_005)));
    }
}

#[test]
fn a_camera_that_fails_tells_the_robots_side_and_keeps_what_came() {
    let folder = tempfile::tempdir().unwrap();
    let camera = source(vec![frame(1, true)], true);
    let camera = CameraRecorder::with_source(camera, StampChoice::Complete, Joint::Fillet, None).unwrap();
    let recorder = recorder(folder.path());
    let mut cell = Cell::new(Some(camera), None);
    let until_blind = |blind: &AtomicBool| {
        let start = Instant::now();
        while !blind.load(Ordering::SeqCst) && start.elapsed() < Duration::from_secs(20) {
            thread::yield_now();
        }
        blind.load(Ordering::SeqCst)
    };
    let outcome = cell.run(&recorder.handle(), until_blind, |_| {});
    assert_eq!(outcome.robot, Some(true), "the robot's side is told");
    assert!(matches!(outcome.camera, Err(CameraError::Unplugged { .. })));
    recorder.finish().unwrap();
    assert_eq!(recorded_frames(folder.path()).len(), 1);
}

#[test]
fn a_robots_side_that_panics_ends_the_camera_too() {
    let folder = tempfile::tempdir().unwrap();
    let camera = source(Vec::new(), false);
    let camera = CameraRecorder::with_source(camera, StampChoice::Complete, Joint::Fillet, None).unwrap();
    let recorder = recorder(folder.path());
    let outcome = Cell::new(Some(camera), None).run(&recorder.handle(), |_| panic!("on purpose"), |_| {});
    assert!(outcome.robot.is_none() && outcome.camera.is_ok() && !outcome.estimate_panicked);
}

#[test]
fn a_camera_without_a_clock_cannot_stamp_by_it() {
    let refused = CameraRecorder::with_source(
        source(vec![frame(1, true)], false),
        StampChoice::Exposure,
        Joint::Fillet,
        None,
    );
    let error = refused.err().expect("there is no clock to be read");
    assert_eq!(error.to_string(), "a list cannot report its time");
}

/// A live estimate of a recording that arrives all at once. It looks once more at the end, so nothing waits.
fn progress_of(recording: &Recording, want: Requirement) -> Progress {
    let estimate = LiveEstimate::new(recording.sensor.clone(), Some(want));
    estimate.offer_poses(&mut recording.robot.clone());
    // In the wrong order, as overtaken frames come.
    for feature in recording.features.iter().rev() {
        estimate.add_feature(*feature);
    }
    estimate.run(&AtomicBool::new(true));
    estimate.progress()
}

#[test]
fn the_estimate_is_that_of_the_calibration_afterwards() {
    let recording = simulate(&Preset::Quick.scenario(), 7).unwrap();
    let afterwards =
        trueline_method::calibrate(&recording, None, &trueline_method::Config::default()).unwrap();
    for (time_s, is_enough) in [(1e-3, true), (1e-9, false)] {
        let want = Requirement { time_s: Some(time_s), ..Requirement::default() };
        let Progress::Estimated(estimated) = progress_of(&recording, want) else { panic!("no estimate") };
        let sigma_s = afterwards.noise_sigma(0).unwrap();
        assert_eq!(estimated.time_offset_s, Some([afterwards.best_fit().time_offset_s, sigma_s]));
        assert_eq!(estimated.seam_points, recording.features.len());
        assert_eq!(estimated.is_enough, Some(is_enough), "sigma {sigma_s} s, wanted {time_s} s");
        assert!(estimated.advice.is_empty());
    }
}

#[test]
fn what_cannot_be_observed_has_no_number_and_comes_with_advice() {
    let recording = simulate(&Preset::ConstantAttitude.scenario(), 7).unwrap();
    let Progress::Estimated(estimated) = progress_of(&recording, Requirement::default()) else {
        panic!("no estimate")
    };
    assert_eq!(estimated.translation_sigma_m, None);
    assert!(!estimated.advice.is_empty());
    assert_eq!(estimated.is_enough, Some(false), "it is not accepted");
}

#[test]
fn too_few_seam_points_are_counted_and_nothing_is_estimated() {
    let mut recording = simulate(&Preset::Quick.scenario(), 7).unwrap();
    recording.features.truncate(29);
    let progress = progress_of(&recording, Requirement::default());
    assert!(matches!(progress, Progress::Waiting { seam_points: 29, needed: 30 }), "{progress:?}");
}

#[test]
fn an_estimate_runs_beside_the_robot() {
    let recording = simulate(&Preset::Quick.scenario(), 7).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let recorder = recorder(folder.path());
    let estimate = Arc::new(LiveEstimate::new(recording.sensor.clone(), None));
    let mut cell = Cell::new(None, Some(Arc::clone(&estimate)));
    cell.run(
        &recorder.handle(),
        |_| {
            estimate.offer_poses(&mut recording.robot.clone());
            recording.features.iter().for_each(|feature| estimate.add_feature(*feature));
        },
        |_| {},
    );
    assert!(matches!(cell.state().estimate, Some(Progress::Estimated(_))));
}

#[test]
fn a_picture_that_cannot_be_encoded_is_recorded_without_pixels() {
    let mut broken = frame(1, true);
    broken.image = Some(GrayImage { width: 0, height: 0, pixels: Pixels::Eight(Vec::new()) });
    let entry = entries::frame(&broken, 9);
    assert!(entry.png.is_empty() && entry.status.starts_with("not encoded"), "{}", entry.status);
    assert_eq!(entry.stamp_ns, 9);
}

/// Like a replay that reads more slowly than the recording: one more picture is always overdue.
struct Endless(SourceAbout, u64);

impl FrameSource for Endless {
    fn next(&mut self, _: Duration) -> Result<Option<CameraFrame>, CameraError> {
        self.1 += 1;
        thread::sleep(Duration::from_millis(5));
        Ok(Some(frame(self.1, true)))
    }

    fn about(&self) -> &SourceAbout {
        &self.0
    }
}

#[test]
fn a_source_that_is_behind_does_not_delay_the_end() {
    let folder = tempfile::tempdir().unwrap();
    let (name, stamp_meaning) = (String::new(), String::new());
    let about = SourceAbout { name, width: 2, height: 1, tick_hz: None, stamp_meaning, trigger: None };
    let source = Box::new(Endless(about, 0));
    let camera = CameraRecorder::with_source(source, StampChoice::Complete, Joint::Fillet, None).unwrap();
    let recorder = recorder(folder.path());
    let mut cell = Cell::new(Some(camera), None);
    let (sent, ended) = std::sync::mpsc::channel();
    let handle = recorder.handle();
    thread::spawn(move || {
        let outcome = cell.run(&handle, |_| (), |_| {});
        sent.send(outcome.camera.is_ok())
    });
    // Half a second is allowed; the rest is for a machine that is busy. Without an end this never comes.
    assert!(ended.recv_timeout(Duration::from_secs(20)).expect("it ends"));
}
