//! Several sensors on one robot: cast, calibrated together, refused.

use crate::common;

use common::{code, trueline, words};
use serde_json::Value;
use std::fs;
use std::path::Path;

fn cast(folder: &Path) {
    let output = trueline(
        folder,
        &["simulate", "--preset", "good", "--sensors", "3", "--seed", "6", "--out", "three"],
    );
    assert_eq!(code(&output), 0, "{}", words(&output));
}

fn calibrated(folder: &Path, arguments: &[&str], expected: i32) -> Value {
    let output =
        trueline(folder, &[&["calibrate", "three", "--json", "r.json", "--quiet"][..], arguments].concat());
    assert_eq!(code(&output), expected, "{}", words(&output));
    serde_json::from_slice(&fs::read(folder.join("r.json")).unwrap()).unwrap()
}

fn translation(of: &Value) -> [f64; 3] {
    std::array::from_fn(|k| of["translation_mm"][k].as_f64().unwrap())
}

#[test]
fn sensors_are_calibrated_together_and_tied_by_their_seam() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    cast(folder);
    // The simulated robot has noise, and no error that lasts.
    let exact = ["--robot-accuracy-mm", "0", "--feature-bias-px", "0"];
    let result = calibrated(folder, &exact, 0);
    let sensors = result["sensors"].as_array().unwrap();
    assert_eq!(sensors.len(), 3);
    for sensor in sensors {
        let name = sensor["name"].as_str().unwrap();
        let file = folder.join("three/sensors").join(name).join("truth.toml");
        let truth: toml::Table = toml::from_str(&fs::read_to_string(file).unwrap()).unwrap();
        let expected = truth["tool_from_camera"]["translation_mm"].as_array().unwrap();
        let found = translation(&sensor["tool_from_camera"]);
        for k in 0..3 {
            let sigma = sensor["sigma"]["translation_mm"][k].as_f64().unwrap();
            let off = (found[k] - expected[k].as_float().unwrap()).abs();
            assert!(off < 4.5 * sigma, "{name} {k}: {off} of {sigma}");
        }
        let late_s = sensor["time_offset_s"].as_f64().unwrap() - truth["time_offset_s"].as_float().unwrap();
        assert!(late_s.abs() < 4.5 * sensor["sigma"]["time_offset_s"].as_f64().unwrap(), "{name}: {late_s}");
    }
    // The result of all is nobody's in particular.
    let applied =
        trueline(folder, &["apply", "three/sensors/b", "--calibration", "r.json", "--out", "x.csv"]);
    assert_eq!(code(&applied), 2, "{}", words(&applied));
    // By itself each knows less of its translation along the seam's cross directions, or as much.
    let alone = trueline(
        folder,
        &[&["calibrate", "three/sensors/a", "--json", "a.json", "--quiet"][..], &exact].concat(),
    );
    assert_eq!(code(&alone), 0, "{}", words(&alone));
    let alone: Value = serde_json::from_slice(&fs::read(folder.join("a.json")).unwrap()).unwrap();
    for k in 0..3 {
        let [together, alone] =
            [&sensors[0]["sigma"], &alone["sigma"]].map(|sigma| sigma["translation_mm"][k].as_f64().unwrap());
        assert!(together <= alone * (1.0 + 1e-9), "{k}: {together} {alone}");
    }
    let between = result["between"].as_array().unwrap();
    assert_eq!(between.iter().map(|b| b["to"].as_str().unwrap()).collect::<Vec<_>>(), ["b", "c"]);
}

#[test]
fn sensors_that_saw_two_seams_under_one_number_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    cast(folder);
    // The second sensor has poses of its own, 5 mm off in two directions: so is its seam.
    let robot = fs::read_to_string(folder.join("three/robot.csv")).unwrap();
    let moved: String = robot
        .lines()
        .enumerate()
        .map(|(k, row)| {
            let mut fields: Vec<String> = row.split(',').map(str::to_owned).collect();
            if k > 0 {
                fields[1] = (fields[1].parse::<f64>().unwrap() + 5.0).to_string();
                fields[3] = (fields[3].parse::<f64>().unwrap() + 5.0).to_string();
            }
            fields.join(",") + "\n"
        })
        .collect();
    fs::write(folder.join("three/sensors/b/robot.csv"), moved).unwrap();
    let result = calibrated(folder, &["--robot-accuracy-mm", "0", "--feature-bias-px", "0"], 1);
    assert_eq!(result["status"], "not_accepted");
    assert_eq!(result["reasons"][0]["code"], "sensors-disagree");
    assert!(result.get("sensors").is_none());
}

#[test]
fn what_is_of_one_sensor_is_refused_for_several() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    cast(folder);
    for option in [
        &["--initial", "three/sensors/a/truth.toml"][..],
        &["--write-sensor", "s.toml"],
        &["--report", "r.html"],
    ] {
        let output = trueline(folder, &[&["calibrate", "three"][..], option].concat());
        assert_eq!(code(&output), 2, "{}", words(&output));
        assert!(words(&output).contains(option[0]), "{}", words(&output));
    }
    fs::copy(folder.join("three/sensors/a/sensor.toml"), folder.join("three/sensor.toml")).unwrap();
    let output = trueline(folder, &["calibrate", "three"]);
    assert_eq!(code(&output), 2, "{}", words(&output));
    fs::remove_file(folder.join("three/sensor.toml")).unwrap();
    fs::remove_dir_all(folder.join("three/sensors/b")).unwrap();
    fs::remove_dir_all(folder.join("three/sensors/c")).unwrap();
    let output = trueline(folder, &["calibrate", "three"]);
    assert_eq!(code(&output), 2, "{}", words(&output));
    assert!(words(&output).contains("need at least two"), "{}", words(&output));
}
