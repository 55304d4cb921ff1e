//! A profiler calibrated by a scan: its file with its uncertainty, the certificate, and both before another scan.

use crate::common;

use common::{code, trueline, words};
use serde_json::Value;
use std::fs;
use std::path::Path;

fn run(folder: &Path, line: &str) -> String {
    let output = trueline(folder, &line.split_whitespace().collect::<Vec<_>>());
    assert_eq!(code(&output), 0, "{line}: {}", words(&output));
    words(&output)
}

fn json(folder: &Path, file: &str) -> Value {
    serde_json::from_str(&fs::read_to_string(folder.join(file)).unwrap()).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

#[test]
fn a_scan_calibrates_a_profiler_whose_file_and_uncertainty_serve_the_next_scan() {
    let dir = tempfile::tempdir().unwrap();
    run(dir.path(), "simulate -p profiler --seed 1 -o first -q");
    run(dir.path(), "simulate -p profiler --seed 2 -o second -q");
    run(
        dir.path(),
        "calibrate first -q --json first.json --write-sensor sensor.toml --certificate sensor.json --operator Smith",
    );
    fs::copy(dir.path().join("sensor.toml"), dir.path().join("second/sensor.toml")).unwrap();
    run(dir.path(), "calibrate second -q --json second.json");
    let (first, second) = (json(dir.path(), "first.json"), json(dir.path(), "second.json"));
    assert_eq!(second["sensor"]["prior_stated"], true);
    let found = numbers(&first["sensor"]["shape_sigma"]);
    let stated = numbers(&second["sensor"]["prior_sigma"]);
    let after = numbers(&second["sensor"]["shape_sigma"]);
    for k in 0..5 {
        // A shape is never taken to be known better than a millionth, or 1e-7 per mm; numbers are written in full.
        let floor = [1e-6, 1e-6, 1e-6, 1e-7, 1e-7][k];
        let expected = found[k].hypot(floor);
        assert!((stated[k] / expected - 1.0).abs() < 1e-6, "{k}: {} for {expected}", stated[k]);
        assert!(after[k] < stated[k], "{k}: {} after {}", after[k], stated[k]);
    }
    assert!(second["sensor"]["wald"].as_f64().unwrap() < 25.0, "{}", second["sensor"]);
}

#[test]
fn the_certificate_has_who_when_what_figures_and_checks() {
    let dir = tempfile::tempdir().unwrap();
    run(dir.path(), "simulate -p profiler --seed 3 -o scan -q");
    run(dir.path(), "calibrate scan -q --json result.json --certificate page.html --operator Smith");
    run(dir.path(), "calibrate scan -q --certificate sheet.json --operator Smith");
    let (result, sheet) = (json(dir.path(), "result.json"), json(dir.path(), "sheet.json"));
    assert_eq!((&sheet["passed"], &sheet["operator"]), (&Value::Bool(true), &Value::from("Smith")));
    assert!(sheet["made_utc"].as_str().unwrap().ends_with(" UTC"));
    assert_eq!(sheet["inputs"], result["inputs"]);
    let figures = sheet["figures"].as_array().unwrap();
    let sigma = numbers(&result["sensor"]["shape_sigma"]);
    assert_eq!(figures.len(), 5);
    for (figure, per) in figures.iter().zip([100.0, 100.0, 180.0 / std::f64::consts::PI, 3000.0, 3000.0]) {
        let k = figures.iter().position(|f| f == figure).unwrap();
        let stated = figure["sigma"].as_f64().unwrap();
        assert!((stated / (sigma[k] * per) - 1.0).abs() < 1e-9, "{figure}");
        assert!((figure["expanded"].as_f64().unwrap() / stated - 2.0).abs() < 1e-9, "{figure}");
    }
    assert!(sheet["checks"].as_array().unwrap().iter().all(|check| check["passed"] == true), "{sheet}");
    let page = fs::read_to_string(dir.path().join("page.html")).unwrap();
    assert!(page.contains("Passed: the sensor is calibrated.") && page.contains("Smith"));
    // A scan along the seam alone shows next to nothing.
    run(dir.path(), "simulate -p along-line -o poor -q");
    let output = trueline(dir.path(), &["calibrate", "poor", "-q", "--certificate", "poor.json"]);
    assert_eq!(code(&output), 1);
    let poor = json(dir.path(), "poor.json");
    assert_eq!(poor["passed"], false);
    assert!(poor["checks"].as_array().unwrap().iter().any(|check| check["passed"] == false), "{poor}");
    let output =
        trueline(dir.path(), &["calibrate", "scan", "--sensor", "fixed", "--certificate", "held.json"]);
    assert!(code(&output) == 2 && words(&output).contains("nothing is corrected"), "{}", words(&output));
}
