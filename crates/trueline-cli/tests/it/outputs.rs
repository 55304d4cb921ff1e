//! Outputs of commands, and their text about a calibration that should not be used.

use crate::common;

use common::{code, trueline, words};
use serde_json::Value;
use std::fs;
use std::path::Path;

/// Runs a line of words; its exit code, stdout and stderr.
fn run(folder: &Path, line: &str) -> (i32, String, String) {
    let output = trueline(folder, &line.split_whitespace().collect::<Vec<_>>());
    (code(&output), String::from_utf8_lossy(&output.stdout).into_owned(), words(&output))
}

/// A scan and its calibration, the file of which has no ending.
fn calibrated() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    assert_eq!(run(dir.path(), "simulate --preset quick --out scan -q").0, 0);
    assert_eq!(run(dir.path(), "calibrate scan -q --json result").0, 0);
    dir
}

#[test]
fn no_output_lands_on_what_is_read_or_on_another() {
    let dir = calibrated();
    let at = dir.path();
    let content = |name: &str| fs::read(at.join(name)).unwrap();
    let read = ["scan/robot.csv", "scan/features.csv", "scan/sensor.toml", "scan/truth.toml", "result"];
    let before = read.map(content);
    for line in [
        "calibrate scan --json scan/robot.csv",
        "calibrate scan --report scan/../scan/features.csv",
        "calibrate scan --write-sensor scan/sensor.toml",
        "calibrate scan --initial scan/truth.toml --json scan/truth.toml",
        "evaluate scan -c result --csv scan/features.csv",
        "evaluate scan -c result --json result",
        "evaluate scan -c result --reference scan/truth.toml --report scan/truth.toml",
        "apply scan -c result --out scan/features.csv",
        "diff result result --json result",
        "doctor scan --json scan/sensor.toml",
        "watch scan --state cell.sqlite -c result --json result",
    ] {
        let (code, _, said) = run(at, line);
        assert!(
            code == 2 && said.contains("would be overwritten") && said.contains("hint:"),
            "{line}: {said}"
        );
    }
    assert!(before == read.map(content), "nothing has changed");
    for line in ["calibrate scan --json x --report x", "evaluate scan -c result --csv x --json ./x"] {
        let (code, _, said) = run(at, line);
        assert!(
            code == 2 && said.contains("named for two outputs") && !at.join("x").exists(),
            "{line}: {said}"
        );
    }
    // Outputs that cannot be written are reported before the work.
    for line in ["doctor scan --json nowhere/d.json", "listen --json nowhere/l.json"] {
        assert!(run(at, line).2.contains("there is no folder `nowhere`"), "{line}");
    }
    assert_eq!(run(at, "calibrate scan -q --json scan/result.json").0, 0);
    assert_eq!(run(at, "calibrate scan -q --json scan/result.json").0, 0, "its own result is replaced");
    let here = run(at, "simulate --out .");
    assert!(here.0 == 2 && here.2.contains("no name"), "{}", here.2);
    let certificate = run(at, "calibrate scan --certificate c.txt");
    assert!(certificate.0 == 2 && certificate.2.contains(".json or .html"), "{}", certificate.2);
}

#[test]
fn a_sensor_is_corrected_by_an_accepted_scan_alone() {
    let dir = tempfile::tempdir().unwrap();
    assert_eq!(run(dir.path(), "simulate --preset constant-attitude --out scan -q").0, 0);
    let (code, _, said) =
        run(dir.path(), "calibrate scan -q --json result.json --write-sensor corrected.toml");
    assert!(code == 1 && said.contains("corrected.toml: not written"), "{said}");
    assert!(!dir.path().join("corrected.toml").exists() && dir.path().join("result.json").exists());
}

#[test]
fn the_same_scan_counts_once() {
    let dir = calibrated();
    let (code, _, said) = run(dir.path(), "calibrate scan scan");
    assert!(code == 2 && said.contains("recording 1 is recording 0 again"), "{said}");
}

