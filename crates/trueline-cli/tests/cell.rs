//! The whole cell on loopback: controller, camera and PC are three programs that meet only in sockets, and the third gives
//! back the truth of the first two. They run in real time, so a busy machine shows in them: they are left out unless asked
//! for. A whole cell in virtual time is in `trueline-cell/tests/virtual_time.rs`, and parts of one: guidance in
//! `trueline-live/tests`, the camera's clocks in `trueline-camera/tests/clocks.rs`.
#![cfg(feature = "gige")]
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "it/common/mod.rs"]
mod common;

use common::{address, trueline, words};
use serde_json::Value;
use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::thread;
use std::time::Duration;

/// A program that ends with the test.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn start(folder: &Path, arguments: &[&str]) -> Running {
    let mut command = Command::new(env!("CARGO_BIN_EXE_trueline"));
    command.current_dir(folder).args(arguments);
    Running(command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap())
}

/// Cameras have one port each: tests that run at the same time have addresses of their own.
fn camera_address(test: u8) -> String {
    let id = std::process::id();
    format!("127.{}.{}.{test}", 100 + id / 250 % 100, 1 + id % 250)
}

/// A plan, seen by a camera of a quarter of the pixels each way: pictures can then be drawn as fast as they are taken.
fn write_plan(folder: &Path) {
    let planned = trueline(
        folder,
        &["plan", "--example", "--out", "plan", "--duration-s", "12", "--tries", "400", "--quiet"],
    );
    assert_eq!(planned.status.code(), Some(0), "{}", words(&planned));
    let file = folder.join("plan/sensor.toml");
    let scaled = |line: &str| {
        let Some((key, value)) = line.split_once(" = ") else { return line.to_owned() };
        let number = value.parse::<f64>().unwrap_or(f64::NAN);
        match key {
            "width" | "height" => format!("{key} = {}", number as u32 / 4),
            "fx" | "fy" => format!("{key} = {:?}", number / 4.0),
            // (0, 0) is the centre of the first pixel.
            "cx" | "cy" => format!("{key} = {:?}", (number + 0.5) / 4.0 - 0.5),
            _ => line.to_owned(),
        }
    };
    let text: Vec<String> = fs::read_to_string(&file).unwrap().lines().map(scaled).collect();
    fs::write(&file, text.join("\n")).unwrap();
    let limits = trueline(folder, &["scan", "plan", "--write-limits", "limits.toml"]);
    assert_eq!(limits.status.code(), Some(0), "{}", words(&limits));
}

struct Cell {
    pc: String,
    truth: String,
    camera: String,
}

impl Cell {
    fn new(test: u8) -> Self {
        Self { pc: address(), truth: address(), camera: camera_address(test) }
    }

    fn camera(&self, folder: &Path, more: &[&str]) -> Running {
        let mut arguments = vec![
            "camera-sim",
            "plan",
            "--robot-truth",
            &self.truth,
            "--address",
            &self.camera,
            "--fps",
            "12",
            "--latency-ms",
            "60",
            "--truth",
            "truth.toml",
        ];
        arguments.extend(more);
        let camera = start(folder, &arguments);
        thread::sleep(Duration::from_millis(500));
        camera
    }

    fn robot(&self, folder: &Path, more: &[&str]) -> Running {
        let mut arguments = vec!["robot-sim", "--pc", &self.pc, "--path", "plan", "--truth-to", &self.truth];
        arguments.extend(more);
        start(folder, &arguments)
    }

    fn record(&self, folder: &Path, more: &[&str]) -> Output {
        let (pc, camera) = (self.pc.as_str(), self.camera.as_str());
        let both =
            ["record", "--bind", pc, "--camera", camera, "--sensor", "plan/sensor.toml", "--out", "rec"];
        trueline(folder, &[&both[..], more].concat())
    }
}

fn calibrated(folder: &Path, recording: &str) -> Value {
    let output = trueline(folder, &["calibrate", recording, "--joint", "fillet", "--json", "-", "--quiet"]);
    serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{}", words(&output)))
}

