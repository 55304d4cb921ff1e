//! Recordings go where dataset folders go: whole, cut off, and other people's.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "it/common/mod.rs"]
mod common;

use common::{code, trueline, words};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use trueline_dataset::{FrameFile, FrameSignals, Recording, folder, images};
use trueline_live::egm::{EgmClock, EgmFeedBack, EgmHeader, EgmPose, EgmRobot, Message, MessageType};
use trueline_mcap::{About, Entry, FeaturesEntry, FrameEntry, Recorder, RecorderHandle, RobotEntry};

fn calibrated(folder: &Path, dataset: &str) -> (i32, Value, String) {
    let output = trueline(folder, &["calibrate", dataset, "--json", "-", "--quiet"]);
    let result = serde_json::from_slice(&output.stdout).unwrap_or_default();
    (code(&output), result, words(&output))
}

fn offer(handle: &RecorderHandle, entry: Entry) {
    let start = Instant::now();
    while !handle.offer(entry.clone()) {
        assert!(start.elapsed() < Duration::from_secs(60));
        std::thread::sleep(Duration::from_millis(10));
    }
}

fn robot_entry(k: usize, sample: &trueline_dataset::RobotSample) -> Entry {
    let device_ns = sample.stamp_ns + 5_000_000_000;
    let (sec, usec) = (device_ns / 1_000_000_000, device_ns % 1_000_000_000 / 1000);
    let message = EgmRobot {
        header: Some(EgmHeader::new(k as u32, 0, MessageType::Data)),
        feed_back: Some(EgmFeedBack {
            cartesian: Some(EgmPose::full(&sample.base_from_tool)),
            time: Some(EgmClock { sec: Some(sec as u64), usec: Some(usec as u64) }),
            ..EgmFeedBack::default()
        }),
        ..EgmRobot::default()
    };
    Entry::Robot(RobotEntry {
        is_egm: true,
        datagram: message.encode_to_vec(),
        from: "192.0.2.1:6510".parse().unwrap(),
        steady_ns: sample.stamp_ns,
        kernel_wall_ns: Some(sample.stamp_ns + 77),
        read_wall_ns: sample.stamp_ns + 20_000,
        sequence: k as u32,
        device_ns,
        ptp_ns: None,
        base_from_tool: sample.base_from_tool,
    })
}

/// Records a dataset as it would have come in live.
fn record(dataset: &Path, file: &Path, features: bool) -> Recording {
    let recording = if features { folder::read(dataset).unwrap() } else { without_features(dataset) };
    let about = About {
        sensor_toml: Some(fs::read_to_string(dataset.join("sensor.toml")).unwrap()),
        stamp_meaning: "simulated".to_owned(),
        command: "a test".to_owned(),
        tool: "tool0".to_owned(),
    };
    let recorder = Recorder::create(file, &about).unwrap();
    let handle = recorder.handle();
    for (k, sample) in recording.robot.iter().enumerate() {
        offer(&handle, robot_entry(k, sample));
    }
    if features {
        for feature in &recording.features {
            offer(&handle, Entry::Features(FeaturesEntry { features: vec![*feature] }));
        }
    } else {
        for FrameFile { stamp_ns, frame, device_ns, path } in images::read_index(dataset).unwrap() {
            offer(
                &handle,
                Entry::Frame(FrameEntry {
                    frame,
                    stamp_ns,
                    first_packet_ns: Some(stamp_ns - 4_000_000),
                    complete_ns: Some(stamp_ns),
                    device_ns,
                    exposure_us: Some(2000.0),
                    signals: FrameSignals::default(),
                    status: "complete".to_owned(),
                    png: fs::read(path).unwrap(),
                }),
            );
        }
    }
    recorder.finish().unwrap();
    recording
}

