//! `trueline sensor` as a user runs it: on public pictures of a chessboard, and on points of a stripe.
#![allow(clippy::print_stderr, reason = "a skipped test says so")]

use crate::common;

use common::words;
use serde_json::Value;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn trueline(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_trueline")).args(args).output().unwrap()
}

/// OpenCV's sample pictures, from Debian's package opencv-doc: fetched once and unpacked beside the build, never part of this
/// repository. `TRUELINE_OPENCV_SAMPLES` names a folder that has them already.
fn samples() -> Option<PathBuf> {
    if let Some(folder) = std::env::var_os("TRUELINE_OPENCV_SAMPLES") {
        return Some(PathBuf::from(folder));
    }
    let place = Path::new(env!("CARGO_TARGET_TMPDIR")).join("opencv-doc");
    let pictures = place.join("x/usr/share/doc/opencv-doc/examples/data");
    if !pictures.join("left01.jpg").exists() {
        std::fs::create_dir_all(&place).unwrap();
        let fetched = Command::new("sh")
            .args(["-c", "apt-get download -q opencv-doc && dpkg -x opencv-doc_*.deb x"])
            .current_dir(&place)
            .output();
        if !fetched.is_ok_and(|out| out.status.success()) || !pictures.join("left01.jpg").exists() {
            eprintln!("SKIPPED: opencv_samples: Debian's package opencv-doc cannot be fetched");
            return None;
        }
    }
    Some(pictures)
}

/// The thirteen pictures of one camera.
fn of_camera(folder: &Path, name: &str) -> Vec<String> {
    let mut files: Vec<String> = (1..=14)
        .map(|k| folder.join(format!("{name}{k:02}.jpg")))
        .filter(|file| file.exists())
        .map(|file| file.to_str().unwrap().to_owned())
        .collect();
    files.sort();
    assert_eq!(files.len(), 13);
    files
}

/// OpenCV 4's result for these pictures with its sub-pixel corners (window 5) and five coefficients: rms, fx, fy, cx, cy,
/// and the standard deviation of fx.
const ANCHORS: [(&str, f64, [f64; 4], f64); 2] = [
    ("left", 0.205, [532.83, 532.95, 342.49, 233.86], 0.44),
    ("right", 0.215, [537.45, 536.97, 327.59, 248.88], 0.48),
];

#[test]
fn opencv_samples_give_the_camera_that_opencv_finds() {
    let Some(folder) = samples() else { return };
    let out = tempfile::tempdir().unwrap();
    for (name, most_rms, [fx, fy, cx, cy], sigma) in ANCHORS {
        let mut pictures = of_camera(&folder, name);
        // A copy of a picture counts for nothing.
        let copy = out.path().join(format!("{name}_copy.jpg"));
        std::fs::copy(&pictures[0], &copy).unwrap();
        pictures.push(copy.to_str().unwrap().to_owned());
        let toml = out.path().join(format!("{name}.toml"));
        let page = out.path().join(format!("{name}.html"));
        let mut args = vec!["sensor", "intrinsics"];
        args.extend(pictures.iter().map(String::as_str));
        let (toml, page) = (toml.to_str().unwrap(), page.to_str().unwrap());
        args.extend(["--board", "chessboard:9x6:25", "--json", "-", "--out", toml, "--report", page]);
        let output = trueline(&args);
        assert_eq!(output.status.code(), Some(0), "{}", words(&output));
        let result: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(result["status"], "accepted");
        assert_eq!(result["pictures"], 13);
        assert!(result.to_string().contains("a repeated picture"), "{result}");
        assert_eq!(result["corners"], 13 * 54);
        assert_eq!(result["distortion_model"], "k1,k2,p1,p2,k3");
        let number = |value: &Value| value.as_f64().unwrap();
        assert!(number(&result["rms_px"]) <= most_rms, "{}", result["rms_px"]);
        let camera = &result["camera"];
        for (key, expected) in [("fx", fx), ("fy", fy), ("cx", cx), ("cy", cy)] {
            assert!((number(&camera[key]) - expected).abs() < 1.0, "{name} {key}: {}", camera[key]);
        }
        let found = number(&result["sigma"]["fx"]);
        assert!((found / sigma - 1.0).abs() < 0.15, "{name}: sigma of fx {found}");
        let text = std::fs::read_to_string(toml).unwrap();
        let file = trueline_dataset::sensor_toml::parse_camera(Path::new(toml), &text).unwrap();
        assert!((file.camera.focal.x - fx).abs() < 1.0);
        let covariance = file.setup.uncertainty.unwrap().covariance.unwrap();
        assert!((covariance.matrix[(0, 0)].sqrt() - found).abs() < 1e-9 * found);
        assert!(std::fs::read_to_string(page).unwrap().contains("Residual field"));
        // Existing files are not overwritten.
        let again = trueline(&args);
        assert_eq!(again.status.code(), Some(2));
        assert!(words(&again).contains("already exists"), "{}", words(&again));
    }
}

