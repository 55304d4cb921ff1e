//! Written data are read back; units are converted; foreign formats are read.

use proptest::prelude::*;
use std::fs;
use std::path::Path;
use trueline_dataset::dialect::{Separator, plain_csv};
use trueline_dataset::import::foreign_csv::{self, ColumnMapping, Renaming, TableForm};
use trueline_dataset::import::{lvs_st_calib, tum};
use trueline_dataset::{Feature, Measured, Recording, RobotSample, Sensor, features_csv, folder, robot_csv};
use trueline_geometry::{Plane, se3, so3};

fn robot(count: i64) -> Vec<RobotSample> {
    (0..count)
        .map(|k| {
            let w = nalgebra::Vector3::new(0.1, 0.02 * k as f64, -0.3);
            let p = nalgebra::Vector3::new(1.0 + 1e-3 * k as f64, -2.0, 0.123_456_789_012_345);
            RobotSample {
                stamp_ns: 1_763_689_200_123_456_789 + 4_032_001 * k,
                device_ns: Some(77 + 4_032_000 * k),
                base_from_tool: se3::from_parts(so3::exp(&w), p),
            }
        })
        .collect()
}

fn features(measured: impl Fn(f64) -> Measured, sigma: Option<[f64; 2]>) -> Vec<Feature> {
    (0..20_i64)
        .map(|k| Feature {
            stamp_ns: 1_763_689_200_200_000_001 + 30_303_030 * (k / 2),
            line: (k % 2) as u32,
            frame: Some(7 + (k / 2) as u64),
            device_ns: Some(13 + 30_303_000 * (k / 2)),
            measured: measured(k as f64),
            sigma,
            correlation: sigma.map_or(0.0, |_| (k as f64 / 7.0).sin() * 0.999),
        })
        .collect()
}

fn assert_same(a: &Recording, b: &Recording) {
    assert_eq!(a.sensor.kind(), b.sensor.kind());
    if let (Sensor::CameraLaser { camera: x, .. }, Sensor::CameraLaser { camera: y, .. }) =
        (&a.sensor, &b.sensor)
    {
        assert_eq!(x, y);
    }
    assert_eq!(a.robot.len(), b.robot.len());
    for (x, y) in a.robot.iter().zip(&b.robot) {
        assert_eq!(x.stamp_ns, y.stamp_ns);
        // Millimetres and back: one rounding each way of numbers of size 2.
        assert!((x.base_from_tool.to_homogeneous() - y.base_from_tool.to_homogeneous()).norm() < 2e-15);
    }
    for (x, y) in a.features.iter().zip(&b.features) {
        assert_eq!(
            (x.stamp_ns, x.line, x.frame, x.sigma.is_some()),
            (y.stamp_ns, y.line, y.frame, y.sigma.is_some())
        );
        assert_eq!(x.correlation, y.correlation, "decimals that come back as they were");
        let numbers = |m: &Measured| match *m {
            Measured::Pixel([a, b]) | Measured::Profile([a, b]) => vec![a, b],
            Measured::Point(p) => p.to_vec(),
        };
        for (p, q) in numbers(&x.measured).iter().zip(numbers(&y.measured)) {
            assert!((p - q).abs() <= 1e-15 * p.abs().max(1.0));
        }
    }
}

#[test]
fn folders_of_every_kind() {
    let plane = Plane::from_height(0.036, 2.12, 0.1307).unwrap();
    let camera = trueline_model::Camera {
        size: [2448, 2000],
        focal: nalgebra::Vector2::new(3598.0, 3597.0),
        centre: nalgebra::Vector2::new(1211.0, 1007.0),
        distortion: trueline_model::BrownConrady { k1: -0.08, k2: 0.1, p1: 1e-4, p2: -1e-4, k3: 0.02 },
    };
    let kinds = [
        (
            Sensor::CameraLaser { camera, laser_plane_in_camera: plane },
            features(|k| Measured::Pixel([k + 0.1, 2.0 * k]), Some([0.2, 0.3])),
        ),
        (Sensor::Profiler, features(|k| Measured::Profile([1e-3 * k, 0.1]), Some([2e-5, 3e-5]))),
        (
            Sensor::Points { laser_plane_in_camera: None },
            features(|k| Measured::Point([1e-3 * k, 0.01, 0.1]), None),
        ),
        (
            Sensor::Points { laser_plane_in_camera: Some(plane) },
            features(|k| Measured::Point([1e-3 * k, 0.01, 0.1]), None),
        ),
    ];
    for (sensor, features) in kinds {
        let recording = Recording::new(sensor, Default::default(), robot(30), features);
        let dir = tempfile::tempdir().unwrap();
        folder::write(dir.path(), &recording).unwrap();
        assert_same(&recording, &folder::read(dir.path()).unwrap());
    }
}

#[test]
fn units_are_converted() {
    let robot = "time_ms,x_m,y_mm,z_m,qx,qy,qz,qw\n1.5,1,2000,3,0,0,0,1\n2500000e-3,1,2,3,0,0,0,1\n";
    let samples = robot_csv::read(Path::new("robot.csv"), robot.as_bytes()).unwrap();
    assert_eq!(samples[0].stamp_ns, 1_500_000);
    assert_eq!(samples[1].stamp_ns, 2_500_000_000);
    assert_eq!(samples[0].base_from_tool.translation.vector, nalgebra::Vector3::new(1.0, 2.0, 3.0));
    let features = "time_ns,x_m,z_mm\n12345678901234567,0.001,100\n";
    let features = features_csv::read(Path::new("f"), features.as_bytes(), &Sensor::Profiler).unwrap();
    assert_eq!(features[0].stamp_ns, 12_345_678_901_234_567);
    assert_eq!(features[0].measured, Measured::Profile([0.001, 0.1]));
}

