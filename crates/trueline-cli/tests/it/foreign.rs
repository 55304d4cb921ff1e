//! The door in and the door out: a robot's log and a profiler's export become a calibration in the robot's own form.

use crate::common;

use common::trueline;
use serde_json::Value;
use std::fmt::Write;
use std::fs;
use std::path::Path;
use trueline_dataset::{Measured, Recording, folder};
use trueline_geometry::euler::{XYZ_FIXED, ZYX_INTRINSIC};

fn succeeds(folder: &Path, arguments: &[&str]) -> String {
    let output = trueline(folder, arguments);
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {words}");
    String::from_utf8(output.stdout).unwrap() + &words
}

fn simulated(folder: &Path, preset: &str) -> Recording {
    succeeds(folder, &["simulate", "--preset", preset, "--out", "simulated", "--quiet"]);
    folder::read(&folder.join("simulated")).unwrap()
}

/// A robot's log as a German KUKA user has it: semicolons, decimal commas, columns that nobody needs.
fn kuka_log(recording: &Recording) -> String {
    let mut log = "t;X;Y;Z;A;B;C;S;T\r\n".to_owned();
    for sample in &recording.robot {
        let p = sample.base_from_tool.translation.vector * 1e3;
        let [a, b, c] = ZYX_INTRINSIC.angles(&sample.base_from_tool.rotation).map(f64::to_degrees);
        let time = sample.stamp_ns as f64 * 1e-9;
        let row = format!("{time:.9};{:.6};{:.6};{:.6};{a:.7};{b:.7};{c:.7};2;35", p.x, p.y, p.z);
        writeln!(log, "{}\r", row.replace('.', ",")).unwrap();
    }
    log
}

/// Rows of heights in mm of a fillet whose corner is the feature; −99.9999 where the stripe leaves the picture.
fn keyence_rows(recording: &Recording) -> (String, String) {
    let (mut rows, mut times) = ("LJ-X8200\n".to_owned(), String::new());
    for feature in &recording.features {
        let Measured::Profile([x, z]) = feature.measured else { panic!("a profiler") };
        let heights = (0..400).map(|k| {
            let from = -40.0 + 0.2 * f64::from(k) - x * 1e3;
            let height = z * 1e3 + from * if from < 0.0 { 0.7 } else { -0.9 };
            if k % 50 == 3 { "-99.9999".to_owned() } else { format!("{height:.5}") }
        });
        writeln!(rows, "{}", heights.collect::<Vec<_>>().join(",")).unwrap();
        writeln!(times, "{}", feature.stamp_ns as f64 * 1e-9).unwrap();
    }
    (rows, times)
}

