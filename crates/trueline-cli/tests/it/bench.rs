//! From pictures of a printed board to a sensor and a reference, as a user gets there: each command as the one before names it, on
//! pictures that the program rendered itself.

use crate::common;

use common::{code, trueline, words};
use serde_json::Value;
use std::fs;
use std::path::Path;

const BOARD: &str = "chessboard:9x6:20";

fn json(file: &Path) -> Value {
    serde_json::from_slice(&fs::read(file).unwrap()).unwrap()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

#[test]
fn a_folder_of_pictures_becomes_a_sensor_and_its_truth_is_within_what_is_stated() {
    let dir = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| {
        let output = trueline(dir.path(), arguments);
        assert_eq!(code(&output), 0, "{arguments:?}: {}", words(&output));
        words(&output)
    };
    let said = run(&[
        "simulate",
        "--boards",
        BOARD,
        "--board-pictures",
        "14",
        "--time-offset-ms",
        "-31",
        "--out",
        "bench",
    ]);
    assert!(said.contains("trueline sensor intrinsics bench/boards"), "{said}");
    let intrinsics = ["sensor", "intrinsics", "bench/boards", "--board", BOARD];
    run(&[
        intrinsics.as_slice(),
        &["--out", "camera.toml", "--json", "camera.json", "--report", "camera.html"],
    ]
    .concat());
    let plane = ["sensor", "laser-plane", "bench/stripes", "--board", BOARD, "--sensor", "camera.toml"];
    run(&[plane.as_slice(), &["--out", "sensor.toml"]].concat());
    let pairs = ["--without-laser", "bench/without-laser", "--out", "pairs.toml"];
    run(&[plane.as_slice(), &pairs].concat());
    run(&["calibrate", "bench/moving", "--target", "board", "--board", BOARD, "--json", "board.json"]);

    let [truth, found, pairs] = ["bench/truth_sensor.toml", "sensor.toml", "pairs.toml"]
        .map(|name| -> toml::Table { fs::read_to_string(dir.path().join(name)).unwrap().parse().unwrap() });
    let of = |file: &toml::Table, table: &str, key: &str| file[table][key].as_float().unwrap();
    // One number beyond four and a half standard deviations is one in 150,000.
    let camera = json(&dir.path().join("camera.json"));
    for (k, key) in ["fx", "fy", "cx", "cy"].into_iter().enumerate() {
        let sigma_px = number(&camera["covariance"]["matrix"][k][k]).sqrt();
        let off_px = of(&found, "camera", key) - of(&truth, "camera", key);
        assert!(off_px.abs() < 4.5 * sigma_px && sigma_px < 1.0, "{key}: {off_px} ± {sigma_px} px");
    }
    for file in [&found, &pairs] {
        let off_mm = of(file, "laser_plane", "offset_mm") - of(&truth, "laser_plane", "offset_mm");
        assert!(off_mm.abs() < 0.5, "{off_mm} mm");
    }
    let board = json(&dir.path().join("board.json"));
    let off_s = number(&board["time_offset_s"]) + 0.031;
    let sigma_s = number(&board["sigma"]["time_offset_s"]);
    assert!(off_s.abs() < 4.5 * sigma_s && sigma_s < 0.1e-3, "{off_s} ± {sigma_s} s");

    // Nothing is overwritten without an option, and a board too large for the picture is reported.
    let again = ["simulate", "--boards", BOARD, "--board-pictures", "1", "--out", "bench"];
    assert_eq!(code(&trueline(dir.path(), &again)), 2);
    let huge = trueline(dir.path(), &["simulate", "--boards", "chessboard:9x6:200", "--out", "huge"]);
    assert_eq!(code(&huge), 2);
    assert!(words(&huge).contains("fits into a picture"), "{}", words(&huge));
    assert!(!dir.path().join("huge").exists());
}