fn without_features(dataset: &Path) -> Recording {
    let copy = dataset.with_extension("robot-only");
    fs::create_dir(&copy).unwrap();
    for name in ["sensor.toml", "robot.csv"] {
        fs::copy(dataset.join(name), copy.join(name)).unwrap();
    }
    fs::write(copy.join("features.csv"), "time_s,u_px,v_px\n0,1,1\n").unwrap();
    folder::read(&copy).unwrap()
}

fn three(value: &Value) -> [f64; 3] {
    [0, 1, 2].map(|k| value[k].as_f64().unwrap())
}

#[test]
fn a_recording_calibrates_like_the_dataset_it_came_from() {
    let dir = tempfile::tempdir().unwrap();
    for preset in ["quick", "profiler"] {
        let made = trueline(dir.path(), &["simulate", "--preset", preset, "--out", preset, "--quiet"]);
        assert_eq!(code(&made), 0);
        let file = format!("{preset}.mcap");
        record(&dir.path().join(preset), &dir.path().join(&file), true);
        // As a dataset with the same device stamps, for those may be dejittered.
        assert_eq!(
            code(&trueline(dir.path(), &["import", "mcap", &file, "--out", &format!("{preset}-2")])),
            0
        );
        let (exit, from_folder, _) = calibrated(dir.path(), &format!("{preset}-2"));
        let (exit_2, from_file, said) = calibrated(dir.path(), &file);
        assert_eq!((exit, exit_2), (0, 0), "{said}");
        for key in ["time_offset_s", "tool_from_camera", "lines", "sigma", "residuals"] {
            assert_eq!(from_folder[key], from_file[key], "{preset}: {key}");
        }
        assert_eq!(from_file["stamps"]["meaning"], "simulated");
        assert_eq!(from_file["inputs"].as_object().unwrap().keys().collect::<Vec<_>>(), [&file]);
    }
}

#[test]
fn a_recording_that_was_cut_off_calibrates_with_what_is_left() {
    let dir = tempfile::tempdir().unwrap();
    assert_eq!(
        code(&trueline(dir.path(), &["simulate", "--preset", "quick", "--out", "scan", "--quiet"])),
        0
    );
    let dataset = dir.path().join("scan");
    // Interleaved, as it comes: a cut leaves both streams.
    let recording = folder::read(&dataset).unwrap();
    let whole = dir.path().join("whole.mcap");
    let about = About {
        sensor_toml: Some(fs::read_to_string(dataset.join("sensor.toml")).unwrap()),
        stamp_meaning: String::new(),
        command: String::new(),
        tool: String::new(),
    };
    let recorder = Recorder::create(&whole, &about).unwrap();
    let mut features = recording.features.iter().peekable();
    for (k, sample) in recording.robot.iter().enumerate() {
        offer(&recorder.handle(), robot_entry(k, sample));
        while let Some(feature) = features.next_if(|f| f.stamp_ns <= sample.stamp_ns) {
            offer(&recorder.handle(), Entry::Features(FeaturesEntry { features: vec![*feature] }));
        }
    }
    recorder.finish().unwrap();
    let bytes = fs::read(&whole).unwrap();
    fs::write(dir.path().join("cut.mcap"), &bytes[..bytes.len() * 8 / 10]).unwrap();
    let (exit, result, said) = calibrated(dir.path(), "cut.mcap");
    assert!(said.contains("warning") && said.contains("cut.mcap"), "{said}");
    assert_eq!(exit, 0, "{said}");
    let truth = recording.truth.unwrap().parameters;
    let (offset, sigma) = (&result["time_offset_s"], &result["sigma"]["time_offset_s"]);
    assert!((offset.as_f64().unwrap() - truth.time_offset_s).abs() < 4.0 * sigma.as_f64().unwrap());
    let found = three(&result["tool_from_camera"]["translation_mm"]);
    let sigmas = three(&result["sigma"]["translation_mm"]);
    for axis in 0..3 {
        let error_mm = found[axis] - 1e3 * truth.tool_from_camera.translation.vector[axis];
        assert!(error_mm.abs() < 4.0 * sigmas[axis], "{error_mm} ± {}", sigmas[axis]);
    }

    fs::write(dir.path().join("nothing.mcap"), b"").unwrap();
    fs::write(dir.path().join("junk.mcap"), vec![7; 3000]).unwrap();
    for bad in ["nothing.mcap", "junk.mcap", "missing.mcap"] {
        let output = trueline(dir.path(), &["calibrate", bad]);
        assert_eq!(code(&output), 2, "{bad}");
        assert!(words(&output).contains("hint:"), "{bad}: {}", words(&output));
    }
}