#[test]
fn a_kuka_log_and_a_keyence_profile_file_become_a_result_in_kuka_form() {
    let dir = tempfile::tempdir().unwrap();
    let recording = simulated(dir.path(), "profiler");
    let logs = dir.path().join("logs");
    fs::create_dir(&logs).unwrap();
    fs::write(logs.join("robot.csv"), kuka_log(&recording)).unwrap();
    let (rows, times) = keyence_rows(&recording);
    fs::write(logs.join("scan.csv"), rows).unwrap();
    fs::write(logs.join("times.txt"), times).unwrap();
    let import = "import csv logs --robot kuka --profiles scan.csv --profile-format keyence-lj-x --x-start-mm -40 --x-step-mm 0.2 \
                  --profile-times times.txt --out scan";
    let said = succeeds(dir.path(), &import.split_whitespace().collect::<Vec<_>>());
    for words in [
        "semicolons between columns, decimal commas",
        "KUKA",
        "not used: S, T",
        "Keyence LJ-X",
        "profiles (profiler)",
    ] {
        assert!(said.contains(words), "{words}: {said}");
    }
    let said = succeeds(dir.path(), &["calibrate", "scan", "--json", "result.json"]);
    assert!(
        said.contains(&format!(
            "the seam (corner of two faces) in {0} of {0} profiles",
            recording.features.len()
        )),
        "{said}"
    );
    let result: Value =
        serde_json::from_str(&fs::read_to_string(dir.path().join("result.json")).unwrap()).unwrap();
    let truth = recording.truth.unwrap().parameters;
    let sigma = |value: &Value| value.as_f64().unwrap();
    let off_s = result["time_offset_s"].as_f64().unwrap() - truth.time_offset_s;
    // Five standard deviations, and what five decimals of the heights and seven of the angles take away.
    assert!(off_s.abs() < 5.0 * sigma(&result["sigma"]["time_offset_s"]) + 1e-5, "{off_s}");
    for axis in 0..3 {
        let off_mm = result["tool_from_camera"]["translation_mm"][axis].as_f64().unwrap()
            - 1e3 * truth.tool_from_camera.translation.vector[axis];
        assert!(off_mm.abs() < 5.0 * sigma(&result["sigma"]["translation_mm"][axis]) + 0.01, "{off_mm}");
    }
    let kuka = succeeds(dir.path(), &["export", "result.json", "--as", "kuka"]);
    assert!(kuka.starts_with("TOOL_DATA[1]={X ") && kuka.contains("true exposure = stamp − "), "{kuka}");
    let [a, ..] = ZYX_INTRINSIC.angles(&truth.tool_from_camera.rotation).map(f64::to_degrees);
    let printed: f64 = kuka.split("A ").nth(2).unwrap().split(',').next().unwrap().parse().unwrap();
    assert!((printed - a).abs() < 0.1, "{printed} is not {a}");
}

#[test]
fn the_same_scan_by_other_robots_is_the_same_scan() {
    let dir = tempfile::tempdir().unwrap();
    let recording = simulated(dir.path(), "quick");
    for robot in ["fanuc", "ur"] {
        let logs = dir.path().join(robot);
        fs::create_dir(&logs).unwrap();
        let mut log =
            if robot == "fanuc" { "time_s,X,Y,Z,W,P,R\n" } else { "timestamp x y z rx ry rz\n" }.to_owned();
        for sample in &recording.robot {
            let (p, rotation) = (sample.base_from_tool.translation.vector, sample.base_from_tool.rotation);
            let time = sample.stamp_ns as f64 * 1e-9;
            if robot == "fanuc" {
                let [w, p_deg, r] = XYZ_FIXED.angles(&rotation).map(f64::to_degrees);
                writeln!(log, "{time:.9},{},{},{},{w},{p_deg},{r}", p.x * 1e3, p.y * 1e3, p.z * 1e3).unwrap();
            } else {
                let turn = trueline_geometry::so3::log(&rotation);
                writeln!(log, "{time:.9} {} {} {} {} {} {}", p.x, p.y, p.z, turn.x, turn.y, turn.z).unwrap();
            }
        }
        fs::write(logs.join("robot.csv"), log).unwrap();
        for name in ["features.csv", "sensor.toml"] {
            fs::copy(dir.path().join("simulated").join(name), logs.join(name)).unwrap();
        }
        let out = format!("{robot}-scan");
        succeeds(dir.path(), &["import", "csv", robot, "--robot", robot, "--out", &out]);
        let imported = folder::read(&dir.path().join(&out)).unwrap();
        assert_eq!(imported.features, recording.features);
        for (ours, theirs) in imported.robot.iter().zip(&recording.robot) {
            let off = ours.base_from_tool.inverse() * theirs.base_from_tool;
            // Shortest decimal numbers lose nothing; angles near half a turn 1e-8.
            assert!(off.translation.vector.norm() < 1e-9 && off.rotation.angle() < 1e-7, "{robot}");
            assert!((ours.stamp_ns - theirs.stamp_ns).abs() <= 1);
        }
    }
}

