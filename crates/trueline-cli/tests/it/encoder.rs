//! Readings that an encoder triggers: its counts in the place of stamps.

use crate::common::{ends_with, text, trueline};
use serde_json::Value;
use std::fmt::Write;
use std::fs;
use std::path::Path;

/// Counts of a belt that runs unevenly, every 20 ms from a second before the readings to a second after them: s and counts.
fn log(first_s: f64, last_s: f64) -> Vec<[f64; 2]> {
    let steps = ((last_s - first_s + 2.0) / 0.02) as u32;
    let at = |k: u32| {
        let time_s = f64::from(k) * 0.02;
        [first_s - 1.0 + time_s, 5_000.0 - 800.0 * time_s - 300.0 * (0.7 * time_s).sin()]
    };
    (0..=steps).map(at).collect()
}

/// The count at a time, on the straight line between its neighbours.
fn count(log: &[[f64; 2]], time_s: f64) -> f64 {
    let next = log.iter().position(|row| row[0] > time_s).unwrap();
    let [from, to] = [log[next - 1], log[next]];
    from[1] + (to[1] - from[1]) * (time_s - from[0]) / (to[0] - from[0])
}

/// The scan with counts in the place of the stamps of a table.
fn with_counts(scan: &Path) -> Vec<[f64; 2]> {
    let file = scan.join("features.csv");
    let text = fs::read_to_string(&file).unwrap();
    let mut rows = text.lines();
    let header = rows.next().unwrap().replacen("time_s", "encoder", 1);
    let rows: Vec<(f64, &str)> = rows
        .map(|row| row.split_once(',').unwrap())
        .map(|(time, rest)| (time.parse().unwrap(), rest))
        .collect();
    let log = log(rows[0].0, rows[rows.len() - 1].0);
    let mut table = format!("{header}\n");
    rows.iter().for_each(|(time_s, rest)| writeln!(table, "{},{rest}", count(&log, *time_s)).unwrap());
    fs::write(file, table).unwrap();
    log
}

fn write_log(scan: &Path, log: &[[f64; 2]]) {
    let mut table = "time_s,encoder\n".to_owned();
    log.iter().for_each(|[time_s, count]| writeln!(table, "{time_s},{count}").unwrap());
    fs::write(scan.join("encoder.csv"), table).unwrap();
}

fn calibrated(folder: &Path, scan: &str) -> Value {
    ends_with(&trueline(folder, &["calibrate", scan, "--json", "result.json", "--quiet"]), 0);
    serde_json::from_slice(&fs::read(folder.join("result.json")).unwrap()).unwrap()
}

#[test]
fn counts_of_an_encoder_are_as_good_as_stamps() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    ends_with(&trueline(folder, &["simulate", "--preset", "quick", "--quiet", "--out", "scan"]), 0);
    let stamped = calibrated(folder, "scan");
    let scan = folder.join("scan");
    let log = with_counts(&scan);
    write_log(&scan, &log);
    let counted = calibrated(folder, "scan");
    assert!(counted["inputs"]["encoder.csv"].is_string(), "{:#}", counted["inputs"]);
    ends_with(&trueline(folder, &["import", "csv", "scan", "--out", "imported", "--quiet"]), 0);
    let imported = calibrated(folder, "imported");
    for other in [counted, imported] {
        // Stamps are rounded to a nanosecond, and counts were written with all digits: at 0.1 m/s a nanosecond is 0.1 nm.
        let off_s = other["time_offset_s"].as_f64().unwrap() - stamped["time_offset_s"].as_f64().unwrap();
        assert!(off_s.abs() < 1e-7, "{off_s}");
        for k in 0..3 {
            let of = |result: &Value| result["tool_from_camera"]["translation_mm"][k].as_f64().unwrap();
            assert!((of(&other) - of(&stamped)).abs() < 1e-4, "{k}");
        }
    }
}

#[test]
fn counts_that_say_no_time_are_refused_with_file_and_line() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    ends_with(&trueline(folder, &["simulate", "--preset", "quick", "--quiet", "--out", "scan"]), 0);
    let scan = folder.join("scan");
    fs::write(scan.join("encoder.csv"), "time_s,encoder\n0,1\n1,2\n").unwrap();
    let stamped = trueline(folder, &["calibrate", "scan"]);
    assert!(text(&stamped).contains("encoder.csv is ignored"), "{}", text(&stamped));
    fs::remove_file(scan.join("encoder.csv")).unwrap();
    let log = with_counts(&scan);
    let refused = |what: &str, expected: &[&str]| {
        let output = trueline(folder, &["calibrate", "scan"]);
        ends_with(&output, 2);
        for expected in expected {
            assert!(text(&output).contains(expected), "{what}: {expected}: {}", text(&output));
        }
    };
    refused("no log", &["features.csv", "encoder.csv beside robot.csv"]);
    write_log(&scan, &log[..log.len() / 2]);
    refused("a log that ends early", &["features.csv, line", "a count within encoder.csv"]);
    let mut back = log.clone();
    back[40][1] += 100.0;
    write_log(&scan, &back);
    refused("an encoder that turns back", &["encoder.csv, line 42", "one direction"]);
    let stands: Vec<[f64; 2]> = log.iter().map(|[time_s, _]| [*time_s, 7.0]).collect();
    write_log(&scan, &stands);
    refused("an encoder that stands", &["encoder.csv", "an encoder that moves"]);
    fs::write(scan.join("encoder.csv"), "time_s,counts\n0,1\n1,2\n").unwrap();
    refused("a column of another name", &["encoder.csv, line 1", "encoder"]);
}
