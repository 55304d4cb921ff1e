//! From pictures to a calibration, as a user runs it.

use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn trueline(folder: &Path, arguments: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_trueline"));
    command.current_dir(folder).args(arguments.split_whitespace()).output().unwrap()
}

fn succeeds(folder: &Path, arguments: &str) -> String {
    let output = trueline(folder, arguments);
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{arguments}: {words}");
    String::from_utf8(output.stdout).unwrap()
}

/// Exit code 2 and these words.
fn refuses(folder: &Path, arguments: &str, words: &str) {
    let output = trueline(folder, arguments);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{arguments}: {said}");
    assert!(said.contains(words) && said.contains("hint: "), "{arguments}: {said}");
}

/// Difference of two rotations as (w, x, y, z), rad.
fn angle_rad(a: &Value, b: &Value) -> f64 {
    let dot: f64 = (0..4).map(|k| a[k].as_f64().unwrap() * b[k].as_f64().unwrap()).sum();
    2.0 * dot.abs().min(1.0).acos()
}

#[test]
fn a_scan_of_pictures_calibrates_to_within_four_sigma() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    // 130 speckled pictures in 20 s.
    succeeds(at, "simulate --images --frame-period-ms 150 --seed 4 --out scan --quiet");
    assert!(!at.join("scan/features.csv").exists());
    let result: Value = serde_json::from_str(&succeeds(at, "calibrate scan --json - --quiet")).unwrap();
    assert_eq!(result["status"], "accepted", "{}", result["reasons"]);
    let truth: toml::Table = fs::read_to_string(at.join("scan/truth.toml")).unwrap().parse().unwrap();
    let number = |value: &toml::Value| value.as_float().unwrap();
    let sigma = &result["sigma"];
    let offset = (result["time_offset_s"].as_f64().unwrap() - number(&truth["time_offset_s"])).abs();
    assert!(offset < 4.0 * sigma["time_offset_s"].as_f64().unwrap(), "{offset} s");
    let hand_eye = truth["tool_from_camera"].as_table().unwrap();
    for axis in 0..3 {
        let true_mm = number(&hand_eye["translation_mm"].as_array().unwrap()[axis]);
        let off_mm = result["tool_from_camera"]["translation_mm"][axis].as_f64().unwrap() - true_mm;
        assert!(
            off_mm.abs() < 4.0 * sigma["translation_mm"][axis].as_f64().unwrap(),
            "axis {axis}: {off_mm} mm"
        );
    }
    let rotation: Value =
        hand_eye["rotation_wxyz"].as_array().unwrap().iter().map(number).collect::<Vec<f64>>().into();
    let turned = angle_rad(&result["tool_from_camera"]["rotation_wxyz"], &rotation);
    let limit: f64 = (0..3).map(|k| sigma["rotation_rad"][k].as_f64().unwrap().powi(2)).sum::<f64>().sqrt();
    assert!(turned < 4.0 * limit, "{turned} rad, sigma {limit}");
    // Nothing was written into the dataset; the next time the pictures need not be looked at again, and the result is the same.
    assert!(!at.join("scan/features.csv").exists() && result["inputs"]["images"].is_string());
    let output = trueline(at, "calibrate scan --json again.json");
    assert!(
        String::from_utf8_lossy(&output.stderr).contains("seam points as found in the same pictures before")
    );
    let again: Value = serde_json::from_str(&fs::read_to_string(at.join("again.json")).unwrap()).unwrap();
    // Features are kept with the digits of features.csv.
    let off_s = again["time_offset_s"].as_f64().unwrap() - result["time_offset_s"].as_f64().unwrap();
    assert!(off_s.abs() < 1e-9, "{off_s}");
    // `features` writes them, with frames and sigmas; then --joint has nothing left to do.
    succeeds(at, "features scan --quiet");
    let features = fs::read_to_string(at.join("scan/features.csv")).unwrap();
    assert!(features.starts_with("time_s,u_px,v_px,frame,sigma_u_px,sigma_v_px,correlation\n"));
    refuses(at, "calibrate scan --joint lap", "has its seam points already");

    // A feature that is wrong is shown in its picture.
    let file = at.join("scan/features.csv");
    let features = fs::read_to_string(&file).unwrap();
    let mut rows: Vec<String> = features.lines().map(str::to_owned).collect();
    let mut fields: Vec<String> = rows[41].split(',').map(str::to_owned).collect();
    fields[2] = (fields[2].parse::<f64>().unwrap() + 60.0).to_string();
    rows[41] = fields.join(",");
    fs::write(&file, rows.join("\n") + "\n").unwrap();
    succeeds(at, "calibrate scan --report report.html --quiet");
    let report = fs::read_to_string(at.join("report.html")).unwrap();
    // Row 40 from 0: the list leads to the picture, which is a PNG.
    assert!(report.contains("<tr id=\"frame-40\"><td><a href=\"#picture-40\">41</a>"), "no such row");
    assert!(report.contains("<figure id=\"picture-40\"") && report.contains("data:image/png;base64,iVBOR"));
}