#[test]
fn the_authors_simulation_is_a_logarithm_in_milliseconds() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("egm.txt"), "0 0 0 0 2100 0 1000\n4.5 0 0 1.5707963267948966 1000 0 0\n")
        .unwrap();
    fs::write(dir.path().join("cam.txt"), "1.25 1 2 3 4 5 6\n").unwrap();
    let recording = lvs_st_calib::read_simulation(dir.path()).unwrap();
    assert_eq!(recording.robot[1].stamp_ns, 4_500_000);
    // V(π/2 about z) (1, 0, 0) = (sin, 1 − cos, 0)/(π/2) = (2/π, 2/π, 0); read as a translation it would be x.
    let t = recording.robot[1].base_from_tool.translation.vector;
    let expected = nalgebra::Vector3::new(1.0, 1.0, 0.0) * std::f64::consts::FRAC_2_PI;
    assert!((t - expected).norm() < 1e-15, "{t}");
    assert_eq!(recording.features.len(), 2);
    assert_eq!((recording.features[1].line, recording.features[1].stamp_ns), (1, 1_250_000));
    assert_eq!(recording.features[1].measured, Measured::Point([0.004, 0.005, 0.006]));
}

#[test]
fn the_authors_recordings_take_the_centre_and_the_receive_stamp() {
    let dir = tempfile::tempdir().unwrap();
    let file = |name: &str, text: &str| {
        fs::write(dir.path().join(name), text).unwrap();
        dir.path().join(name)
    };
    let robot = file(
        "r",
        "10 5000 1000 2000 3000 0 0 90 0.70710678 0 0 0.70710678 77\n10 4005000 1000 2000 3000 0 0 90 0.70710678 0 0 0.70710678 4077\n",
    );
    let images = file("i", "10 7000000 0 123\n10 37000000 1 456\n");
    let pixels = file("p", "1 2 3 4 5 6\n11 12 13 14 15 16\n");
    let recording = lvs_st_calib::read_recording(&robot, &images, &pixels, Sensor::Profiler.into()).unwrap();
    assert_eq!(recording.robot[0].stamp_ns, 10_000_005_000);
    assert_eq!(recording.robot[0].base_from_tool.translation.vector, nalgebra::Vector3::new(1.0, 2.0, 3.0));
    assert_eq!(recording.features[1].measured, Measured::Pixel([13.0, 14.0]));
    assert_eq!((recording.features[1].stamp_ns, recording.features[1].frame), (10_037_000_000, Some(1)));
    let short = file("q", "1 2\n");
    let error = lvs_st_calib::read_recording(&robot, &images, &short, Sensor::Profiler.into()).unwrap_err();
    assert!(error.to_string().contains("has 1 rows where"), "{error}");
}

#[test]
fn tum_has_w_last_and_foreign_csv_is_renamed() {
    let dir = tempfile::tempdir().unwrap();
    let poses = dir.path().join("poses.txt");
    fs::write(&poses, "# timestamp tx ty tz qx qy qz qw\n1.5 1 2 3 0 0 1 0\n1.6 1 2 3 0 0 1 0\n").unwrap();
    let samples = tum::read_robot(&poses).unwrap();
    assert!((samples[0].base_from_tool.rotation.quaternion().k - 1.0).abs() < 1e-15);
    let foreign = Path::new("log.csv");
    let read = |mapping: &[ColumnMapping]| {
        let renaming = Renaming { map: mapping, layout: None, is_ours: &|_| false };
        let text = b"stamp|col|row|note\n1|10|20|a\n2|11|21|b\n".to_vec();
        let form = TableForm { separator: Some(Separator::Character('|')), ..TableForm::default() };
        foreign_csv::read(foreign, text, &form, &renaming)
    };
    let map = |ours: &str, theirs: &str| ColumnMapping { ours: ours.into(), theirs: theirs.into() };
    let renamed = read(&[map("time_ms", "stamp"), map("u_px", "col"), map("v_px", "row")]).unwrap();
    assert_eq!(renamed.left_out, ["note"]);
    assert_eq!(String::from_utf8(renamed.csv).unwrap(), "time_ms,u_px,v_px\n1,10,20\n2,11,21\n");
    assert!(read(&[map("u_px", "nothing")]).is_err());
}

proptest! {
    /// For any bytes in a file, reading ends in a table or in an error, never in a panic.
    #[test]
    fn any_bytes_are_survived(bytes in proptest::collection::vec(any::<u8>(), 0..200), cut in 0..120_usize) {
        let _ = robot_csv::read(Path::new("robot.csv"), bytes.as_slice());
        let _ = features_csv::read(Path::new("features.csv"), bytes.as_slice(), &Sensor::Profiler);
        let _ = plain_csv(Path::new("robot.csv"), bytes.clone(), None);
        let text = String::from_utf8_lossy(&bytes);
        let _ = trueline_dataset::sensor_toml::parse(Path::new("sensor.toml"), &text);
        let _ = trueline_dataset::stamp::parse_nanoseconds(&text, 9);
        let mut damaged = b"time_s,x_mm,y_mm,z_mm,qw,qx,qy,qz\n0.000,1,2,3,1,0,0,0\n0.004,1,2,3,1,0,0,0\n".to_vec();
        damaged.truncate(cut);
        damaged.extend(&bytes[..bytes.len().min(5)]);
        let _ = robot_csv::read(Path::new("robot.csv"), damaged.as_slice());
    }
}
