//! Pose sightings as users calibrate them: cast, calibrated, exported, refused.

use crate::common::{ends_with, text, trueline};
use serde_json::Value;
use std::fs;
use std::path::Path;

/// The result of a calibration that ends with this code.
fn calibrated(folder: &Path, arguments: &[&str], expected: i32) -> Value {
    let all = [&["calibrate"][..], arguments, &["--json", "result.json", "--quiet"]].concat();
    ends_with(&trueline(folder, &all), expected);
    serde_json::from_slice(&fs::read(folder.join("result.json")).unwrap()).unwrap()
}

/// Largest error of the translation in its standard deviations, and of the time offset.
fn off_in_sigmas(result: &Value, dataset: &Path) -> f64 {
    let truth: toml::Table =
        toml::from_str(&fs::read_to_string(dataset.join("truth.toml")).unwrap()).unwrap();
    let place = truth["tool_from_camera"]["translation_mm"].as_array().unwrap();
    let mut worst: f64 = 0.0;
    for (k, expected) in place.iter().enumerate() {
        let found = result["tool_from_camera"]["translation_mm"][k].as_f64().unwrap();
        let sigma = result["sigma"]["translation_mm"][k].as_f64().unwrap();
        worst = worst.max((found - expected.as_float().unwrap()).abs() / sigma);
    }
    if let Some(found) = result["time_offset_s"].as_f64() {
        let sigma = result["sigma"]["time_offset_s"].as_f64().unwrap();
        worst = worst.max((found - truth["time_offset_s"].as_float().unwrap()).abs() / sigma);
    }
    worst
}

#[test]
fn a_marker_before_a_moving_robot_gives_time_offset_hand_eye_and_target() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let cast = ["simulate", "--sightings", "--outliers", "0.3", "--time-offset-ms", "-820", "--out", "scan"];
    ends_with(&trueline(folder, &cast), 0);
    let result = calibrated(folder, &["scan"], 0);
    // Four numbers beyond four standard deviations: one run in 4,000.
    assert!(off_in_sigmas(&result, &folder.join("scan")) < 4.0, "{result:#}");
    assert_eq!(result["schema_version"], 3);
    assert_eq!(result["lines"].as_array().unwrap().len(), 0);
    assert_eq!(result["residuals"]["rms_px"], Value::Null);
    let (used, outliers) = (&result["residuals"]["used"], result["residuals"]["outliers"].as_u64().unwrap());
    // 300 draws of 0.3: a spread of 8.
    assert!(outliers.abs_diff(90) < 40, "{outliers} of {used}");
    assert!(result["residuals"]["rms_deg"].as_f64().unwrap() < 0.5);
    assert!(result["base_from_target"]["translation_mm"][0].is_f64());
    assert_eq!(result["inputs"].as_object().unwrap().len(), 3);
    for form in ["matrix", "ros2", "time-offset"] {
        ends_with(&trueline(folder, &["export", "result.json", "--as", form]), 0);
    }
    // The guess next to the recording is used, and held values stay.
    fs::copy(folder.join("scan/truth.toml"), folder.join("guess.toml")).unwrap();
    let held = calibrated(folder, &["scan", "--initial", "guess.toml", "--fix", "time-offset"], 0);
    assert!((held["time_offset_s"].as_f64().unwrap() + 0.82).abs() < 1e-12);
    assert_eq!(held["sigma"]["time_offset_s"], Value::Null);
    // A summary for people.
    let said = trueline(folder, &["calibrate", "scan"]);
    ends_with(&said, 0);
    assert!(text(&said).contains("of 300 sightings"), "{}", text(&said));
}

#[test]
fn stops_and_a_camera_beside_the_robot_are_calibrated_alike() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    ends_with(
        &trueline(folder, &["simulate", "--sightings", "--stops", "--wall", "--out", "stops", "--quiet"]),
        0,
    );
    assert!(!folder.join("stops/robot.csv").exists() && folder.join("stops/poses.csv").exists());
    let result = calibrated(folder, &["stops"], 0);
    assert!(off_in_sigmas(&result, &folder.join("stops")) < 4.0, "{result:#}");
    assert_eq!(result["time_offset_s"], Value::Null);
    assert_eq!((&result["mounted"], &result["options"]["at_stops"]), (&"fixed".into(), &true.into()));
    ends_with(&trueline(folder, &["export", "result.json", "--as", "matrix"]), 0);
    ends_with(
        &trueline(
            folder,
            &["simulate", "--sightings", "--wall", "--state-noise", "--out", "wall", "--quiet"],
        ),
        0,
    );
    let result = calibrated(folder, &["wall"], 0);
    assert!(off_in_sigmas(&result, &folder.join("wall")) < 4.0, "{result:#}");
    assert_eq!(result["base_from_target"]["noise_stated"], true);
}