#[test]
fn a_verdict_is_one_on_all_of_the_scan() {
    let dir = calibrated();
    let at = dir.path();
    let evaluate = |arguments: &str| {
        run(at, &format!("evaluate scan -c result --tolerance 0.5mm {arguments} -q --json judged.json"))
    };
    let judged = || -> Value { serde_json::from_slice(&fs::read(at.join("judged.json")).unwrap()).unwrap() };
    assert_eq!(evaluate("--reference scan/truth.toml").0, 0);
    // 10 mm in the middle of the seam, found by applying the calibration.
    assert_eq!(run(at, "apply scan -c result --out seam.csv -q").0, 0);
    let seam = fs::read_to_string(at.join("seam.csv")).unwrap();
    let points: Vec<Vec<f64>> = seam
        .lines()
        .skip(1)
        .map(|row| row.split(',').skip(3).map(|number| number.parse().unwrap()).collect())
        .collect();
    let (first, last) = (&points[0], &points[points.len() - 1]);
    let along: Vec<f64> = (0..3).map(|k| last[k] - first[k]).collect();
    let length_mm = along.iter().map(|x| x * x).sum::<f64>().sqrt();
    let point = |mm: f64| {
        let p: Vec<String> =
            (0..3).map(|k| (0.5 * (first[k] + last[k]) + along[k] / length_mm * mm).to_string()).collect();
        p.join(",")
    };
    let short = format!("x_mm,y_mm,z_mm\n{}\n{}\n{}\n", point(-5.0), point(0.0), point(5.0));
    fs::write(at.join("short.csv"), short).unwrap();
    let (code, _, said) = evaluate("--reference short.csv");
    let tolerance = judged()["tolerance"].clone();
    assert!(code == 1 && said.contains("NOT passed") && said.contains("50 % are needed"), "{said}");
    assert!(tolerance["share_covered"].as_f64().unwrap() < 0.2, "{tolerance}");
    let all: u64 = ["near", "far", "lost", "beyond_ends"]
        .iter()
        .map(|key| tolerance["points"][key].as_u64().unwrap())
        .sum();
    assert_eq!(all as usize, fs::read_to_string(at.join("scan/features.csv")).unwrap().lines().count() - 1);
    // Who means it says so.
    let (code, _, said) = evaluate("--reference short.csv --coverage-percent 1");
    assert!(code == 0 && said.contains("the reference reaches"), "{said}");
    // Two thirds of the features are off the image: no point of these is within anything.
    let features = fs::read_to_string(at.join("scan/features.csv")).unwrap();
    let mut rows = features.lines();
    let mut lost = format!("{}\n", rows.next().unwrap());
    for (k, row) in rows.enumerate() {
        let mut cells: Vec<&str> = row.split(',').collect();
        cells[1] = if k % 3 == 0 { cells[1] } else { "-9000" };
        lost += &format!("{}\n", cells.join(","));
    }
    fs::write(at.join("scan/features.csv"), lost).unwrap();
    let (code, _, said) = evaluate("--reference scan/truth.toml");
    assert!(code == 1 && said.contains("could not be placed"), "{said}");
}

#[test]
fn a_calibration_that_was_not_accepted_is_used_with_doubt_by_every_command() {
    let dir = calibrated();
    let at = dir.path();
    let text = fs::read_to_string(at.join("result")).unwrap();
    let refused = text.replacen("\"status\": \"accepted\"", "\"status\": \"not_accepted\"", 1);
    assert_ne!(text, refused);
    fs::write(at.join("refused"), refused).unwrap();
    for line in [
        "apply scan -c refused --out seam.csv -q",
        "evaluate scan -c refused -q",
        "diff result refused -q",
        "diff refused result -q",
        "export refused --as kuka -q",
    ] {
        let (code, _, said) = run(at, line);
        assert!(code == 1 && said.contains("refused was not accepted"), "{line}: {code} {said}");
        let accepted = run(at, &line.replace("refused", "result"));
        assert_eq!((accepted.0, accepted.2.as_str()), (0, ""), "{line}");
    }
    assert!(at.join("seam.csv").exists(), "it is written, and said to be doubtful");
}