fn truth(folder: &Path) -> toml::Table {
    fs::read_to_string(folder.join("truth.toml")).unwrap().parse().unwrap()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

/// Against what was put in: 0.3 ms and 4 sigma for the offset, 4 sigma for the hand-eye.
fn check(folder: &Path, result: &Value, true_offset_s: f64) {
    assert_eq!(result["status"], "accepted", "{}", result["reasons"]);
    let truth = truth(folder);
    let error_s = number(&result["time_offset_s"]) - true_offset_s;
    let sigma_s = number(&result["sigma"]["time_offset_s"]);
    // The network's least delay, the operating system's and the controller's lateness: about 0.05 ms that no truth file knows.
    assert!(error_s.abs() < 3e-4 && error_s.abs() < 4.0 * sigma_s + 1e-4, "{error_s} ± {sigma_s} s");
    let known = &truth["tool_from_camera"];
    let list = |value: &toml::Value| -> Vec<f64> {
        value.as_array().unwrap().iter().map(|v| v.as_float().unwrap()).collect()
    };
    let translation_mm = list(&known["translation_mm"]);
    for axis in 0..3 {
        let error_mm = number(&result["tool_from_camera"]["translation_mm"][axis]) - translation_mm[axis];
        let sigma_mm = number(&result["sigma"]["translation_mm"][axis]);
        assert!(error_mm.abs() < 4.0 * sigma_mm, "axis {axis}: {error_mm} ± {sigma_mm} mm");
    }
    let wxyz = list(&known["rotation_wxyz"]);
    let dot: f64 = (0..4).map(|k| wxyz[k] * number(&result["tool_from_camera"]["rotation_wxyz"][k])).sum();
    let angle_rad = 2.0 * dot.abs().min(1.0).acos();
    let sigma_rad: f64 =
        (0..3).map(|k| number(&result["sigma"]["rotation_rad"][k]).powi(2)).sum::<f64>().sqrt();
    assert!(angle_rad < 4.0 * sigma_rad, "{angle_rad} ± {sigma_rad} rad");
}

#[test]
#[ignore = "in real time, of three programs: on a quiet machine, cargo test -p trueline-cli --test cell -- --ignored --test-threads 1"]
fn a_stream_is_recorded_and_calibrates_to_what_was_put_in() {
    let dir = tempfile::tempdir().unwrap();
    write_plan(dir.path());
    let cell = Cell::new(1);
    let _camera = cell.camera(dir.path(), &[]);
    let _robot = cell.robot(dir.path(), &["--rest-s", "1.5"]);
    let recorded = cell.record(dir.path(), &["--for-s", "15"]);
    assert_eq!(recorded.status.code(), Some(0), "{}", words(&recorded));
    assert!(words(&recorded).contains("estimate: time offset"), "{}", words(&recorded));
    let offset_s = truth(dir.path())["time_offset_s"].as_float().unwrap();
    check(dir.path(), &calibrated(dir.path(), "rec"), offset_s);
}

#[test]
#[ignore = "in real time, of three programs: on a quiet machine, cargo test -p trueline-cli --test cell -- --ignored --test-threads 1"]
fn profiles_over_the_network_are_recorded_and_calibrate_to_what_was_put_in() {
    let dir = tempfile::tempdir().unwrap();
    let planned = trueline(
        dir.path(),
        &["plan", "--example=profiler", "--out", "plan", "--duration-s", "12", "--tries", "400", "--quiet"],
    );
    assert_eq!(planned.status.code(), Some(0), "{}", words(&planned));
    let cell = Cell::new(5);
    let _camera = cell.camera(dir.path(), &["--profiles-per-frame", "3"]);
    let _robot = cell.robot(dir.path(), &["--rest-s", "1.5"]);
    let recorded = cell.record(dir.path(), &["--for-s", "15"]);
    assert_eq!(recorded.status.code(), Some(0), "{}", words(&recorded));
    assert!(words(&recorded).contains(" profiles in "), "{}", words(&recorded));
    let offset_s = truth(dir.path())["time_offset_s"].as_float().unwrap();
    check(dir.path(), &calibrated(dir.path(), "rec"), offset_s);
}

#[test]
#[ignore = "in real time, of three programs: on a quiet machine, cargo test -p trueline-cli --test cell -- --ignored --test-threads 1"]
fn pictures_that_an_encoder_triggers_calibrate_to_what_was_put_in() {
    let dir = tempfile::tempdir().unwrap();
    write_plan(dir.path());
    let cell = Cell::new(7);
    let _camera = cell.camera(dir.path(), &["--encoder-mm", "15", "--chunks"]);
    let _robot = cell.robot(dir.path(), &["--rest-s", "1.5"]);
    let recorded = cell.record(dir.path(), &["--trigger", "Line1:rising", "--for-s", "15"]);
    assert_eq!(recorded.status.code(), Some(0), "{}", words(&recorded));
    assert!(words(&recorded).contains("; encoder "), "{}", words(&recorded));
    let result = calibrated(dir.path(), "rec");
    let offset_s = truth(dir.path())["time_offset_s"].as_float().unwrap();
    check(dir.path(), &result, offset_s);
    // They came by the way and not by a clock: the robot rests, and is slow where it turns.
    let stamps = &result["stamps"]["features"];
    assert!(number(&stamps["longest_gap_s"]) > 2.0 * number(&stamps["median_period_s"]), "{stamps}");
}

#[test]
#[ignore = "in real time, of three programs: on a quiet machine, cargo test -p trueline-cli --test cell -- --ignored --test-threads 1"]
fn pictures_that_an_output_of_the_robot_starts_calibrate_to_what_was_put_in() {
    for (test, rhythm) in [(10, ["--output-every-mm", "15"]), (11, ["--output-every-ms", "130"])] {
        let dir = tempfile::tempdir().unwrap();
        write_plan(dir.path());
        let (cell, wire) = (Cell::new(test), address());
        let _camera = cell.camera(dir.path(), &["--trigger-from", &wire]);
        let wired = ["--rest-s", "1.5", "--output-to", &wire];
        let _robot = cell.robot(dir.path(), &[&wired[..], &rhythm].concat());
        let recorded = cell.record(dir.path(), &["--trigger", "Line1:rising", "--for-s", "15"]);
        assert_eq!(recorded.status.code(), Some(0), "{}", words(&recorded));
        let result = calibrated(dir.path(), "rec");
        let offset_s = truth(dir.path())["time_offset_s"].as_float().unwrap();
        check(dir.path(), &result, offset_s);
        let stamps = &result["stamps"]["features"];
        // By time one picture may be lost: two periods, and a cycle.
        let is_by_way = number(&stamps["longest_gap_s"]) > 2.5 * number(&stamps["median_period_s"]);
        assert_eq!(is_by_way, rhythm[0] == "--output-every-mm", "{stamps}");
    }
}

#[test]
#[ignore = "in real time, of three programs: on a quiet machine, cargo test -p trueline-cli --test cell -- --ignored --test-threads 1"]
fn profiles_that_an_encoder_triggers_calibrate_to_what_was_put_in() {
    let dir = tempfile::tempdir().unwrap();
    let planned = trueline(
        dir.path(),
        &["plan", "--example=profiler", "--out", "plan", "--duration-s", "12", "--tries", "400", "--quiet"],
    );
    assert_eq!(planned.status.code(), Some(0), "{}", words(&planned));
    let cell = Cell::new(8);
    let _camera = cell.camera(dir.path(), &["--encoder-mm", "4"]);
    let _robot = cell.robot(dir.path(), &["--rest-s", "1.5"]);
    let recorded = cell.record(dir.path(), &["--trigger", "Line1", "--for-s", "15"]);
    assert_eq!(recorded.status.code(), Some(0), "{}", words(&recorded));
    let offset_s = truth(dir.path())["time_offset_s"].as_float().unwrap();
    check(dir.path(), &calibrated(dir.path(), "rec"), offset_s);
}

#[test]
#[ignore = "in real time, of three programs: on a quiet machine, cargo test -p trueline-cli --test cell -- --ignored --test-threads 1"]
fn the_red_pixels_of_a_colour_camera_calibrate_to_what_was_put_in() {
    let dir = tempfile::tempdir().unwrap();
    write_plan(dir.path());
    let cell = Cell::new(9);
    let _camera = cell.camera(dir.path(), &["--colours"]);
    let _robot = cell.robot(dir.path(), &["--rest-s", "1.5"]);
    let recorded =
        cell.record(dir.path(), &["--pixel-format", "BayerRG12p", "--laser", "red", "--for-s", "15"]);
    assert_eq!(recorded.status.code(), Some(0), "{}", words(&recorded));
    let offset_s = truth(dir.path())["time_offset_s"].as_float().unwrap();
    check(dir.path(), &calibrated(dir.path(), "rec"), offset_s);
}

#[test]
#[ignore = "in real time, of three programs: on a quiet machine, cargo test -p trueline-cli --test cell -- --ignored --test-threads 1"]
fn a_guided_scan_over_a_lossy_network_with_dropped_pictures_does_too() {
    let dir = tempfile::tempdir().unwrap();
    write_plan(dir.path());
    let cell = Cell::new(2);
    let _camera =
        cell.camera(dir.path(), &["--loss", "0.01", "--frame-drop", "0.05", "--packet-bytes", "1500"]);
    let mut scan = start(
        dir.path(),
        &[
            "scan",
            "plan",
            "--pace",
            "0.6",
            "--limits",
            "limits.toml",
            "--enable-motion",
            "--bind",
            &cell.pc,
            "--robot",
            "127.0.0.1",
            "--camera",
            &cell.camera,
            "--stamp",
            "exposure",
            "--timeout-s",
            "1.9",
            "--hold-s",
            "3.5",
            "--out",
            "led",
        ],
    );
    scan.0.stdin.take().unwrap().write_all(b"move\n").unwrap();
    thread::sleep(Duration::from_millis(2500));
    let _robot = cell.robot(
        dir.path(),
        &[
            "--mode",
            "guidance",
            "--gain-per-s",
            "20",
            "--near-mm",
            "0.05",
            "--near-deg",
            "0.05",
            "--near-for-s",
            "3",
            "--timeout-s",
            "2",
            "--loss",
            "0.01",
            "--for-s",
            "40",
        ],
    );
    let mut said = String::new();
    std::io::Read::read_to_string(&mut scan.0.stderr.take().unwrap(), &mut said).unwrap();
    assert!(scan.0.wait().unwrap().success(), "{said}");
    assert!(said.contains("the path was travelled") && !said.contains(" 0 missing"), "{said}");
    // The camera's stamp is the start of the exposure of 2 ms: the picture is of its middle, a millisecond later.
    check(dir.path(), &calibrated(dir.path(), "led"), -0.001);
}

#[test]
#[ignore = "in real time, of three programs: on a quiet machine, cargo test -p trueline-cli --test cell -- --ignored --test-threads 1"]
fn a_recording_goes_on_with_the_robot_when_the_camera_is_unplugged() {
    let dir = tempfile::tempdir().unwrap();
    write_plan(dir.path());
    let cell = Cell::new(3);
    let _camera = cell.camera(dir.path(), &["--unplug-at-s", "6"]);
    let _robot = cell.robot(dir.path(), &["--rest-s", "1"]);
    let recorded = cell.record(dir.path(), &[]);
    assert_eq!(recorded.status.code(), Some(1), "{}", words(&recorded));
    assert!(words(&recorded).contains("the camera went away 1 times"), "{}", words(&recorded));
    let unpacked = trueline(dir.path(), &["import", "mcap", "rec/recording.mcap", "--out", "kept"]);
    assert_eq!(unpacked.status.code(), Some(0), "{}", words(&unpacked));
    assert!(words(&unpacked).contains("stamps: robot: arrival"), "{}", words(&unpacked));
    let index = fs::read_to_string(dir.path().join("kept/images/index.csv")).unwrap();
    assert!(index.lines().count() > 20, "{index}");
    // The robot drives for 14 s in all, and the camera is gone after 6 s.
    let poses = fs::read_to_string(dir.path().join("kept/robot.csv")).unwrap();
    assert!(poses.lines().count() > 2500, "{}", poses.lines().count());
}

#[test]
fn a_sensor_file_of_another_size_is_refused_before_anything_is_recorded() {
    let dir = tempfile::tempdir().unwrap();
    write_plan(dir.path());
    let cell = Cell::new(4);
    let none = cell.record(dir.path(), &[]);
    assert_eq!(none.status.code(), Some(2));
    assert!(words(&none).contains("no camera answers"), "{}", words(&none));
    let wide = fs::read_to_string(dir.path().join("plan/sensor.toml"))
        .unwrap()
        .replace("width = 612", "width = 640");
    fs::write(dir.path().join("wide.toml"), wide).unwrap();
    let _camera = cell.camera(dir.path(), &[]);
    let other = trueline(
        dir.path(),
        &["record", "--bind", &cell.pc, "--camera", &cell.camera, "--sensor", "wide.toml", "--out", "rec"],
    );
    assert_eq!(other.status.code(), Some(2), "{}", words(&other));
    assert!(!dir.path().join("rec").exists());
}

#[test]
fn a_trigger_that_is_not_wired_is_asked_for_and_what_cannot_be_set_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    write_plan(dir.path());
    let cell = Cell::new(10);
    let _camera = cell.camera(dir.path(), &[]);
    for (options, told) in [
        (
            &["--trigger", "Line7"][..],
            "`TriggerSource`: Line7 was requested; the camera offers Software, Line1",
        ),
        (&["--trigger", "Software"], "this program does not support"),
        (&["--trigger", "Line1", "--fps", "5"], "`AcquisitionFrameRate`: 5 Hz were requested"),
        (&["--trigger", "Line1:up"], "behind a colon, rising, falling or any"),
        (&["--pixel-format", "BayerRG8"], "the laser's colour is not stated"),
        (&["--laser", "red"], "the camera sends Mono8, which has no colours"),
        (&["--pixel-format", "Coord3D_C16"], "expected one of Mono8, Mono10"),
    ] {
        let refused = cell.record(dir.path(), options);
        assert_eq!(refused.status.code(), Some(2), "{options:?}: {}", words(&refused));
        assert!(words(&refused).contains(told), "{options:?}: {}", words(&refused));
        assert!(!dir.path().join("rec").exists(), "{options:?}");
    }
    let _robot = cell.robot(dir.path(), &["--rest-s", "1"]);
    let recorded = cell.record(dir.path(), &["--trigger", "Line2", "--for-s", "3"]);
    assert_eq!(recorded.status.code(), Some(1), "{}", words(&recorded));
    assert!(words(&recorded).contains("the trigger is wired"), "{}", words(&recorded));
    assert!(words(&recorded).contains("no picture yet: it waits for its trigger"), "{}", words(&recorded));
}

#[test]
fn a_simulated_camera_says_which_latency_drawing_takes_on_this_machine() {
    let dir = tempfile::tempdir().unwrap();
    write_plan(dir.path());
    let (truth, address) = (address(), camera_address(6));
    let shown = |readout_ms: &str, latency_ms: &str| {
        let asked =
            ["--readout-ms", readout_ms, "--latency-ms", latency_ms, "--fps", "0.02", "--for-s", "0.1"];
        let camera = ["camera-sim", "plan", "--robot-truth", &truth, "--address", &address];
        let output = trueline(dir.path(), &[&camera[..], &asked].concat());
        assert_eq!(output.status.code(), Some(0), "{}", words(&output));
        words(&output)
    };
    // No machine draws in no time at all, and every one does within 30 s.
    let late = shown("0", "0");
    assert!(
        late.contains("to draw on this machine, and has 0 ms") && late.contains("--latency-ms "),
        "{late}"
    );
    let in_time = shown("0", "30000");
    assert!(!in_time.contains("to draw on this machine"), "{in_time}");
}