#[test]
fn what_the_motion_hides_is_null_and_named_and_the_exit_code_is_1() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    ends_with(&trueline(folder, &["simulate", "--sightings", "shifts", "--out", "shifts", "--quiet"]), 0);
    let result = calibrated(folder, &["shifts"], 1);
    assert_eq!(result["status"], "not_accepted");
    let hidden = result["observability"]["unobservable"].as_array().unwrap();
    assert!(hidden.iter().all(|entry| entry["parameter"] == "hand_eye_translation"), "{hidden:?}");
    assert_eq!(hidden.len(), 3);
    assert!(hidden[0]["advice"].as_str().unwrap().contains("Turn the tool"), "{hidden:?}");
    assert_eq!(result["tool_from_camera"]["translation_mm"], serde_json::json!([null, null, null]));
    assert_eq!(result["sigma"]["translation_mm"], serde_json::json!([null, null, null]));
    assert_eq!(result["reasons"][0]["code"], "unobservable");
}

#[test]
fn options_of_seams_and_broken_files_are_refused_with_their_place() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    ends_with(
        &trueline(folder, &["simulate", "--sightings", "--sighting-count", "60", "--out", "scan", "--quiet"]),
        0,
    );
    for option in [
        &["--use", "stripe"][..],
        &["--sensor", "free"],
        &["--residual", "point-to-line"],
        &["--report", "report.html"],
        &["--fix", "hand-eye"],
        &["--require", "time=1ms"],
        &["--speed-mm-s", "20"],
    ] {
        let output = trueline(folder, &[&["calibrate", "scan"][..], option].concat());
        ends_with(&output, 2);
        assert!(text(&output).contains(option[0]), "{}", text(&output));
    }
    // Other commands say what the folder holds.
    for command in [&["doctor", "scan"][..], &["evaluate", "scan", "--calibration", "result.json"]] {
        let output = trueline(folder, command);
        ends_with(&output, 2);
    }
    let doctor = text(&trueline(folder, &["doctor", "scan"]));
    assert!(doctor.contains("poses") && doctor.contains("trueline calibrate"), "{doctor}");
    let file = folder.join("scan/sightings.csv");
    let good = fs::read_to_string(&file).unwrap();
    let header = good.lines().next().unwrap();
    for (bad, expected) in [
        (good.replacen("qz", "qz,sigma_mm", 1), "line 2"),
        (good.replacen("x_mm", "x", 1), "x_mm"),
        (format!("{header}\n1.0,0,0,400,1,0,0\n"), "line 2"),
        (format!("{header}\n1.0,0,0,400,2,0,0,0\n"), "line 2"),
        (format!("{header}\n1.0,0,0,nan,1,0,0,0\n"), "line 2"),
        (format!("{header}\n2.0,0,0,400,1,0,0,0\n1.0,0,0,400,1,0,0,0\n"), "line 3"),
        (good.replacen("time_s", "stop", 1), "poses.csv"),
        (format!("{header}\n"), "sightings.csv"),
    ] {
        fs::write(&file, &bad).unwrap();
        let output = trueline(folder, &["calibrate", "scan"]);
        ends_with(&output, 2);
        let said = text(&output);
        assert!(said.contains("sightings.csv") && said.contains(expected), "{expected}: {said}");
        assert!(said.contains("hint:"), "{said}");
    }
    fs::write(
        folder.join("scan/sensor.toml"),
        "kind = \"poses\"\n[laser_plane]\nnormal = [0, 0, 1]\noffset_mm = 9\n",
    )
    .unwrap();
    let output = trueline(folder, &["calibrate", "scan"]);
    ends_with(&output, 2);
    assert!(text(&output).contains("laser_plane"), "{}", text(&output));
}
