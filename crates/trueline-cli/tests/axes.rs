//! Cells with external axes as users calibrate them: cast, answered, used, refused.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use common::{code, trueline, words};
use serde_json::Value;
use std::fs;
use std::path::Path;

fn cast(folder: &Path, axis: &str, seed: &str, out: &str) {
    let all = [
        "simulate",
        "--preset",
        "good",
        "--random-cell",
        "--time-offset-ms",
        "35",
        "--axis",
        axis,
        "--seed",
        seed,
        "--out",
        out,
    ];
    let output = trueline(folder, &all);
    assert_eq!(code(&output), 0, "{}", words(&output));
}

/// What a calibration that ends with this code says.
fn calibrated(folder: &Path, scans: &[&str], expected: i32) -> String {
    let output = trueline(folder, &[&["calibrate"][..], scans, &["--json", "result.json"]].concat());
    assert_eq!(code(&output), expected, "{}", words(&output));
    let said = format!("{}{}", String::from_utf8_lossy(&output.stdout), words(&output));
    said.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn result(folder: &Path) -> Value {
    serde_json::from_slice(&fs::read(folder.join("result.json")).unwrap()).unwrap()
}

fn numbers(of: &Value) -> Vec<f64> {
    of.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

#[test]
fn a_swinging_table_is_calibrated_and_used() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    cast(folder, "table=rotary,part,swing:30@0.1", "3", "table");
    let said = calibrated(folder, &["table"], 0);
    assert!(said.contains("axis table"), "{said}");
    let result = result(folder);
    let axis = &result["axes"][0];
    assert_eq!([&axis["name"], &axis["kind"], &axis["carries"]], ["table", "rotary", "part"]);
    let truth: toml::Table =
        toml::from_str(&fs::read_to_string(folder.join("table/truth.toml")).unwrap()).unwrap();
    let truth = &truth["axes"].as_array().unwrap()[0];
    let direction = truth["direction"].as_array().unwrap();
    let cosine: f64 = numbers(&axis["direction"])
        .iter()
        .zip(direction)
        .map(|(found, truth)| found * truth.as_float().unwrap())
        .sum();
    let sigma_deg = axis["sigma"]["direction_deg"].as_f64().unwrap();
    assert!(cosine.min(1.0).acos().to_degrees() < 5.7 * sigma_deg, "{cosine}");
    let late_s = axis["time_offset_s"].as_f64().unwrap() - truth["time_offset_s"].as_float().unwrap();
    assert!(late_s.abs() < 4.5 * axis["sigma"]["time_offset_s"].as_f64().unwrap(), "{late_s}");
    assert_eq!(result["models_tried"][0]["roles"]["axes"], "estimated");

    let applied = trueline(folder, &["apply", "table", "--calibration", "result.json", "--out", "seam.csv"]);
    assert_eq!(code(&applied), 0, "{}", words(&applied));
    // The seam stands still in the part, though the part swings: points are off a line by noise alone, 0.04 mm.
    let judged = trueline(folder, &["evaluate", "table", "--calibration", "result.json", "--json", "e.json"]);
    assert_eq!(code(&judged), 0, "{}", words(&judged));
    let judged: Value = serde_json::from_slice(&fs::read(folder.join("e.json")).unwrap()).unwrap();
    assert!(judged.to_string().contains("rmse"), "{judged}");

    // Nor is the table forgotten: without its files the scan is refused.
    fs::create_dir(folder.join("bare")).unwrap();
    for file in ["robot.csv", "features.csv", "sensor.toml"] {
        fs::copy(folder.join("table").join(file), folder.join("bare").join(file)).unwrap();
    }
    let bare = trueline(folder, &["apply", "bare", "--calibration", "result.json", "--out", "b.csv"]);
    assert_eq!(code(&bare), 2, "{}", words(&bare));
    assert!(words(&bare).contains("axis `table`"), "{}", words(&bare));

    // A calibration that knows no table cannot place this scan.
    let guess = trueline(folder, &["apply", "table", "--calibration", "table/truth.toml", "--out", "x.csv"]);
    assert_eq!(code(&guess), 2, "{}", words(&guess));
    assert!(words(&guess).contains("axis `table` moves"), "{}", words(&guess));
}

/// Three scans, the table at another angle in each: the seam stays on the table.
#[test]
fn scans_at_three_angles_are_of_one_seam() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    cast(folder, "table=rotary,part,stand:0/60/120", "5", "whole");
    // The same scan in three folders, without the readings while the table moves.
    let third = |name: &str, from_s: f64, to_s: f64| {
        fs::create_dir(folder.join(name)).unwrap();
        fs::copy(folder.join("whole/sensor.toml"), folder.join(name).join("sensor.toml")).unwrap();
        fs::copy(folder.join("whole/cell.toml"), folder.join(name).join("cell.toml")).unwrap();
        for table in ["robot.csv", "features.csv", "axes.csv"] {
            let text = fs::read_to_string(folder.join("whole").join(table)).unwrap();
            let (head, rows) = text.split_once('\n').unwrap();
            let wide = if table == "features.csv" { 0.0 } else { 0.4 };
            let kept = rows.lines().filter(|row| {
                let time_s: f64 = row.split(',').next().unwrap().parse().unwrap();
                (from_s - wide..=to_s + wide).contains(&time_s)
            });
            let kept: String = kept.map(|row| format!("{row}\n")).collect();
            fs::write(folder.join(name).join(table), format!("{head}\n{kept}")).unwrap();
        }
    };
    let start_s = 1.0;
    third("a", start_s + 0.5, start_s + 5.3);
    third("b", start_s + 7.2, start_s + 12.0);
    third("c", start_s + 13.9, start_s + 19.4);
    calibrated(folder, &["a", "b", "c"], 0);
    let result = result(folder);
    assert_eq!(result["lines"].as_array().unwrap().len(), 1);
    let sigma = &result["axes"][0]["sigma"];
    assert!(sigma["direction_deg"].as_f64().unwrap() < 0.1, "{sigma}");
    assert!(sigma["point_mm"].as_f64().unwrap() < 0.5, "{sigma}");
}