#[test]
fn a_recording_with_pictures_is_looked_at() {
    let dir = tempfile::tempdir().unwrap();
    let made = trueline(
        dir.path(),
        &["simulate", "--images", "--preset", "quick", "--duration-s", "6", "--out", "scan", "--quiet"],
    );
    assert_eq!(code(&made), 0, "{}", words(&made));
    let file = dir.path().join("pictures/recording.mcap");
    fs::create_dir(dir.path().join("pictures")).unwrap();
    record(&dir.path().join("scan"), &file, false);
    let (exit, result, said) = calibrated(dir.path(), "pictures");
    let (_, from_folder, _) = calibrated(dir.path(), "scan");
    // Six seconds may be too short to be accepted; the same they must be. The robot's device stamps say nothing new.
    assert!(exit <= 1, "{said}");
    let offset = |result: &Value| result["time_offset_s"].as_f64().unwrap();
    let sigma = from_folder["sigma"]["time_offset_s"].as_f64().unwrap();
    assert!((offset(&result) - offset(&from_folder)).abs() < 0.5 * sigma);
    assert!(!dir.path().join("pictures/robot.csv").exists(), "what was recorded is not added to");
}

fn fixture(name: &str) -> String {
    let folder: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("../trueline-mcap/tests/fixtures");
    folder.join(name).to_string_lossy().into_owned()
}

#[test]
fn other_peoples_recordings_are_imported_or_refused_with_the_reason() {
    let dir = tempfile::tempdir().unwrap();
    assert_eq!(
        code(&trueline(dir.path(), &["simulate", "--preset", "quick", "--out", "scan", "--quiet"])),
        0
    );
    let import = |format: &str, name: &str, more: &[&str], out: &str| {
        let source = fixture(name);
        let mut arguments = vec!["import", format, &source, "--sensor", "scan/sensor.toml", "--out", out];
        arguments.extend(more);
        trueline(dir.path(), &arguments)
    };
    for (k, (format, name)) in
        [("rosbag2", "pose_mono8"), ("mcap", "pose_mono8_ros1.mcap"), ("rosbag2", "pose_mono8_zstd_file")]
            .into_iter()
            .enumerate()
    {
        let out = format!("out-{k}");
        let output = import(format, name, &[], &out);
        assert_eq!(code(&output), 0, "{name}: {}", words(&output));
        let rows = |file: &str| fs::read_to_string(dir.path().join(&out).join(file)).unwrap().lines().count();
        assert_eq!((rows("robot.csv"), rows("images/index.csv")), (61, 7));
    }
    let joints = import("rosbag2", "joint_states", &[], "joints");
    assert_eq!(code(&joints), 2);
    assert!(words(&joints).contains("joint"), "{}", words(&joints));
    assert!(!dir.path().join("joints").exists());
    let output = import("rosbag2", "tf_compressed", &["--base", "base_link", "--tool", "tool0"], "tf");
    assert_eq!(code(&output), 0, "{}", words(&output));
    let unknown = import("rosbag2", "tf_compressed", &["--base", "base_link", "--tool", "tcp"], "tf-2");
    assert_eq!(code(&unknown), 2);
    assert!(words(&unknown).contains("tcp"));
    let without_sensor = trueline(dir.path(), &["import", "rosbag2", &fixture("pose_mono8"), "--out", "x"]);
    assert_eq!(code(&without_sensor), 2);
    assert!(words(&without_sensor).contains("sensor"));
}
