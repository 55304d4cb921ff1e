//! A sensor on a wall, and the robot that carries the part past it.

use crate::common;

use common::{code, trueline, words};
use serde_json::Value;
use std::fs;
use std::path::Path;

fn run(folder: &Path, arguments: &[&str]) {
    let output = trueline(folder, arguments);
    assert_eq!(code(&output), 0, "{arguments:?}: {}", words(&output));
}

fn read(folder: &Path, file: &str) -> Value {
    serde_json::from_slice(&fs::read(folder.join(file)).unwrap()).unwrap()
}

/// The same scan with poses turned round is that of a sensor on a wall: every number is the same but for rounding of the poses in the file, 1e-12 mm.
#[test]
fn a_sensor_on_the_wall_is_calibrated_like_one_on_the_tool() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let scan = ["simulate", "--preset", "good", "--random-cell", "--seed", "9"];
    run(folder, &[&scan[..], &["--out", "tool"]].concat());
    run(folder, &[&scan[..], &["--wall", "--out", "wall"]].concat());
    for name in ["tool", "wall"] {
        run(
            folder,
            &[
                "calibrate",
                name,
                "--quiet",
                "--json",
                &format!("{name}.json"),
                "--report",
                &format!("{name}.html"),
            ],
        );
        run(
            folder,
            &["apply", name, "--calibration", &format!("{name}.json"), "--out", &format!("{name}.csv")],
        );
        run(
            folder,
            &[
                "evaluate",
                name,
                "--calibration",
                &format!("{name}.json"),
                "--json",
                &format!("{name}-e.json"),
            ],
        );
    }
    let [tool, wall] = ["tool.json", "wall.json"].map(|file| read(folder, file));
    assert_eq!(wall["mounted"], "fixed");
    let near = |a: &Value, b: &Value, part: f64| {
        let (a, b) = (a.as_f64().unwrap(), b.as_f64().unwrap());
        assert!((a - b).abs() < part * a.abs().max(1.0), "{a} {b}");
    };
    // The solver stops within 1e-4 of the ±, at another bit.
    near(&tool["time_offset_s"], &wall["time_offset_s"], 1e-7);
    for k in 0..3 {
        near(
            &tool["tool_from_camera"]["translation_mm"][k],
            &wall["tool_from_camera"]["translation_mm"][k],
            1e-4,
        );
        near(&tool["sigma"]["translation_mm"][k], &wall["sigma"]["translation_mm"][k], 1e-4);
        near(&tool["lines"][0]["point_mm"][k], &wall["lines"][0]["point_mm"][k], 1e-4);
    }
    near(&tool["seam_error"]["rms_mm"], &wall["seam_error"]["rms_mm"], 1e-4);
    let lines = |file: &str| fs::read_to_string(folder.join(file)).unwrap().lines().count();
    assert_eq!(lines("tool.csv"), lines("wall.csv"));
    run(
        folder,
        &["watch", "--state", "state.json", "--calibration", "wall.json", "wall", "--json", "w.json"],
    );
}