#[test]
fn apply_puts_the_seam_where_it_is() {
    let dir = tempfile::tempdir().unwrap();
    let recording = simulated(dir.path(), "quick");
    let apply = ["apply", "simulated", "--calibration", "simulated/truth.toml", "--out", "seam.csv"];
    let said = succeeds(dir.path(), &apply);
    assert!(said.contains("true exposure = stamp − 17.730 ms"), "{said}");
    let csv = fs::read_to_string(dir.path().join("seam.csv")).unwrap();
    let mut lines = csv.lines();
    assert_eq!(lines.next(), Some("time_s,frame,line,x_mm,y_mm,z_mm"));
    let truth = recording.truth.unwrap();
    let first = recording.features[0].stamp_ns as f64 * 1e-9 - truth.parameters.time_offset_s;
    let mut distances = Vec::new();
    for (index, row) in lines.enumerate() {
        let n: Vec<f64> = row.split(',').map(|field| field.parse().unwrap()).collect();
        distances.push(truth.lines[0].distance(&nalgebra::Vector3::new(n[3], n[4], n[5]).scale(1e-3)));
        assert!(index > 0 || (n[0] - first).abs() < 1e-8);
    }
    assert!(distances.len() > 100);
    distances.sort_by(f64::total_cmp);
    // Features of 0.3 px and poses of 0.03 mm: well below a millimetre; without the time offset it would be several.
    assert!(distances[distances.len() / 2] < 0.3e-3, "{}", distances[distances.len() / 2]);
    succeeds(
        dir.path(),
        &["apply", "simulated", "--calibration", "simulated/truth.toml", "--out", "seam.ply"],
    );
    assert!(fs::read_to_string(dir.path().join("seam.ply")).unwrap().starts_with("ply\n"));
    assert_eq!(
        trueline(
            dir.path(),
            &["apply", "simulated", "--calibration", "simulated/truth.toml", "--out", "seam.xyz"]
        )
        .status
        .code(),
        Some(2)
    );
}

