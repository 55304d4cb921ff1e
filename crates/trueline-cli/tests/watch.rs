//! Watching a production as a user does it: lines of JSON, words, exit codes, and what the state says afterwards.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

fn trueline(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_trueline")).current_dir(folder).args(arguments).output().unwrap()
}

fn words(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn lines(output: &Output) -> Vec<Value> {
    let text = String::from_utf8_lossy(&output.stdout);
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

const STATE: [&str; 4] = ["--state", "cell.sqlite", "--calibration", "result.json"];

#[test]
fn a_production_is_watched_from_its_calibration_to_an_alarm() {
    let dir = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| trueline(dir.path(), arguments);
    // The same cell: calibrated once on a good scan, then six check scans, the last two of them 0.3 ms late.
    assert!(run(&["simulate", "--preset", "good", "--out", "scan", "--quiet"]).status.success());
    assert!(run(&["calibrate", "scan", "--json", "result.json", "--quiet"]).status.code().unwrap() < 2);
    let change = ["--layout", "check-scan", "--change", "timing=0.3@4", "--out", "welds", "--quiet"];
    assert!(run(&[&["simulate", "--production", "6"], change.as_slice()].concat()).status.success());

    let watched =
        run(&[&["watch", "welds/weld-0000", "welds/weld-0001", "--json", "-"], STATE.as_slice()].concat());
    assert_eq!(watched.status.code(), Some(0), "{}", words(&watched));
    let told = lines(&watched);
    assert_eq!(told.len(), 2);
    for line in &told {
        assert!(line["used"].as_u64().unwrap() > 100 && line["alarm"].is_null(), "{line}");
        // A moving scan is blind to nothing but the fixture, which has not been learnt.
        assert_eq!(line["blind_to"], serde_json::json!(["seam"]), "{line}");
    }

    let watched = run(&[&["watch", "--folder", "welds", "--once", "--json", "-"], STATE.as_slice()].concat());
    // Files younger than two seconds may still be written to.
    assert!(watched.status.code().unwrap() < 2, "{}", words(&watched));
    let rest = ["welds/weld-0002", "welds/weld-0003", "welds/weld-0004", "welds/weld-0005"];
    let watched = run(&[&["watch", "--json", "-"], rest.as_slice(), STATE.as_slice()].concat());
    assert_eq!(watched.status.code(), Some(1), "{}", words(&watched));
    let told = lines(&watched);
    assert!(told[1]["alarm"].is_null());
    let alarm = &told[3]["alarm"];
    assert_eq!(alarm["kind"], "timing", "{alarm}");
    assert!(alarm["since"].as_str().unwrap().ends_with("weld-0004"), "{alarm}");
    assert!(alarm["p_log10"].as_f64().unwrap() <= -6.25);
    let (value, sigma) = (&alarm["change"]["time_offset_ms"], &alarm["change"]["sigma"]["time_offset_ms"]);
    assert!((value.as_f64().unwrap() - 0.3).abs() < 4.0 * sigma.as_f64().unwrap(), "{alarm}");

    let history = run(&["history", "--state", "cell.sqlite", "--csv", "-", "--report", "history.html"]);
    assert_eq!(history.status.code(), Some(0), "{}", words(&history));
    let table = String::from_utf8_lossy(&history.stdout).into_owned();
    assert_eq!(table.lines().count(), 7, "{table}");
    assert!(words(&history).contains("alarm: timing, since weld 5"), "{}", words(&history));
    let page = std::fs::read_to_string(dir.path().join("history.html")).unwrap();
    assert!(page.contains("Control charts") && page.contains("timing: changed since weld 5"));
}

#[test]
fn what_cannot_be_watched_is_told_and_is_no_alarm() {
    let dir = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| trueline(dir.path(), arguments);
    let nothing = run(&[&["watch"], STATE.as_slice()].concat());
    assert_eq!(nothing.status.code(), Some(2));
    assert!(words(&nothing).contains("hint:"), "{}", words(&nothing));
    let history = run(&["history", "--state", "none.sqlite"]);
    assert_eq!(history.status.code(), Some(2));
    assert!(!dir.path().join("none.sqlite").exists(), "reading made a file");
    let change = run(&["simulate", "--production", "1", "--change", "weather=3@1", "--out", "x"]);
    assert_eq!(change.status.code(), Some(2));
    assert!(words(&change).contains("timing (ms)"), "{}", words(&change));
}
