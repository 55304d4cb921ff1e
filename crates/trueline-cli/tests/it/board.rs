//! `trueline calibrate --target board` as a user runs it, on rendered pictures of a board before a moving robot.

use nalgebra::{Vector2, Vector3};
use serde_json::Value;
use std::fs;
use std::io::BufWriter;
use std::path::Path;
use std::process::{Command, Output};
use trueline_dataset::images::{self, FrameFile};
use trueline_dataset::sensor_setup::SensorSetup;
use trueline_dataset::sensor_toml::{CameraFile, format_camera};
use trueline_dataset::{RobotSample, gray_png, robot_csv};
use trueline_geometry::{Pose, se3, so3};
use trueline_model::{BrownConrady, Camera};
use trueline_sim::boards::{BoardScene, render};
use trueline_sim::noise::Noise;

const CORNERS: [usize; 2] = [9, 6];
const SQUARE_M: f64 = 0.020;
const OFFSET_S: f64 = 0.0437;
const PICTURES: u32 = 60;

fn trueline(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_trueline")).current_dir(folder).args(arguments).output().unwrap()
}

fn words(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn camera() -> Camera {
    Camera {
        size: [480, 360],
        focal: Vector2::new(420.0, 421.0),
        centre: Vector2::new(238.0, 181.0),
        distortion: BrownConrady { k1: -0.1, k2: 0.03, ..BrownConrady::default() },
    }
}

fn tool_from_camera() -> Pose {
    se3::from_parts(so3::exp(&Vector3::new(0.2, -0.3, 1.5)), Vector3::new(0.060, -0.020, 0.140))
}

/// The board in the camera's view at a time.
fn view(time_s: f64) -> Pose {
    let swing = |hertz: f64, phase: f64| (std::f64::consts::TAU * hertz * time_s + phase).sin();
    let turn = Vector3::new(0.35 * swing(0.41, 0.2), 0.35 * swing(0.33, 1.0), 0.3 * swing(0.27, 2.0));
    let rotation = so3::exp(&turn);
    let middle =
        Vector3::new(0.01 * swing(0.4, 0.5), 0.008 * swing(0.37, 3.0), 0.36 + 0.03 * swing(0.31, 1.5));
    let board_middle = Vector3::new((CORNERS[0] - 1) as f64, (CORNERS[1] - 1) as f64, 0.0) * (0.5 * SQUARE_M);
    se3::from_parts(rotation, middle - rotation * board_middle)
}

fn tool(time_s: f64) -> Pose {
    let base_from_board =
        se3::from_parts(so3::exp(&Vector3::new(3.0, 0.1, 0.2)), Vector3::new(0.9, -0.2, 0.1));
    base_from_board * view(time_s).inverse() * tool_from_camera().inverse()
}

/// A dataset of a moving robot that looks at a board: 250 poses and 20 pictures a second.
fn record(folder: &Path) {
    fs::create_dir_all(folder.join("images")).unwrap();
    let file = CameraFile { camera: camera(), laser_plane_in_camera: None, setup: SensorSetup::default() };
    fs::write(folder.join("sensor.toml"), format_camera(&file)).unwrap();
    let mut noise = Noise::new(4, 1);
    let mut normal = |sigma: f64| Vector3::from_fn(|_, _| noise.normal(sigma));
    let robot: Vec<RobotSample> = (0..850)
        .map(|k| {
            let wrong = se3::from_parts(so3::exp(&normal(2e-5)), normal(0.03e-3));
            RobotSample {
                stamp_ns: 1_000_000_000 + 4_000_000 * k,
                device_ns: None,
                base_from_tool: tool(0.004 * k as f64) * wrong,
            }
        })
        .collect();
    robot_csv::write(BufWriter::new(fs::File::create(folder.join("robot.csv")).unwrap()), &robot).unwrap();
    let mut frames = Vec::new();
    for k in 0..PICTURES {
        let exposed_s = 0.1 + 0.05 * f64::from(k);
        let scene = BoardScene {
            camera: camera(),
            camera_from_board: view(exposed_s),
            corners: CORNERS,
            square_m: SQUARE_M,
            levels: [40.0, 190.0, 100.0],
            blur_px: 0.7,
            noise: 2.0,
            stripe: None,
        };
        let file = folder.join("images").join(format!("{k:03}.png"));
        gray_png::write(&file, &render(&scene, u64::from(k))).unwrap();
        let stamp_ns = 1_000_000_000 + ((exposed_s + OFFSET_S) * 1e9).round() as i64;
        frames.push(FrameFile { stamp_ns, device_ns: None, frame: u64::from(k), path: file });
    }
    images::write_index(folder, &frames).unwrap();
}

#[test]
fn a_board_before_the_moving_robot_gives_time_offset_and_hand_eye_with_their_uncertainty() {
    let dir = tempfile::tempdir().unwrap();
    record(&dir.path().join("scan"));
    // A camera without its laser plane is enough for a board.
    let output = trueline(dir.path(), &["import", "csv", "scan", "--out", "imported"]);
    assert!(words(&output).contains("60 pictures (camera)"), "{}", words(&output));
    let sensor = |folder: &str| fs::read_to_string(dir.path().join(folder).join("sensor.toml")).unwrap();
    assert_eq!(sensor("imported"), sensor("scan"));
    assert!(dir.path().join("imported/images/index.csv").exists());
    let base = ["calibrate", "scan", "--target", "board", "--board", "chessboard:9x6:20"];
    let output = trueline(dir.path(), &[base.as_slice(), &["--json", "board.json"]].concat());
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    assert!(String::from_utf8_lossy(&output.stdout).contains("time offset"));
    let result: Value = serde_json::from_slice(&fs::read(dir.path().join("board.json")).unwrap()).unwrap();
    let number = |value: &Value| value.as_f64().unwrap();
    let (offset_s, sigma_s) = (number(&result["time_offset_s"]), number(&result["sigma"]["time_offset_s"]));
    // One number beyond four standard deviations is one run in 16,000.
    assert!((offset_s - OFFSET_S).abs() < 4.0 * sigma_s && sigma_s < 0.3e-3, "{offset_s} ± {sigma_s}");
    for k in 0..3 {
        let off_mm = number(&result["tool_from_camera"]["translation_mm"][k])
            - tool_from_camera().translation.vector[k] * 1e3;
        let sigma_mm = number(&result["sigma"]["translation_mm"][k]);
        assert!(off_mm.abs() < 4.0 * sigma_mm && sigma_mm < 0.5, "axis {k}: {off_mm} ± {sigma_mm} mm");
    }
    // The noise is as it was taken: a dozen unknowns of 360 numbers.
    let factor = number(&result["residuals"]["noise_factor"]);
    assert!((0.7..1.4).contains(&factor), "{factor}");

    // Other commands take it as they take any other result.
    let exported = trueline(dir.path(), &["export", "board.json", "--as", "matrix"]);
    assert!(exported.status.code().is_some_and(|code| code != 101), "{}", words(&exported));

    // A file without a board is refused, and so is a board of another size.
    for (more, said) in
        [(["--residual", "sheet"], "cannot be used with"), (["--require", "time=1ms"], "cannot be used with")]
    {
        let output = trueline(dir.path(), &[base.as_slice(), &more].concat());
        assert_eq!(output.status.code(), Some(2));
        assert!(words(&output).contains(said), "{}", words(&output));
    }
    let other = ["calibrate", "scan", "--target", "board", "--board", "chessboard:7x5:20"];
    let output = trueline(dir.path(), &other);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        words(&output).contains("9 x 6 inner corners") && words(&output).contains("hint:"),
        "{}",
        words(&output)
    );
    fs::remove_dir_all(dir.path().join("scan/images")).unwrap();
    let output = trueline(dir.path(), &base);
    assert_eq!(output.status.code(), Some(2));
    assert!(words(&output).contains("no pictures"), "{}", words(&output));
    let output = trueline(dir.path(), &["calibrate", "scan", "--target", "board"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(words(&output).contains("--board"), "{}", words(&output));
}