#[test]
fn exports_are_listed_and_unknown_ones_refused() {
    let dir = tempfile::tempdir().unwrap();
    let list = succeeds(dir.path(), &["export", "--list"]);
    for name in [
        "abb-tooldata",
        "kuka",
        "fanuc",
        "ur",
        "yaskawa",
        "staubli",
        "urdf",
        "xacro",
        "ros2",
        "easy-handeye2",
        "kalibr",
        "opencv",
        "matlab",
        "csv",
        "matrix",
        "json",
    ] {
        assert!(list.contains(name), "{name}");
    }
    assert_eq!(trueline(dir.path(), &["export", "nothing.json", "--as", "acme"]).status.code(), Some(2));
    let output = trueline(dir.path(), &["export", "nothing.json", "--as", "kuka"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8(output.stderr).unwrap().contains("this calibration does not exist"));
}

#[test]
fn a_delimiter_is_never_ignored() {
    let dir = tempfile::tempdir().unwrap();
    simulated(dir.path(), "quick");
    let import = |delimiter: &str, out: &str| {
        trueline(dir.path(), &["import", "csv", "simulated", "--delimiter", delimiter, "--out", out])
            .status
            .code()
    };
    let refused = ["import", "csv", "simulated", "--delimiter", ";", "--out", "a"];
    let said = String::from_utf8(trueline(dir.path(), &refused).stderr).unwrap();
    assert!(said.contains("the columns are not separated by semicolons, but by commas"), "{said}");
    // The files have commas.
    assert_eq!(
        (import(";", "a"), import(",", "b"), import("tab", "c"), import("xy", "d")),
        (Some(2), Some(0), Some(2), Some(2))
    );
}

#[test]
fn diff_tells_what_has_moved_from_chance() {
    let dir = tempfile::tempdir().unwrap();
    simulated(dir.path(), "quick");
    succeeds(dir.path(), &["calibrate", "simulated", "--json", "a.json", "--quiet"]);
    assert!(succeeds(dir.path(), &["diff", "a.json", "a.json"]).starts_with("The same"));
    let mut result: Value =
        serde_json::from_str(&fs::read_to_string(dir.path().join("a.json")).unwrap()).unwrap();
    let x = result["tool_from_camera"]["translation_mm"][0].as_f64().unwrap();
    result["tool_from_camera"]["translation_mm"][0] = (x + 2.0).into();
    fs::write(dir.path().join("b.json"), result.to_string()).unwrap();
    let output = trueline(dir.path(), &["diff", "a.json", "b.json", "--json", "-", "--quiet"]);
    assert_eq!(output.status.code(), Some(1));
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(
        (found["verdict"].as_str(), found["moved"].to_string()),
        (Some("moved"), "[\"bracket\"]".to_owned())
    );
    // 2 mm of the whole field; printed and read back.
    assert!((found["seam_shift_rms_mm"].as_f64().unwrap() - 2.0).abs() < 1e-6);
    assert_eq!(found["time_offset_ms"]["change"].as_f64(), Some(0.0));
}

#[test]
fn a_sensor_beside_the_robot_is_the_same_scan_seen_from_the_part() {
    let dir = tempfile::tempdir().unwrap();
    let recording = simulated(dir.path(), "profiler");
    let fixed = dir.path().join("fixed");
    fs::create_dir(&fixed).unwrap();
    // The robot carries the part past the sensor: every pose is inverted, and all else stays.
    let mut robot = recording.robot.clone();
    for sample in &mut robot {
        sample.base_from_tool = sample.base_from_tool.inverse();
    }
    let mut csv = Vec::new();
    trueline_dataset::robot_csv::write(&mut csv, &robot).unwrap();
    fs::write(fixed.join("robot.csv"), csv).unwrap();
    fs::copy(dir.path().join("simulated/features.csv"), fixed.join("features.csv")).unwrap();
    let sensor =
        "kind = \"profiler\"\nmounted = \"fixed\"\n\n[seam]\nedge_radius_mm = 0.0\nwaviness_mm = 0.0\n";
    fs::write(fixed.join("sensor.toml"), sensor).unwrap();
    let calibrated = |dataset: &str| -> Value {
        let file = format!("{dataset}.json");
        succeeds(dir.path(), &["calibrate", dataset, "--json", &file, "--report", "report.html", "--quiet"]);
        serde_json::from_str(&fs::read_to_string(dir.path().join(file)).unwrap()).unwrap()
    };
    let (moving, beside) = (calibrated("simulated"), calibrated("fixed"));
    assert_eq!((&moving["mounted"], beside["mounted"].as_str()), (&Value::Null, Some("fixed")));
    let number = |result: &Value, k: usize| result["tool_from_camera"]["translation_mm"][k].as_f64().unwrap();
    for k in 0..3 {
        // Inverted twice, and written to 1e-15 of a metre: the same numbers but for rounding and the solver's last step.
        assert!((number(&moving, k) - number(&beside, k)).abs() < 1e-4, "{k}");
    }
    let said = succeeds(dir.path(), &["export", "fixed.json", "--as", "ros2"]);
    assert!(said.contains("--frame-id base ") && said.contains("beside the robot"), "{said}");
}

#[test]
fn several_scans_of_one_sensor_are_calibrated_together() {
    let dir = tempfile::tempdir().unwrap();
    simulated(dir.path(), "quick");
    // The same cell, scanned again: other noise would need another cell, so the scan is cut in two.
    let whole = folder::read(&dir.path().join("simulated")).unwrap();
    let half_ns = whole.features[whole.features.len() / 2].stamp_ns;
    for (name, early) in [("first", true), ("second", false)] {
        let mut part = whole.clone();
        part.features.retain(|feature| (feature.stamp_ns < half_ns) == early);
        part.robot.retain(|sample| {
            (sample.stamp_ns < half_ns + 500_000_000) && early
                || (sample.stamp_ns > half_ns - 500_000_000) && !early
        });
        folder::write(&dir.path().join(name), &part).unwrap();
    }
    let said = succeeds(dir.path(), &["calibrate", "first", "second", "--json", "both.json"]);
    assert!(said.contains("2 scans together") && said.contains("shifted alike"), "{said}");
    let both: Value =
        serde_json::from_str(&fs::read_to_string(dir.path().join("both.json")).unwrap()).unwrap();
    assert_eq!(both["lines"].as_array().unwrap().len(), 2);
    let truth = whole.truth.unwrap().parameters;
    let sigma = both["sigma"]["time_offset_s"].as_f64().unwrap();
    assert!((both["time_offset_s"].as_f64().unwrap() - truth.time_offset_s).abs() < 5.0 * sigma);
    assert_eq!(
        both["inputs"].as_object().unwrap().keys().filter(|name| name.ends_with("robot.csv")).count(),
        2
    );
    fs::write(dir.path().join("second/sensor.toml"), "kind = \"profiler\"\n").unwrap();
    fs::write(dir.path().join("second/features.csv"), "time_s,x_mm,z_mm\n1.0,1,300\n").unwrap();
    assert_eq!(trueline(dir.path(), &["calibrate", "first", "second"]).status.code(), Some(2));
}

#[test]
fn what_an_import_lacks_is_told_with_the_option_that_gives_it() {
    let dir = tempfile::tempdir().unwrap();
    let recording = simulated(dir.path(), "profiler");
    let logs = dir.path().join("logs");
    fs::create_dir(&logs).unwrap();
    let refused = |more: &str| {
        let line = format!("import csv logs --robot kuka --out scan {more}");
        let output = trueline(dir.path(), &line.split_whitespace().collect::<Vec<_>>());
        assert_eq!(output.status.code(), Some(2));
        String::from_utf8(output.stderr).unwrap()
    };
    fs::write(logs.join("robot.csv"), kuka_log(&recording).replacen("t;X", "Takt;X", 1)).unwrap();
    let said = refused("");
    assert!(
        said.contains("neither features.csv nor profiles.csv") && said.contains("--profiles FILE"),
        "{said}"
    );
    let file = trueline(dir.path(), &["import", "csv", "logs/robot.csv", "--out", "scan"]);
    let said = String::from_utf8(file.stderr).unwrap();
    assert!(file.status.code() == Some(2) && said.contains("it is a file: give its folder"), "{said}");
    fs::write(logs.join("export.csv"), keyence_rows(&recording).0.replacen("LJ-X8200\n", "", 1)).unwrap();
    let said = refused(
        "--robot-file log.csv --profiles export.csv --profile-format rows --x-start-mm 0 --x-step-mm 1",
    );
    assert!(
        said.contains("logs/log.csv: this file does not exist") && said.contains("--robot-file FILE"),
        "{said}"
    );
    let said = refused("--profiles export.csv");
    assert!(
        said.contains("column `time_s` is missing")
            && said.contains("--robot-map 'time_s=THEIRS', ours=theirs"),
        "{said}"
    );
    let said = refused("--robot-map time_s=Takt --profiles export.csv");
    assert!(
        said.contains("the format cannot be recognised") && said.contains("--profile-format keyence-lj-x"),
        "{said}"
    );
    let said = refused("--robot-map time_s=Takt --profiles export.csv --profile-format keyence-lj-x");
    assert!(said.contains("--x-start-mm"), "{said}");
    // The nearest name is offered, in the order in which the option takes it.
    let said = refused("--robot-map time_s=Tackt --profiles export.csv");
    assert!(said.contains("no column `Tackt`") && said.contains("--robot-map 'time_s=Takt'"), "{said}");
    let said = refused("--profiles export.csv --profile-rate-hz 33");
    assert!(said.contains("when was the first profile taken?"), "{said}");
}

#[test]
fn the_makers_of_robots_are_listed_with_their_columns() {
    let dir = tempfile::tempdir().unwrap();
    let list = succeeds(dir.path(), &["import", "csv", "--list-robots"]);
    for words in ["kawasaki", "franka", "column by column", "columns: t,X,Y,Z,A,B,C", "about the fixed x"] {
        assert!(list.contains(words), "{words}: {list}");
    }
}
