//! `trueline sensor laser-plane --plate` as a user runs it, on rendered pictures of a plain plate before a robot.
#![allow(clippy::print_stderr, reason = "a skipped test says so")]

use crate::common;

use common::words;
use nalgebra::{UnitQuaternion, Vector2, Vector3};
use serde_json::Value;
use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};
use trueline_dataset::sensor_setup::SensorSetup;
use trueline_dataset::sensor_toml::{CameraFile, format_camera, parse_camera};
use trueline_dataset::{Guess, gray_png, known_toml};
use trueline_geometry::{Plane, Pose, se3, so3};
use trueline_model::{BrownConrady, Camera};
use trueline_sim::boards::{BoardScene, Stripe, render};
use trueline_sim::noise::Noise;

const STOPS: usize = 14;

fn camera() -> Camera {
    Camera {
        size: [320, 240],
        focal: Vector2::new(280.0, 281.0),
        centre: Vector2::new(161.0, 118.0),
        distortion: BrownConrady { k1: -0.1, k2: 0.03, ..BrownConrady::default() },
    }
}

fn laser_plane() -> Plane {
    Plane::new(Vector3::new(0.03, 0.866, 0.5).normalize(), 0.2).unwrap()
}

fn tool_from_camera() -> Pose {
    se3::from_parts(so3::exp(&Vector3::new(0.2, -0.3, 1.5)), Vector3::new(0.060, -0.020, 0.140))
}

/// `camera_from_plate` at a stop, the plate's origin where the laser meets it in the middle of the view.
fn view(k: usize, tilt_rad: f64) -> Pose {
    let (angle, n) = (2.399_963 * k as f64, laser_plane().normal().into_inner());
    let depth_m = 0.33 + 0.03 * (k % 6) as f64;
    let point = Vector3::new(0.0, (laser_plane().offset() - n.z * depth_m) / n.y, depth_m);
    let tilt = so3::exp(&(Vector3::new(angle.cos(), angle.sin(), 0.0) * (tilt_rad * [1.0, 0.6, 0.3][k % 3])));
    se3::from_parts(tilt * so3::exp(&(Vector3::x() * std::f64::consts::PI)), point)
}

/// Pictures, their poses, camera and a rough hand-eye transform.
fn record(folder: &Path, tilt_rad: f64) {
    fs::create_dir_all(folder).unwrap();
    let file = CameraFile { camera: camera(), laser_plane_in_camera: None, setup: SensorSetup::default() };
    fs::write(folder.join("camera.toml"), format_camera(&file)).unwrap();
    let off = (Vector3::new(0.08, -0.06, 0.1), Vector3::new(0.012, -0.010, 0.008));
    let rough = se3::retract_decoupled(&tool_from_camera(), &off.0, &off.1);
    let guess = Guess { time_offset_s: 0.0, tool_from_camera: rough };
    fs::write(folder.join("initial.toml"), known_toml::format(&guess, &[])).unwrap();
    let base_from_plate =
        se3::from_parts(so3::exp(&Vector3::new(0.1, -0.1, 0.7)), Vector3::new(0.9, -0.2, 0.3));
    let mut noise = Noise::new(9, 1);
    let mut normal = |sigma: f64| Vector3::from_fn(|_, _| noise.normal(sigma));
    let mut table = "picture,x_mm,y_mm,z_mm,qw,qx,qy,qz\n".to_owned();
    for k in 0..STOPS {
        let view = view(k, tilt_rad);
        // The renderer's plate is anywhere on the true one: half a square beyond its origin is still 250 mm.
        let scene = BoardScene {
            camera: camera(),
            camera_from_board: view,
            corners: [0, 0],
            square_m: 0.5,
            levels: [40.0, 120.0, 90.0],
            blur_px: 0.8,
            noise: 2.0,
            stripe: Some(Stripe {
                laser_plane_in_camera: laser_plane(),
                brightness: 100.0,
                thickness_m: 0.6e-3,
            }),
        };
        gray_png::write(&folder.join(format!("{k:02}.png")), &render(&scene, k as u64)).unwrap();
        let place = Vector3::new(0.03 * (k as f64).cos(), 0.02 * k as f64 - 0.1, 0.0);
        let on_plate = se3::from_parts(UnitQuaternion::identity(), place);
        let wrong = se3::from_parts(so3::exp(&normal(2e-5)), normal(0.03e-3));
        let pose = base_from_plate * on_plate * view.inverse() * tool_from_camera().inverse() * wrong;
        let (p, q) = (pose.translation.vector * 1e3, pose.rotation.quaternion());
        writeln!(table, "{k:02}.png,{},{},{},{},{},{},{}", p.x, p.y, p.z, q.w, q.i, q.j, q.k).unwrap();
    }
    fs::write(folder.join("poses.csv"), table).unwrap();
}

