//! `calibrate --target sphere` and `--target cylinder`, as their user runs them: simulated, real profiles at stops, what is refused.
#![allow(clippy::print_stderr, reason = "a skipped test says so")]

use crate::common::{ends_with, text, trueline};
use serde_json::Value;
use std::fmt::Write;
use std::fs;
use std::path::Path;

/// The result of a calibration that ends with this code.
fn calibrated(folder: &Path, arguments: &[&str], expected: i32) -> Value {
    let all =
        [&["calibrate"][..], arguments, &["--target", "sphere", "--json", "result.json", "--quiet"]].concat();
    ends_with(&trueline(folder, &all), expected);
    serde_json::from_slice(&fs::read(folder.join("result.json")).unwrap()).unwrap()
}

fn three(value: &Value) -> [f64; 3] {
    [0, 1, 2].map(|k| value[k].as_f64().unwrap_or_else(|| panic!("{value}")))
}

/// Errors of numbers in their standard deviations, the largest.
fn off(found: &Value, sigma: &Value, truth: &toml::Value) -> f64 {
    let (found, sigma) = (three(found), three(sigma));
    let expected = |k: usize| truth[k].as_float().unwrap();
    (0..3).map(|k| (found[k] - expected(k)).abs() / sigma[k]).fold(0.0, f64::max)
}

#[test]
fn a_simulated_sphere_gives_its_truth_with_and_without_a_radius_moving_and_at_stops() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let cases: [(&[&str], &[&str]); 3] = [
        (&["--time-offset-ms", "-640"], &["--radius-mm", "20"]),
        (&["--wall"], &[]),
        (&["--stops"], &["--radius-mm", "20", "--robot-accuracy-mm", "0.12"]),
    ];
    for (k, (cast, options)) in cases.into_iter().enumerate() {
        let name = format!("scan-{k}");
        let cast = [&["simulate", "--target", "sphere", "--quiet", "--out", &name][..], cast].concat();
        ends_with(&trueline(folder, &cast), 0);
        let result = calibrated(folder, &[&[&name[..]], options].concat(), 0);
        let truth: toml::Value =
            toml::from_str(&fs::read_to_string(folder.join(&name).join("truth.toml")).unwrap()).unwrap();
        // Six numbers beyond four standard deviations: one run in 2,600.
        let hand_eye = off(
            &result["tool_from_camera"]["translation_mm"],
            &result["sigma"]["translation_mm"],
            &truth["tool_from_camera"]["translation_mm"],
        );
        let sphere = &result["sphere"];
        let center = off(
            &sphere["center_mm"],
            &sphere["sigma_center_mm"],
            &truth["base_from_target"]["translation_mm"],
        );
        assert!(hand_eye < 4.0 && center < 4.0, "{name}: {hand_eye} {center} {result:#}");
        assert_eq!(sphere["sigma_radius_mm"].is_null(), !options.is_empty(), "{sphere}");
        let radius_mm = sphere["radius_mm"].as_f64().unwrap();
        assert!((radius_mm - 20.0).abs() < 4.0 * sphere["sigma_radius_mm"].as_f64().unwrap_or(1e-12));
        assert_eq!(result["mounted"], if k == 1 { Value::from("fixed") } else { Value::Null });
        assert!(result["base_from_target"].is_null(), "{result:#}");
        assert!(result["checks"]["held_out"]["rms_mm"].as_f64().unwrap() > 0.0, "{result:#}");
    }
}

#[test]
fn what_the_motion_hides_is_named_and_null() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let cast = ["simulate", "--target", "sphere", "--motion", "shifts", "--quiet", "--out", "shifts"];
    ends_with(&trueline(folder, &cast), 0);
    let result = calibrated(folder, &["shifts", "--radius-mm", "20"], 1);
    let hidden = result["observability"]["unobservable"].as_array().unwrap();
    assert!(hidden.iter().any(|entry| entry["parameter"] == "hand_eye_translation"), "{hidden:?}");
    assert_eq!(result["tool_from_camera"]["translation_mm"], serde_json::json!([null, null, null]));
}

#[test]
fn options_of_seams_and_scans_without_a_sphere_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let cast = ["simulate", "--target", "sphere", "--stops", "--quiet", "--out", "scan"];
    ends_with(&trueline(folder, &cast), 0);
    for (arguments, expected) in [
        (&["scan", "--target", "sphere", "--use", "stripe"][..], "--use"),
        (&["scan", "--target", "sphere", "--report", "report.html"], "--report"),
        (&["scan", "--radius-mm", "20"], "--target"),
        (&["scan", "--target", "line", "--radius-mm", "20"], "--target sphere"),
        (&["scan", "scan", "--target", "sphere"], "one dataset"),
        (&["scan", "--target", "sphere", "--radius-mm", "6"], "of 24 profiles"),
    ] {
        let output = trueline(folder, &[&["calibrate"][..], arguments].concat());
        ends_with(&output, 2);
        assert!(text(&output).contains(expected), "{expected}: {}", text(&output));
    }
}