#[test]
fn a_calibration_of_another_mounting_is_refused() {
    let dir = calibrated();
    let at = dir.path();
    let sensor = fs::read_to_string(at.join("scan/sensor.toml")).unwrap();
    fs::write(at.join("scan/sensor.toml"), format!("{sensor}\n[robot]\nmounted = \"fixed\"\n")).unwrap();
    for line in [
        "apply scan -c result --out seam.csv -q",
        "evaluate scan -c result -q",
        "watch scan --state cell.sqlite -c result -q",
    ] {
        let (code, _, said) = run(at, line);
        let is_told =
            said.contains("belongs to a sensor on the tool, but the recording to one beside the robot");
        assert!(code == 2 && is_told, "{line}: {code} {said}");
    }
    assert!(!at.join("seam.csv").exists());
}

#[test]
fn a_watch_adds_to_its_log() {
    let dir = calibrated();
    for weld in 1..=2 {
        let (code, _, said) = run(dir.path(), "watch scan --state cell.sqlite -c result -q --json log.jsonl");
        assert_eq!(code, 0, "{said}");
        let log = fs::read_to_string(dir.path().join("log.jsonl")).unwrap();
        assert_eq!(log.lines().filter(|line| line.starts_with('{') && line.ends_with('}')).count(), weld);
    }
    fs::write(dir.path().join("notes.txt"), "look at weld 3\n").unwrap();
    let (code, _, said) = run(dir.path(), "watch scan --state cell.sqlite -c result --json notes.txt");
    assert!(code == 2 && said.contains("not a log of JSON lines"), "{said}");
}

#[test]
fn a_result_is_known_by_what_is_in_it() {
    let dir = calibrated();
    let at = dir.path();
    for line in
        ["export result --as kuka -q", "calibrate scan --initial result -q", "evaluate scan -c result -q"]
    {
        assert_eq!(run(at, line).0, 0, "{line}");
    }
    fs::copy(at.join("scan/truth.toml"), at.join("truth.json")).unwrap();
    assert_eq!(run(at, "export truth.json --as kuka -q").0, 0, "a TOML of another name");
    assert!(run(at, "diff truth.json result").2.contains("is needed"));
}

#[test]
fn nothing_to_fix_is_no_failure_and_what_is_the_same_is_said_in_words() {
    let dir = calibrated();
    let at = dir.path();
    let (code, _, said) = run(at, "doctor scan --fix fixed");
    assert!(code == 0 && said.contains("nothing to fix") && !at.join("fixed").exists(), "{said}");
    let (code, told, _) = run(at, "diff result result");
    assert!(
        code == 0 && told.contains("in more than 99 of 100 comparisons") && !told.contains("-5"),
        "{told}"
    );
    let hint = run(at, "import csv x --delimiter zz --out y").2;
    assert!(hint.contains("`trueline import csv --help`"), "{hint}");
}

/// A point has one time, whichever command writes it.
#[test]
fn both_tables_of_points_have_the_time_of_the_exposure() {
    let dir = calibrated();
    let at = dir.path();
    assert_eq!(run(at, "apply scan -c result --out seam.csv -q").0, 0);
    assert_eq!(run(at, "evaluate scan -c result --csv errors.csv -q").0, 0);
    let column = |file: &str, k: usize| -> Vec<String> {
        let text = fs::read_to_string(at.join(file)).unwrap();
        text.lines().skip(1).map(|row| row.split(',').nth(k).unwrap().to_owned()).collect()
    };
    assert_eq!(column("seam.csv", 0), column("errors.csv", 2));
}
