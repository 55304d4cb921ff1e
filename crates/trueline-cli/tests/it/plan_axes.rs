//! Plans with external axes as users make them: planned, programmed, cast, calibrated, refused.

use crate::common;

use common::{code, trueline, words};
use serde_json::Value;
use std::fs;
use std::path::Path;

/// The cell of `plan --example` with a table in it.
fn cell_with_table(folder: &Path, limits: &str) {
    let few = ["plan", "--example", "--tries", "100", "--shape", "s", "--quiet", "--out", "example"];
    let output = trueline(folder, &few);
    assert_eq!(code(&output), 0, "{}", words(&output));
    fs::copy(folder.join("example/sensor.toml"), folder.join("sensor.toml")).unwrap();
    let text = fs::read_to_string(folder.join("example/cell.toml")).unwrap();
    let table = "[[axis]]\nname = \"table\"\nkind = \"rotary\"\ncarries = \"part\"\ndirection = [0, 0, 1]\n\
        point_mm = [1150, 330, 0]\nuncertainty = { direction_deg = 1.0, point_mm = 5.0 }\n";
    fs::write(folder.join("cell.toml"), format!("{text}\n{table}[axis.limits]\n{limits}\n")).unwrap();
}

#[test]
fn a_planned_swing_is_programmed_scanned_and_calibrated() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    cell_with_table(folder, "range_deg = [-30, 30]");
    let plan = ["plan", "cell.toml", "--tries", "600", "--shape", "two-passes", "--out", "plan"];
    let languages = ["--program", "rapid,krl,urscript,ls,csv"];
    let output = trueline(folder, &[&plan[..], &languages].concat());
    assert_eq!(code(&output), 0, "{}", words(&output));
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    for line in ["table: direction", "table: place", "table: time offset", "axis table"] {
        assert!(said.contains(line), "{line}: {said}");
    }
    let read = |name: &str| fs::read_to_string(folder.join("plan").join(name)).unwrap();
    // A value at each pose, with the same stamps.
    let stamps = |text: &str| -> Vec<String> {
        text.lines().skip(1).map(|row| row.split(',').next().unwrap().to_owned()).collect()
    };
    let (path, axes) = (read("path.csv"), read("axes.csv"));
    assert!(axes.starts_with("time_s,table_deg\n"), "{axes}");
    let seconds = |text: &str| -> Vec<f64> { stamps(text).iter().map(|s| s.parse().unwrap()).collect() };
    assert_eq!(seconds(&path), seconds(&axes));
    assert!(
        read("trueline_scan.src").contains(", E1 ")
            && read("trueline_scan.src").contains("E1 is table (deg)")
    );
    assert!(read("TruelineScan.mod").contains("eax_a is table (deg)"));
    assert!(read("waypoints.csv").starts_with("time_s,x_mm,y_mm,z_mm,qw,qx,qy,qz,table_deg\n"));
    assert!(read("trueline_scan.script").contains("does NOT move the external axis table"));
    assert!(read("tl_scan.ls").contains("EXTERNAL AXES ARE NOT MOVED"));

    let output = trueline(
        folder,
        &["simulate", "--plan", "plan", "--exact-guess", "--seed", "5", "--out", "scan", "--quiet"],
    );
    assert_eq!(code(&output), 0, "{}", words(&output));
    let noise_alone = ["--sensor", "fixed", "--robot-accuracy-mm", "0", "--feature-bias-px", "0"];
    let command = ["calibrate", "scan", "--json", "result.json", "--quiet"];
    let output = trueline(folder, &[&command[..], &noise_alone].concat());
    assert_eq!(code(&output), 0, "{}", words(&output));
    let (plan, result): (Value, Value) = (
        serde_json::from_str(&read("plan.json")).unwrap(),
        serde_json::from_str(&fs::read_to_string(folder.join("result.json")).unwrap()).unwrap(),
    );
    // With a wrong guess the table may show more of its clock. At the guess 20 scans of a plan had 0.91 to 1.04 of the promised ±.
    let (promised, stated) = (&plan["axes"][0]["predicted_sigma"], &result["axes"][0]["sigma"]);
    for key in ["direction_deg", "point_mm", "time_offset_s"] {
        let ratio = stated[key].as_f64().unwrap() / promised[key].as_f64().unwrap();
        assert!((0.8..1.25).contains(&ratio), "{key}: {ratio}");
    }
    let offset = |of: &Value| of["time_offset_s"].as_f64().unwrap();
    let ratio = offset(&result["sigma"]) / offset(&plan["predicted_sigma"]);
    assert!((0.8..1.25).contains(&ratio), "{ratio}");

    // Commands that move the robot alone refuse this plan.
    if cfg!(feature = "live") {
        let output = trueline(folder, &["scan", "plan", "--write-limits", "limits.toml"]);
        assert_eq!(code(&output), 2, "{}", words(&output));
        assert!(words(&output).contains("moves external axes"), "{}", words(&output));
    }
}

#[test]
fn limits_without_a_swing_and_options_of_other_plans_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    for (limits, said) in
        [("range_deg = [5, 5.5]", "axis.limits.range_deg"), ("range = [-5, 5]", "unknown field `range`")]
    {
        if !folder.join("cell.toml").exists() {
            cell_with_table(folder, limits);
        }
        let text = fs::read_to_string(folder.join("cell.toml")).unwrap();
        let (before, _) = text.split_once("[axis.limits]\nrange").unwrap();
        fs::write(folder.join("cell.toml"), format!("{before}[axis.limits]\n{limits}\n")).unwrap();
        let output = trueline(folder, &["plan", "cell.toml", "--out", "refused"]);
        assert_eq!(code(&output), 2, "{}", words(&output));
        assert!(words(&output).contains(said), "{}", words(&output));
    }
    let text = fs::read_to_string(folder.join("cell.toml")).unwrap();
    fs::write(folder.join("cell.toml"), text.replace("\nrange = [-5, 5]", "")).unwrap();
    for option in [&["--want", "seam=0.2mm"][..], &["--use", "stripe"]] {
        let output = trueline(folder, &[&["plan", "cell.toml", "--out", "refused"][..], option].concat());
        assert_eq!(code(&output), 2, "{}", words(&output));
        assert!(words(&output).contains("external axis"), "{}", words(&output));
    }
}