/// A stripe on each of eight boards, on the plane z = 100 mm + y/2 (n ∝ (0, −1, 2)), a little off it board by board.
fn points_csv() -> String {
    let mut text = "board,x_mm,y_mm,z_mm\n".to_owned();
    for board in 0..8 {
        let y = -20.0 + 6.0 * f64::from(board);
        let off = 0.02 * (2.5 * f64::from(board)).sin();
        for k in -10..=10 {
            let x = 1.5 * f64::from(k);
            writeln!(text, "{board},{x},{y},{}", 100.0 + 0.5 * y + off).unwrap();
        }
    }
    text
}

#[test]
fn a_plane_follows_from_points_with_the_uncertainty_of_its_boards() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("points.csv");
    std::fs::write(&file, points_csv()).unwrap();
    let out = folder.path().join("sensor.toml");
    let output = trueline(&[
        "sensor",
        "laser-plane",
        file.to_str().unwrap(),
        "--json",
        "-",
        "--out",
        out.to_str().unwrap(),
    ]);
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    let result: Value = serde_json::from_slice(&output.stdout).unwrap();
    let normal: Vec<f64> = result["normal"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
    // (0, −1, 2)/√5, and 100 mm × 2/√5; boards are off by 0.01 mm rms over ±20 mm: 0.03°.
    let truth = [0.0, -1.0 / 5.0_f64.sqrt(), 2.0 / 5.0_f64.sqrt()];
    assert!(normal.iter().zip(truth).all(|(a, b)| (a - b).abs() < 1e-3), "{normal:?}");
    assert!((result["offset_mm"].as_f64().unwrap() - 200.0 / 5.0_f64.sqrt()).abs() < 0.05);
    assert_eq!(result["boards"], 8);
    assert_eq!(result["sigma_normal_deg"].as_array().unwrap().len(), 2);
    assert!(result["sigma_offset_mm"].as_f64().unwrap() > 0.002);
    let text = std::fs::read_to_string(&out).unwrap();
    let sensor = trueline_dataset::sensor_toml::parse_file(&out, &text).unwrap();
    assert_eq!(sensor.sensor.kind(), "points");
    assert!(sensor.setup.uncertainty.unwrap().covariance.is_some());
}

#[test]
fn mistakes_are_told_with_a_hint_and_exit_code_two() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("points.csv");
    let name = file.to_str().unwrap().to_owned();
    for (text, expected) in [
        ("board,x_mm,y_mm,z_mm\n1,2,3\n", "line 2"),
        ("board,x_mm,y_mm,z_mm\n1,2,3,nan\n", "finite"),
        ("board,x_mm,y_mm,z_mm\n-1,2,3,4\n", "whole number"),
        ("board,x,y,z\n1,2,3,4\n", "unit"),
        ("board,x_mm,y_mm,z_mm\n", "no data rows"),
        ("board,x_mm,y_mm,z_mm\n1,2,3,4\n1,3,3,4\n", "needed"),
    ] {
        std::fs::write(&file, text).unwrap();
        let output = trueline(&["sensor", "laser-plane", &name]);
        assert_eq!(output.status.code(), Some(2), "{text}: {}", words(&output));
        assert!(words(&output).contains(expected) && words(&output).contains("hint:"), "{}", words(&output));
    }
    for board in ["chessboard:9x6", "charuco:9x6:25", "chessboard:9x6:0", "chessboard:1x6:25"] {
        let output = trueline(&["sensor", "intrinsics", &name, "--board", board]);
        assert_eq!(output.status.code(), Some(2), "{board}");
        assert!(words(&output).contains("COLUMNSxROWS"), "{}", words(&output));
    }
    let output = trueline(&["sensor", "intrinsics", "nowhere", "--board", "chessboard:9x6:25mm"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(words(&output).contains("nowhere: there is no such folder or picture"), "{}", words(&output));
    let output = trueline(&["sensor", "intrinsics", &name, "--board", "chessboard:9x6:25mm"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(words(&output).contains("neither PNG, JPEG, TIFF nor BMP"), "{}", words(&output));
}