/// The points (x, z) of a profile of RobCalibrator, mm.
fn scan_line(file: &Path) -> Vec<[f64; 2]> {
    let text = fs::read_to_string(file).unwrap();
    let inside = text.split_once('[').unwrap().1.split_once(']').unwrap().0;
    let numbers: Vec<f64> =
        inside.split(',').map(|number| number.trim().parse().unwrap_or(f64::NAN)).collect();
    let points = numbers.chunks_exact(3).map(|point| [point[0], point[2]]);
    points.filter(|[_, z]| z.is_finite()).collect()
}

/// Poses of a FANUC robot: x, y, z in mm, W, P, R in degrees, as they stand in a JSON file.
fn fanuc_poses(file: &Path) -> Vec<[f64; 6]> {
    let text: Value = serde_json::from_str(&fs::read_to_string(file).unwrap()).unwrap();
    let row = |row: &Value| [0, 1, 2, 3, 4, 5].map(|k| row[k].as_f64().unwrap());
    text["RobPoses"].as_array().unwrap().iter().map(row).collect()
}

#[test]
fn real_profiles_of_a_sphere_at_stops_hold_out_as_their_uncertainty_says() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/robcalibrator_fanuc");
    if !data.exists() {
        eprintln!("SKIPPED: robcalibrator: there is no {}", data.display());
        return;
    }
    let dir = tempfile::tempdir().unwrap();
    let scan = dir.path().join("scan");
    fs::create_dir(&scan).unwrap();
    fs::write(scan.join("sensor.toml"), "kind = \"profiler\"\n").unwrap();
    let poses = fanuc_poses(&data.join("RobPoses.rob"));
    let mut table = "stop,x_mm,y_mm,z_mm,w_deg,p_deg,r_deg\n".to_owned();
    let mut profiles = "stop,x_mm,z_mm\n".to_owned();
    for (k, [x, y, z, w, p, r]) in poses.iter().enumerate() {
        let stop = k + 1;
        writeln!(table, "{stop},{x},{y},{z},{w},{p},{r}").unwrap();
        for [x, z] in scan_line(&data.join(format!("p{stop}.yml"))) {
            writeln!(profiles, "{stop},{x},{z}").unwrap();
        }
    }
    fs::write(scan.join("poses.csv"), table).unwrap();
    fs::write(scan.join("profiles.csv"), profiles).unwrap();
    let result = calibrated(dir.path(), &["scan", "--radius-mm", "40", "--at-stops"], 0);
    assert_eq!(result["sphere"]["arcs"], 15, "{result:#}");
    let held_out = &result["checks"]["held_out"];
    let [rms_mm, expected_mm] = ["rms_mm", "expected_rms_mm"].map(|key| held_out[key].as_f64().unwrap());
    // Three numbers a profile, less nine that are estimated: the RMS of 36 is known to 1/√72 of itself, and three of these are 0.35.
    assert!(rms_mm < 0.8 && rms_mm < (1.0 + 3.0 / 72f64.sqrt()) * expected_mm, "{held_out}");
}

#[test]
fn a_simulated_cylinder_gives_its_truth_and_says_what_is_held() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let cast = ["simulate", "--target", "cylinder", "--stops", "--quiet", "--out", "pipe"];
    ends_with(&trueline(folder, &cast), 0);
    let calibrate =
        ["calibrate", "pipe", "--target", "cylinder", "--radius-mm", "20", "--robot-accuracy-mm", "0.12"];
    let output = trueline(folder, &[&calibrate[..], &["--json", "result.json"]].concat());
    ends_with(&output, 0);
    let result: Value = serde_json::from_slice(&fs::read(folder.join("result.json")).unwrap()).unwrap();
    let truth: toml::Value =
        toml::from_str(&fs::read_to_string(folder.join("pipe/truth.toml")).unwrap()).unwrap();
    // Three numbers beyond four standard deviations: one run in 5,300.
    let hand_eye = off(
        &result["tool_from_camera"]["translation_mm"],
        &result["sigma"]["translation_mm"],
        &truth["tool_from_camera"]["translation_mm"],
    );
    assert!(hand_eye < 4.0, "{hand_eye} {result:#}");
    let cylinder = &result["cylinder"];
    assert_eq!(cylinder["held"], serde_json::json!(["turn about its axis", "place along its axis"]));
    let length: f64 = three(&cylinder["direction"]).iter().map(|x| x * x).sum();
    assert!((length - 1.0).abs() < 1e-9 && cylinder["sigma_point_mm"].as_f64().unwrap() > 0.0, "{cylinder}");
    assert!(result["sphere"].is_null() && result["base_from_target"].is_null(), "{result:#}");
    for expected in ["cylinder in base:", "axis direction", "a cylinder looks the same under"] {
        assert!(text(&output).contains(expected), "{expected}: {}", text(&output));
    }
}
