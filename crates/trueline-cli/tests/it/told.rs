//! The first words, and nothing from a refused result is offered for use.

use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::Command;

/// Runs the program: its exit code, and all that it said.
fn trueline(folder: &Path, line: &str) -> (i32, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_trueline"));
    let output = command.current_dir(folder).args(line.split_whitespace()).output().unwrap();
    let told = [output.stdout, output.stderr].concat();
    (output.status.code().unwrap(), String::from_utf8(told).unwrap())
}

/// Changes the cells of a row, by the columns of `time_s,x_mm,y_mm,z_mm,qw,qx,qy,qz`.
fn spoil(folder: &Path, change: impl Fn(&mut Vec<f64>)) {
    let file = folder.join("robot.csv");
    let text = fs::read_to_string(&file).unwrap();
    let (header, rows) = text.split_once('\n').unwrap();
    let mut spoilt = format!("{header}\n");
    for row in rows.lines() {
        let mut cells: Vec<f64> = row.split(',').map(|cell| cell.parse().unwrap()).collect();
        change(&mut cells);
        let cells: Vec<String> = cells.iter().map(ToString::to_string).collect();
        spoilt += &cells.join(",");
        spoilt.push('\n');
    }
    fs::write(file, spoilt).unwrap();
}

fn reasons(result: &Value) -> Vec<&str> {
    result["reasons"].as_array().unwrap().iter().map(|reason| reason["code"].as_str().unwrap()).collect()
}

/// A mistake's effect on a row of robot.csv.
type Mistake = fn(&mut Vec<f64>);

/// A scan of 20 s with every mistake is refused for the mistake alone, and offers nothing to use.
#[test]
fn a_mistake_in_the_data_leads_and_what_follows_from_it_is_held_back() {
    let mistakes: [(&str, Mistake); 4] = [
        ("inches", |row| row[1..4].iter_mut().for_each(|x| *x /= 25.4)),
        ("quaternion x, y, z, w", |row| row[4..8].rotate_left(1)),
        ("y reversed", |row| row[2] = -row[2]),
        ("x and y swapped", |row| row.swap(1, 2)),
    ];
    for (name, mistake) in mistakes {
        let place = tempfile::tempdir().unwrap();
        assert_eq!(trueline(place.path(), "simulate --preset good --out scan --quiet").0, 0);
        spoil(&place.path().join("scan"), mistake);
        let (code, told) = trueline(place.path(), "calibrate scan --json r.json --report r.html");
        assert_eq!(code, 1, "{name}: {told}");
        assert!(told.contains("This looks like a mistake in the data: run `trueline"), "{name}: {told}");
        assert!(
            !told.contains("to use it") && !told.to_lowercase().contains("tilt the torch"),
            "{name}: {told}"
        );
        let result: Value =
            serde_json::from_str(&fs::read_to_string(place.path().join("r.json")).unwrap()).unwrap();
        assert_eq!(reasons(&result), ["residuals-too-large"], "{name}");
        assert!(result["time_offset_use"].is_null(), "{name}");
        let page = fs::read_to_string(place.path().join("r.html")).unwrap();
        assert!(!page.contains("true exposure = stamp") && !page.contains("to copy"), "{name}");
    }
}

/// The opposite: a scan without tilt has no mistake in it, and leads with the motion that it lacks.
#[test]
fn a_scan_of_one_attitude_is_refused_for_its_motion() {
    let place = tempfile::tempdir().unwrap();
    assert_eq!(trueline(place.path(), "simulate --preset constant-attitude --out scan --quiet").0, 0);
    let (code, told) = trueline(place.path(), "calibrate scan --json r.json");
    assert_eq!(code, 1, "{told}");
    assert!(!told.contains("mistake in the data"), "{told}");
    let result: Value =
        serde_json::from_str(&fs::read_to_string(place.path().join("r.json")).unwrap()).unwrap();
    assert!(!reasons(&result).contains(&"residuals-too-large"), "{:?}", reasons(&result));
}

#[test]
fn a_file_of_another_kind_is_called_what_it_is() {
    let place = tempfile::tempdir().unwrap();
    assert_eq!(trueline(place.path(), "simulate --preset quick --out scan --quiet").0, 0);
    assert_eq!(trueline(place.path(), "calibrate scan --json r.json --quiet").0, 0);
    let table = "scan/robot.csv: is a table with the columns time_s, x_mm, y_mm, z_mm";
    for (line, words) in [
        ("export scan --as kuka", "scan: is a dataset folder; a file is needed"),
        ("export scan/robot.csv --as kuka", table),
        ("apply scan -c scan/features.csv -o o.csv", "scan/features.csv: is a table with the columns time_s"),
        (
            "apply scan -c scan/sensor.toml -o o.csv",
            "scan/sensor.toml: is a sensor's file; a result or a guess",
        ),
        ("calibrate scan --initial scan/robot.csv", table),
        ("diff r.json scan/robot.csv", table),
        ("calibrate r.json", "r.json: is a result of trueline; a scan"),
        ("features scan/robot.csv", table),
        ("plan scan/truth.toml --out p", "a guess or truth of time offset and hand-eye; a cell"),
        ("watch --state scan/robot.csv -c r.json scan", table),
        (
            "history --state r.json",
            "r.json: is a result of trueline; the data base of `trueline watch --state`",
        ),
    ] {
        let (code, told) = trueline(place.path(), line);
        assert_eq!(code, 2, "{line}: {told}");
        assert!(told.contains(words) && told.contains("\nhint: "), "{line}: {told}");
    }
}