fn calibrate(folder: &Path, more: &[&str]) -> Output {
    let base = [
        "sensor",
        "laser-plane",
        "poses.csv",
        "--plate",
        "--sensor",
        "camera.toml",
        "--initial",
        "initial.toml",
    ];
    let arguments = [base.as_slice(), more].concat();
    Command::new(env!("CARGO_BIN_EXE_trueline")).current_dir(folder).args(arguments).output().unwrap()
}

#[test]
fn a_plain_plate_and_the_robot_give_the_laser_plane_with_its_uncertainty() {
    let folder = tempfile::tempdir().unwrap();
    record(folder.path(), 0.45);
    let output = calibrate(folder.path(), &["--json", "plane.json", "--out", "sensor.toml"]);
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    let result: Value = serde_json::from_slice(&fs::read(folder.path().join("plane.json")).unwrap()).unwrap();
    assert_eq!(result["stops"], STOPS);
    let text = fs::read_to_string(folder.path().join("sensor.toml")).unwrap();
    let file = parse_camera(Path::new("sensor.toml"), &text).unwrap();
    let (found, truth) = (file.laser_plane_in_camera.unwrap(), laser_plane());
    let covariance = file.setup.uncertainty.unwrap().covariance.unwrap();
    assert_eq!(covariance.order.len(), 3, "an exact camera has no covariance");
    let tilt_rad = found.normal().cross(truth.normal()).norm();
    let offset_m = (found.offset() - truth.offset()).abs();
    let sigma = |k: usize| covariance.matrix[(k, k)].sqrt();
    // Two tilts and an offset, none beyond four standard deviations; and these as small as 14 stops make them.
    assert!(
        tilt_rad < 4.0 * sigma(0).hypot(sigma(1)) && tilt_rad < 5e-3,
        "{tilt_rad} ± {} {}",
        sigma(0),
        sigma(1)
    );
    assert!(offset_m < 4.0 * sigma(2) && offset_m < 2e-3, "{offset_m} ± {}", sigma(2));
}

#[test]
fn stops_at_one_attitude_are_refused_with_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    record(folder.path(), 0.0);
    let output = calibrate(folder.path(), &["--json", "-"]);
    assert_eq!(output.status.code(), Some(1), "{}", words(&output));
    let result: Value = serde_json::from_slice(&output.stdout).unwrap();
    let codes: Vec<&str> =
        result["reasons"].as_array().unwrap().iter().map(|reason| reason["code"].as_str().unwrap()).collect();
    assert!(codes.contains(&"plane-offset-uncertain") && codes.contains(&"too-little-tilt"), "{codes:?}");
}

#[test]
fn a_table_of_other_columns_and_a_missing_guess_are_told() {
    let folder = tempfile::tempdir().unwrap();
    record(folder.path(), 0.45);
    fs::write(folder.path().join("poses.csv"), "picture,x_mm,y_mm\n00.png,1,2\n").unwrap();
    let output = calibrate(folder.path(), &[]);
    assert_eq!(output.status.code(), Some(2));
    assert!(words(&output).contains("poses.csv") && words(&output).contains("hint:"), "{}", words(&output));
    let arguments = ["sensor", "laser-plane", "poses.csv", "--plate", "--sensor", "camera.toml"];
    let output = Command::new(env!("CARGO_BIN_EXE_trueline"))
        .current_dir(folder.path())
        .args(arguments)
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(words(&output).contains("--initial"), "{}", words(&output));
}

/// Pictures that another program drew: a stripe of 12 px and more with a halo, saturated.
#[test]
fn a_thick_stripe_on_a_plate_is_found_in_every_picture() {
    let shared = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/cases/thick-stripe/wide");
    let Ok(entries) = fs::read_dir(&shared) else {
        eprintln!("SKIPPED: cases_thick_stripe: there is no {}", shared.display());
        return;
    };
    let dir = tempfile::tempdir().unwrap();
    for entry in entries {
        let path = entry.unwrap().path();
        fs::copy(&path, dir.path().join(path.file_name().unwrap())).unwrap();
    }
    let arguments =
        "sensor laser-plane poses.csv --plate --sensor camera.toml --initial initial.toml --json plane.json";
    let output = Command::new(env!("CARGO_BIN_EXE_trueline"))
        .current_dir(dir.path())
        .args(arguments.split(' '))
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(said.contains("10 of 10"), "{said}");
    let json: Value = serde_json::from_slice(&fs::read(dir.path().join("plane.json")).unwrap()).unwrap();
    let normal = Vector3::from_fn(|k, _| json["normal"][k].as_f64().unwrap());
    let made = Vector3::new(-0.85, -0.12, 0.51).normalize();
    // Its ± are 0.006 degrees.
    assert!(normal.cross(&made).norm() < 4e-4, "{normal}");
}