#[test]
fn features_says_what_it_found_and_draws_it() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    succeeds(at, "simulate --images --joint lap --duration-s 4 --frame-period-ms 500 --out scan --quiet");
    let summary = succeeds(at, "features scan --overlay looked --overlay-every 3");
    assert!(summary.contains("Joint            lap (detected in the pictures"), "{summary}");
    assert!(summary.contains("Found            7 of 7 pictures"), "{summary}");
    let drawn = fs::read_dir(at.join("looked")).unwrap().count();
    assert_eq!(drawn, 3);
    let first = fs::read_to_string(at.join("scan/features.csv")).unwrap();
    // Again, on one thread: the same to the last digit, and no copy of it.
    let said = succeeds(at, "features scan --threads 1 --json - --quiet");
    let found: Value = serde_json::from_str(&said).unwrap();
    assert_eq!((&found["found"], &found["joint"]), (&Value::from(7), &Value::from("lap")));
    assert_eq!(fs::read_to_string(at.join("scan/features.csv")).unwrap(), first);
    assert!(!at.join("scan/features.previous-1.csv").exists());
    // Earlier files are kept if they differ.
    let other = first.trim_end().rsplit_once('\n').unwrap().0;
    fs::write(at.join("scan/features.csv"), other).unwrap();
    succeeds(at, "features scan --quiet");
    assert_eq!(fs::read_to_string(at.join("scan/features.csv")).unwrap(), first);
    assert_eq!(fs::read_to_string(at.join("scan/features.previous-1.csv")).unwrap(), other);
    refuses(at, "features scan --overlay looked", "already exists");
}

#[test]
fn pictures_without_a_seam_are_exit_1_and_no_features() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    succeeds(at, "simulate --images --joint plate --duration-s 2 --frame-period-ms 500 --out scan --quiet");
    let output = trueline(at, "features scan");
    assert_eq!(output.status.code(), Some(1));
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(said.contains("Found            0 of 3 pictures"), "{said}");
    assert!(said.contains("a single straight piece of stripe"), "{said}");
    assert!(!at.join("scan/features.csv").exists());
    refuses(at, "calibrate scan", "there is no seam in any of 3 pictures");
}

#[test]
fn datasets_without_usable_pictures_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    refuses(at, "features nowhere", "sensor.toml: the file is missing");
    succeeds(at, "simulate --preset profiler --duration-s 5 --out profiler --quiet");
    refuses(at, "features profiler", "the sensor is of kind profiler");
    succeeds(at, "simulate --images --duration-s 2 --frame-period-ms 500 --out scan --quiet");
    let sensor = fs::read_to_string(at.join("scan/sensor.toml")).unwrap();
    fs::write(at.join("scan/sensor.toml"), sensor.replace("2448", "2440")).unwrap();
    refuses(at, "features scan", "the picture has 2448 x 2000 px, sensor.toml states 2440 x 2000");
    fs::write(at.join("scan/sensor.toml"), sensor).unwrap();
    // One that is missing is named and counted, and stops nothing.
    fs::remove_file(at.join("scan/images/000001.png")).unwrap();
    let said = succeeds(at, "features scan --joint fillet");
    assert!(said.contains("Found            2 of 3 pictures"), "{said}");
    assert!(said.contains("000001.png: the file is missing"), "{said}");
    refuses(
        at,
        "features scan --region 3000,0,4000,100",
        "the region of interest lies outside of the pictures",
    );
    refuses(at, "features scan --region 10,0,5,100", "--region 10,0,5,100: expected U0,V0,U1,V1");
    // A region without the seam shows none: a corner of the picture.
    let output = trueline(at, "features scan --joint fillet --region 0,0,60,60");
    assert_eq!(output.status.code(), Some(1));
    fs::remove_dir_all(at.join("scan/images")).unwrap();
    refuses(at, "features scan", "index.csv: there are no pictures");
    for bad in ["--preset two-lines", "--preset profiler", "--fault bursts", "--exposure-ms=-1"] {
        refuses(at, &format!("simulate --images --duration-s 2 {bad} --out other"), "error: ");
        assert!(!at.join("other").exists(), "{bad} wrote something");
    }
}

#[test]
fn a_groove_gives_two_lines_and_a_fillet_the_stripes_on_its_plates() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let simulate = |joint: &str| {
        let out = format!("--duration-s 2 --frame-period-ms 500 --out {joint} --quiet");
        succeeds(at, &format!("simulate --images --joint {joint} {out}"));
        succeeds(at, &format!("features {joint} --joint {joint} --quiet"));
        fs::read_to_string(at.join(joint).join("features.csv")).unwrap()
    };
    let groove = simulate("groove");
    assert!(groove.starts_with("time_s,u_px,v_px,line,frame,"), "{groove}");
    assert!(!at.join("groove/stripes.csv").exists());
    // The truth has the same two lines, some 330 px apart, in the same order. Full speckle on faces this short puts a shoulder
    // up to 1.2 px off, five times what its ± says: that is a shortcoming of the ±, and not what this test is about.
    let truth = fs::read_to_string(at.join("groove/truth_features.csv")).unwrap();
    let rows = |text: &str| -> Vec<Vec<f64>> {
        text.lines().skip(1).map(|row| row.split(',').take(4).map(|x| x.parse().unwrap()).collect()).collect()
    };
    assert_eq!((rows(&groove).len(), rows(&truth).len()), (6, 6));
    for (found, truth) in rows(&groove).iter().zip(rows(&truth)) {
        assert!((found[1] - truth[1]).hypot(found[2] - truth[2]) < 3.0 && found[3] == truth[3], "{found:?}");
    }
    let lines = fs::read_to_string(at.join("groove/truth.toml")).unwrap().matches("[[lines]]").count();
    assert_eq!(lines, 2);
    simulate("fillet");
    let stripes = fs::read_to_string(at.join("fillet/stripes.csv")).unwrap();
    assert!(stripes.starts_with("time_s,frame,plate,u1_px,v1_px,u2_px,v2_px,sigma_px\n"), "{stripes}");
    assert_eq!(stripes.lines().count(), 1 + 2 * 3);
    // With another joint they are another's, and are kept under another name.
    trueline(at, "features fillet --joint edge --quiet");
    assert!(!at.join("fillet/stripes.csv").exists() && at.join("fillet/stripes.previous-1.csv").exists());
}