#[test]
fn what_hides_an_axis_is_said_with_its_cure() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    cast(folder, "table=rotary,part,run:6", "4", "even");
    let said = calibrated(folder, &["even"], 0);
    let cure = "does not determine the time offset of axis table";
    assert!(said.contains(cure), "{said}");
    let result = result(folder);
    assert!(result["axes"][0]["time_offset_s"].is_null());
    // Where it is used, the hidden offset is the one that the line was found with.
    let applied = trueline(folder, &["apply", "even", "--calibration", "result.json", "--out", "even.csv"]);
    assert_eq!(code(&applied), 0, "{}", words(&applied));
    let (point, direction) =
        (numbers(&result["lines"][0]["point_mm"]), numbers(&result["lines"][0]["direction"]));
    let text = fs::read_to_string(folder.join("even.csv")).unwrap();
    let off_mm = text.lines().skip(1).map(|row| {
        let place: Vec<f64> = row.split(',').skip(3).map(|field| field.parse().unwrap()).collect();
        let from: Vec<f64> = place.iter().zip(&point).map(|(p, q)| p - q).collect();
        let along: f64 = from.iter().zip(&direction).map(|(f, d)| f * d).sum();
        (from.iter().map(|f| f * f).sum::<f64>() - along * along).max(0.0).sqrt()
    });
    let largest_mm = off_mm.fold(0.0, f64::max);
    // Noise of 0.04 mm, and a bow.
    assert!(largest_mm < 0.5, "{largest_mm}");
    assert_eq!(result["warnings"][0]["code"], "axis-not-shown");
    assert_eq!(result["warnings"][0]["part"], "time_offset");
}

#[test]
fn files_of_axes_are_refused_with_file_and_line() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    cast(folder, "table=rotary,part,swing:30@0.1", "3", "good");
    let axes = fs::read_to_string(folder.join("good/axes.csv")).unwrap();
    let cell = fs::read_to_string(folder.join("good/cell.toml")).unwrap();
    let line = |k: usize, row: &str| -> String {
        axes.lines()
            .enumerate()
            .map(|(i, own)| if i == k { format!("{row}\n") } else { format!("{own}\n") })
            .collect()
    };
    let first_s = axes.lines().nth(1).unwrap().split(',').next().unwrap();
    let cases: [(&str, String, &str); 10] = [
        ("axes.csv", axes.replace("table_deg", "table"), "table_deg"),
        ("axes.csv", axes.replace("table_deg", "desk_deg"), "unknown column"),
        ("axes.csv", line(5, &format!("{first_s},1.0")), "line 6"),
        (
            "axes.csv",
            line(5, &format!("{},-300", axes.lines().nth(5).unwrap().split(',').next().unwrap())),
            "jumps by",
        ),
        ("axes.csv", axes.lines().take(400).map(|row| format!("{row}\n")).collect(), "there is a reading at"),
        ("cell.toml", String::new(), "[[axis]]"),
        ("cell.toml", cell.replace("rotary", "round"), "round"),
        ("cell.toml", cell.replace("[[axis]]", "[[axes]]"), "`axes`"),
        ("cell.toml", format!("{cell}direction = [0, 0, 0]\n"), "axis.direction"),
        ("cell.toml", format!("{cell}in_pose = true\n"), "axis.in_pose"),
    ];
    for (file, text, expected) in cases {
        fs::write(folder.join("good").join(file), &text).unwrap();
        let output = trueline(folder, &["calibrate", "good"]);
        let said = words(&output);
        assert_eq!(code(&output), 2, "{expected}: {said}");
        assert!(said.contains(file) && said.contains(expected), "{expected}: {said}");
        fs::write(folder.join("good/axes.csv"), &axes).unwrap();
        fs::write(folder.join("good/cell.toml"), &cell).unwrap();
    }
    for option in [&["--target", "curve"][..], &["--use", "stripe"], &["--residual", "point-to-line"]] {
        let output = trueline(folder, &[&["calibrate", "good"][..], option].concat());
        assert_eq!(code(&output), 2, "{option:?}: {}", words(&output));
        assert!(words(&output).contains("external axes cannot be calibrated"), "{}", words(&output));
    }
}
