//! A result as a placer's calibration: what of it is taken, and what is refused.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use std::path::Path;
use trueline::rt::{AxisCarries, Carrier, Placer, Points, StampRule};
use trueline::{Error, ResultFile, RunTime, RunTimeError};
use trueline_dataset::{SensorFile, sensor_toml};

const NAMES: &str = r#"["time_offset_s", "rotation_x_rad", "rotation_y_rad", "rotation_z_rad",
    "translation_x_mm", "translation_y_mm", "translation_z_mm"]"#;

/// A result with other parts in it.
fn result(more: &str) -> ResultFile {
    let row = |k: usize| (0..7).map(|i| if i == k { "1e-4" } else { "0" }).collect::<Vec<_>>().join(",");
    let rows: Vec<String> = (0..7).map(|k| format!("[{}]", row(k))).collect();
    let text = format!(
        r#"{{ "schema_version": 3, "status": "accepted", "time_offset_s": 0.01,
            "tool_from_camera": {{ "translation_mm": [50, 0, 100], "rotation_wxyz": [1, 0, 0, 0] }},
            "covariance": {{ "order": {NAMES}, "matrix": [{}] }}, "residuals": {{ "rms_mm": 0.03 }} {more} }}"#,
        rows.join(",")
    );
    ResultFile::parse(Path::new("result.json"), &text).unwrap()
}

fn profiler() -> SensorFile {
    sensor_toml::parse_file(Path::new("sensor.toml"), "kind = \"profiler\"\n").unwrap()
}

fn run_time<'a>(sensor: &'a SensorFile, standing: &'a [String]) -> RunTime<'a> {
    RunTime { sensor, sensor_sha256: Some("abc"), reading_sigma_m: None, standing, in_pose: &[] }
}

fn refused(result: &ResultFile, standing: &[String]) -> RunTimeError {
    match run_time(&profiler(), standing).placer(result) {
        Err(Error::RunTime(error)) => error,
        other => panic!("{other:?}"),
    }
}

#[test]
fn lengths_and_variances_come_in_metres() {
    let sensor = profiler();
    let setup = run_time(&sensor, &[]).placer(&result("")).unwrap();
    let calibration = &setup.calibration;
    assert_eq!((calibration.time_offset_s, calibration.carrier), (0.01, Carrier::Tool));
    assert!((calibration.tool_from_camera.translation.x - 0.05).abs() < 1e-15);
    // 1e-4 mm² are 1e-10 m².
    assert!((calibration.covariance[(4, 4)] - 1e-10).abs() < 1e-24 && calibration.covariance[(1, 1)] == 1e-4);
    assert!((calibration.reading_sigma_m - 3e-5).abs() < 1e-18);
    let mut placer = Placer::new(calibration, &setup.settings).unwrap();
    for k in 0..100 {
        placer.push_pose(4_000_000 * k, &trueline::Pose::identity()).unwrap();
    }
    let (mut base, mut sigma) = ([[0.0; 3]], [0.0]);
    placer.place(210_000_000, Points::Profile(&[[0.0, 0.2]]), &mut base, &mut sigma).unwrap();
    assert!((base[0][2] - 0.3).abs() < 1e-12);
}

#[test]
fn stamps_are_taken_as_the_result_took_them() {
    let sensor = profiler();
    let late = r#", "stamps": { "robot": { "used": "regular", "one_sided": true },
        "features": { "used": "regular", "one_sided": false, "jitter_s": 0.0004 } }"#;
    let settings = run_time(&sensor, &[]).placer(&result(late)).unwrap().settings;
    assert_eq!(
        (settings.pose_stamps, settings.frame_stamps, settings.stamp_sigma_s),
        (StampRule::LowerEnvelope, StampRule::AsStamped, 0.0004)
    );
    let plain = run_time(&sensor, &[]).placer(&result("")).unwrap().settings;
    assert_eq!((plain.pose_stamps, plain.stamp_sigma_s), (StampRule::AsStamped, 0.0));
}

const TRACK: &str = r#", "axes": [{ "name": "track", "kind": "linear", "carries": "robot", "direction": [1, 0, 0],
    "scale": 1, "time_offset_s": 0.02, "sigma": { "direction_deg": 0.1, "scale": 0 } }]"#;

#[test]
fn axes_are_those_of_the_result_in_its_order() {
    let sensor = profiler();
    let setup = run_time(&sensor, &[]).placer(&result(TRACK)).unwrap();
    let axis = &setup.calibration.axes[0];
    assert_eq!(
        (setup.axes[0].as_str(), axis.carries, axis.axis.time_offset_s),
        ("track", AxisCarries::Robot, 0.02)
    );
    assert!((axis.covariance[(0, 0)].sqrt() - 0.1_f64.to_radians()).abs() < 1e-15);
    let hidden = TRACK.replace("[1, 0, 0]", "null").replace("0.1", "null");
    assert_eq!(refused(&result(&hidden), &[]), RunTimeError::AxisUnknown { name: "track".to_owned() });
    let standing = ["track".to_owned()];
    assert!(run_time(&sensor, &standing).placer(&result(&hidden)).unwrap().axes.is_empty());
    assert_eq!(refused(&result(""), &standing), RunTimeError::NoSuchAxis { name: "track".to_owned() });
}

#[test]
fn what_would_place_points_wrongly_is_refused() {
    let other = r#", "sensor": { "file": { "name": "sensor.toml", "sha256": "def", "corrected": false } }"#;
    assert_eq!(
        refused(&result(other), &[]),
        RunTimeError::OtherSensorFile { name: "sensor.toml".to_owned() }
    );
    let drift = r#", "stamps": { "features": { "drift_taken_out": true, "drift_ppm": 20 } }"#;
    assert_eq!(refused(&result(drift), &[]), RunTimeError::Drift { drift_ppm: 20.0 });
    let mut bare = result("");
    bare.covariance.order.clear();
    bare.covariance.matrix.clear();
    assert_eq!(refused(&bare, &[]), RunTimeError::NoCovariance);
    let mut hidden = result("");
    hidden.time_offset_s = None;
    assert!(matches!(run_time(&profiler(), &[]).placer(&hidden), Err(Error::File(_))));
    for error in [refused(&bare, &[]), refused(&result(other), &[]), refused(&result(drift), &[])] {
        assert!(!Error::from(error).hint().is_empty());
    }
}
