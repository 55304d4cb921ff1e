//! Evaluating and reproducing as a user does it.

use crate::common;

use common::{code, trueline, words};
use serde_json::Value;
use std::fs;
use std::path::Path;
use trueline_dataset::folder;
use trueline_sim::motion::Motion;
use trueline_sim::{Preset, simulate_along};

#[test]
fn a_calibration_is_evaluated_on_the_scan_of_another_day() {
    let dir = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| trueline(dir.path(), arguments);
    for (seed, out) in [("1", "first"), ("2", "second")] {
        assert_eq!(code(&run(&["simulate", "--seed", seed, "--out", out, "--quiet"])), 0);
    }
    assert_eq!(code(&run(&["calibrate", "first", "--json", "result.json", "--quiet"])), 0);
    let figures = |arguments: &[&str]| -> Value {
        let output = run(&[&["evaluate", "second", "--json", "-", "--quiet"], arguments].concat());
        assert_eq!(code(&output), 0, "{}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_slice(&output.stdout).unwrap()
    };
    let known =
        figures(&["--calibration", "result.json", "--reference", "second/truth.toml", "--csv", "points.csv"]);
    let rmse = |v: &Value, which: &str| v["figures"][which]["rmse_mm"].as_f64().unwrap();
    // Features of 0.3 px and a robot of 0.03 mm; and 17.73 ms at up to 30 mm/s across.
    assert!(rmse(&known, "calibrated") < 0.08, "{known}");
    assert!(rmse(&known, "without_time_offset") > 0.3, "{known}");
    assert_eq!(known["reference"]["known"], true);
    // The budget of the calibration is next to the findings.
    let result = fs::read(dir.path().join("result.json")).unwrap();
    let result: Value = serde_json::from_slice(&result).unwrap();
    let said = |of: &Value| of.as_f64().unwrap();
    assert!((said(&known["said_seam_error_mm"]) - said(&result["seam_error"]["rms_mm"])).abs() < 1e-12);
    let rows = fs::read_to_string(dir.path().join("points.csv")).unwrap().lines().count();
    assert_eq!(rows as u64, 1 + known["figures"]["calibrated"]["points"].as_u64().unwrap());
    let fitted = figures(&["--calibration", "first/truth.toml"]);
    assert_eq!(fitted["reference"]["seams"][0]["form"], "line");
    assert_eq!(fitted["reference"]["known"], false);
}

#[test]
fn what_cannot_be_evaluated_exits_2_with_the_reason() {
    let dir = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| trueline(dir.path(), arguments);
    assert_eq!(code(&run(&["simulate", "--preset", "constant-attitude", "--out", "scan", "--quiet"])), 0);
    assert_eq!(code(&run(&["calibrate", "scan", "--json", "partial.json", "--quiet"])), 1);
    fs::write(dir.path().join("broken.json"), "{").unwrap();
    fs::write(dir.path().join("both.toml"), "lines = []\n").unwrap();
    fs::write(dir.path().join("one.csv"), "x_mm,y_mm,z_mm\n1,2,3\n").unwrap();
    for (calibration, reference, said) in [
        ("partial.json", None, "the scan did not determine it"),
        ("broken.json", None, "broken.json, line 1"),
        ("nowhere.json", None, "this calibration does not exist"),
        ("scan/truth.toml", Some("nowhere.csv"), "this reference does not exist"),
        ("scan/truth.toml", Some("both.toml"), "neither"),
        ("scan/truth.toml", Some("one.csv"), "no data rows"),
    ] {
        let mut arguments = vec!["evaluate", "scan", "--calibration", calibration];
        arguments.extend(reference.map(|file| ["--reference", file]).into_iter().flatten());
        let output = run(&arguments);
        let words = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(code(&output), 2, "{calibration} {reference:?}");
        assert!(words.contains(said) && words.contains("hint:"), "{words}");
    }
}

/// Its correction belongs to the file that it was made with; the corrected file would be corrected twice.
#[test]
fn a_result_with_another_sensors_file_is_warned_of() {
    let dir = tempfile::tempdir().unwrap();
    let run = |words: &[&str]| {
        let output = trueline(dir.path(), words);
        assert_eq!(code(&output), 0, "{words:?}");
        String::from_utf8(output.stderr).unwrap()
    };
    run(&["simulate", "--preset", "good", "--fault", "plane-tilt-stripe=0.5", "--out", "scan", "--quiet"]);
    run(&["calibrate", "scan", "--quiet", "--json", "written.json", "--write-sensor", "corrected.toml"]);
    run(&["calibrate", "scan", "--quiet", "--json", "result.json"]);
    run(&["simulate", "--preset", "good", "--out", "other", "--quiet"]);
    fs::copy(dir.path().join("corrected.toml"), dir.path().join("other/sensor.toml")).unwrap();
    let [with_its_own, with_another] = ["scan", "other"].map(|scan| {
        let placed = format!("{scan}.csv");
        let applied = run(&["apply", scan, "--calibration", "result.json", "--out", &placed, "--quiet"]);
        let evaluated = trueline(dir.path(), &["evaluate", scan, "--calibration", "result.json", "--quiet"]);
        applied + &String::from_utf8(evaluated.stderr).unwrap()
    });
    assert_eq!(with_its_own.matches("not the file").count(), 0, "{with_its_own}");
    assert_eq!(with_another.matches("not the file").count(), 2, "{with_another}");
}

const STOPS: u32 = 12;
const REST_S: f64 = 1.0;
const MOVE_S: f64 = 0.4;

/// The quick scan's path with a rest of a second at every twelfth of it, as a dataset.
fn write_stops(folder: &Path) {
    let scenario = Preset::Quick.scenario();
    let motion = Motion::new(&scenario).unwrap();
    let place = |k: f64| k.min(f64::from(STOPS - 1)) * scenario.timing.duration_s / f64::from(STOPS);
    let path = |time_s: f64| {
        let k = (time_s / (REST_S + MOVE_S)).floor().max(0.0);
        let part = ((time_s - k * (REST_S + MOVE_S) - REST_S) / MOVE_S).clamp(0.0, 1.0);
        let eased = part * part * (3.0 - 2.0 * part);
        motion.base_from_tool(place(k) * (1.0 - eased) + place(k + 1.0) * eased)
    };
    let mut slow = scenario.clone();
    slow.timing.duration_s = f64::from(STOPS) * (REST_S + MOVE_S);
    folder::write_whole(folder, &simulate_along(&slow, &path, 5), false).unwrap();
}

/// A real cell has no truth: stops on the seam replace it, and show the effect of the time offset.
#[test]
fn stops_on_the_seam_are_the_truth_of_a_moving_scan_and_show_the_time_offset() {
    let dir = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| trueline(dir.path(), arguments);
    write_stops(&dir.path().join("stops"));
    for (seed, out) in [("1", "first"), ("6", "moving")] {
        assert_eq!(code(&run(&["simulate", "--seed", seed, "--out", out, "--quiet"])), 0);
    }
    assert_eq!(code(&run(&["calibrate", "first", "--json", "result.json", "--quiet"])), 0);
    // The same hand-eye transform without a time offset.
    let truth = fs::read_to_string(dir.path().join("first/truth.toml")).unwrap();
    let without: Vec<&str> = truth.lines().filter(|line| !line.starts_with("time_offset_s")).collect();
    fs::write(dir.path().join("none.toml"), format!("time_offset_s = 0.0\n{}\n", without.join("\n")))
        .unwrap();
    let figures = |calibration: &str| -> Value {
        let arguments =
            ["evaluate", "moving", "--calibration", calibration, "--static", "stops", "--json", "-"];
        let output = run(&arguments);
        assert!(String::from_utf8_lossy(&output.stderr).contains("stops"), "{output:?}");
        serde_json::from_slice(&output.stdout).unwrap()
    };
    let rmse_mm = |v: &Value, which: &str| v["figures"][which]["rmse_mm"].as_f64().unwrap();
    let (calibrated, none) = (figures("result.json"), figures("none.toml"));
    // Features of 0.3 px and a robot of 0.03 mm; and 17.73 ms at up to 30 mm/s across, whoever leaves the offset out.
    assert!(rmse_mm(&calibrated, "calibrated") < 0.08, "{calibrated}");
    let left_out_mm = [rmse_mm(&calibrated, "without_time_offset"), rmse_mm(&none, "calibrated")];
    assert!(left_out_mm.iter().all(|mm| *mm > 0.3), "{left_out_mm:?}");
    // Standing still, no offset matters: both have the same stops, to what 20 images of 0.02 mm and a robot of 0.03 mm are good to.
    let stops = |v: &Value| v["reference"]["stops"].as_array().unwrap().clone();
    assert_eq!((stops(&calibrated).len(), stops(&none).len()), (STOPS as usize, STOPS as usize));
    for (a, b) in stops(&calibrated).iter().zip(stops(&none)) {
        for axis in 0..3 {
            let [a, b] = [a, &b].map(|stop| stop["point_mm"][axis].as_f64().unwrap());
            assert!((a - b).abs() < 0.1, "{a} {b}");
        }
    }
    // A scan without stops is no truth.
    let output = run(&["evaluate", "moving", "--calibration", "result.json", "--static", "first"]);
    assert_eq!(code(&output), 2);
    assert!(
        words(&output).contains(" stops with a feature") && words(&output).contains("hint:"),
        "{}",
        words(&output)
    );
}

#[test]
fn the_papers_experiments_are_one_command() {
    let dir = tempfile::tempdir().unwrap();
    let output = trueline(dir.path(), &["reproduce", "--out", "paper", "--repeats", "1"]);
    assert_eq!(code(&output), 0, "{}", String::from_utf8_lossy(&output.stderr));
    let tables = fs::read_to_string(dir.path().join("paper/tables.md")).unwrap();
    assert_eq!(tables.trim_end(), String::from_utf8(output.stdout).unwrap().trim_end());
    // Published figures are marked as such, in every row that has one.
    for figure in ["0.173 | 0.112", "1.170 | 1.240", "0.163 | 0.155", "0.32715"] {
        let row = tables.lines().find(|line| line.contains(figure)).unwrap();
        assert!(row.contains("*published*"), "{row}");
    }
    for file in
        ["convergence.csv", "welds.csv", "straight_weld_points.csv", "c_type_weld_points.csv", "speeds.csv"]
    {
        assert!(
            fs::read_to_string(dir.path().join("paper").join(file)).unwrap().lines().count() > 5,
            "{file}"
        );
    }
    assert_eq!(code(&trueline(dir.path(), &["reproduce", "--out", "paper"])), 2, "nothing is overwritten");
}

#[test]
fn a_calibration_of_another_kind_of_sensor_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| trueline(dir.path(), arguments);
    for preset in ["good", "profiler"] {
        assert_eq!(code(&run(&["simulate", "--preset", preset, "--out", preset, "--quiet"])), 0);
        let result = format!("{preset}.json");
        assert_eq!(code(&run(&["calibrate", preset, "--json", &result, "--quiet"])), 0);
    }
    for (scan, other) in [("good", "profiler.json"), ("profiler", "good.json")] {
        let apply = ["apply", scan, "--calibration", other, "--out", "points.csv"];
        for arguments in [&apply[..], &["evaluate", scan, "--calibration", other]] {
            let refused = run(arguments);
            assert_eq!(code(&refused), 2, "{arguments:?}");
            assert!(words(&refused).contains("but the recording is of a"), "{}", words(&refused));
        }
    }
    assert!(!dir.path().join("points.csv").exists());
}
