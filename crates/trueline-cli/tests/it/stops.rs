//! A robot that stands at each reading, as users run it: seam points, real pictures of a board, slow pictures of a moving robot.
#![allow(clippy::print_stderr, reason = "a skipped test says so")]

use serde_json::Value;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn trueline(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_trueline")).current_dir(folder).args(arguments).output().unwrap()
}

fn words(output: &Output) -> String {
    [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned()).concat()
}

fn json(file: &Path) -> Value {
    serde_json::from_slice(&fs::read(file).unwrap()).unwrap()
}

fn shared(name: &str) -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data").join(name);
    if !folder.exists() {
        eprintln!("SKIPPED: stops_data: there is no {}", folder.display());
        return None;
    }
    Some(folder)
}

/// A dataset by name, in a folder of its own.
fn copied(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let path = entry.unwrap().path();
        if path.is_file() {
            fs::copy(&path, to.join(path.file_name().unwrap())).unwrap();
        }
    }
}

fn three(value: &Value) -> [f64; 3] {
    [0, 1, 2].map(|k| value[k].as_f64().unwrap())
}

#[test]
fn a_standing_robot_is_offered_stops_and_gets_no_time_offset() {
    let Some(data) = shared("cases/standing-stops/scan") else { return };
    let dir = tempfile::tempdir().unwrap();
    copied(&data, &dir.path().join("scan"));
    let base = ["calibrate", "scan", "--json", "result.json"];
    let held = ["--fix", "time-offset", "--initial", "scan/guess.toml"];
    for (more, code) in [(&["--at-stops"][..], 0), (&held[..], 0), (&[][..], 1)] {
        let output = trueline(dir.path(), &[&base[..], more].concat());
        let said = words(&output);
        assert_eq!(output.status.code(), Some(code), "{said}");
        assert!(!said.contains("true exposure") && !said.contains(" ms  (images"), "{said}");
        assert_eq!(said.contains("Use --at-stops"), code == 1, "{said}");
        let result = json(&dir.path().join("result.json"));
        assert!(result["time_offset_s"].is_null() && result["time_offset_use"].is_null());
        assert!(result["sigma"]["time_offset_s"].is_null());
        assert_eq!(result["options"]["at_stops"], true);
        let at = three(&result["tool_from_camera"]["translation_mm"]);
        let sigma = three(&result["sigma"]["translation_mm"]);
        for (k, made) in [77.0, -10.0, 266.0].into_iter().enumerate() {
            assert!((at[k] - made).abs() < 4.0 * sigma[k] && sigma[k] < 0.5, "{at:?} ± {sigma:?}");
        }
        let error_mm = result["seam_error"]["rms_mm"].as_f64().unwrap();
        assert!(error_mm < 1.0, "{error_mm}");
    }
    // Commands that need a time offset say that there is none.
    let output = trueline(dir.path(), &["export", "result.json", "--as", "time-offset"]);
    assert!(output.status.code() == Some(2) && words(&output).contains("time offset"), "{}", words(&output));
}

/// The poses of a session of openlmd/etna: ((x, y, z), (qx, qy, qz, qw)), m.
fn etna_poses(session: &Path) -> String {
    let mut poses = "picture,x_mm,y_mm,z_mm,qw,qx,qy,qz\n".to_owned();
    for number in 1.. {
        let Ok(text) = fs::read_to_string(session.join(format!("pose{number:04}.txt"))) else { break };
        let kept = |c: char| c.is_ascii_digit() || "+-.eE".contains(c);
        let n: Vec<f64> = text
            .split(|c| !kept(c))
            .filter(|part| !part.is_empty())
            .map(|part| part.parse().unwrap())
            .collect();
        let [x, y, z] = [0, 1, 2].map(|k| n[k] * 1e3);
        writeln!(poses, "frame{number:04}.png,{x},{y},{z},{},{},{},{}", n[6], n[3], n[4], n[5]).unwrap();
    }
    poses
}

#[test]
fn real_pictures_of_a_board_at_stops_give_the_camera_on_the_tool() {
    let Some(data) = shared("etna_abb") else { return };
    let dir = tempfile::tempdir().unwrap();
    let stops = dir.path().join("stops");
    copied(&data.join("calib3"), &stops);
    fs::write(stops.join("poses.csv"), etna_poses(&stops)).unwrap();
    let board = "chessboard:7x6:10";
    let output = trueline(
        dir.path(),
        &["sensor", "intrinsics", "stops", "--board", board, "--out", "stops/sensor.toml", "--quiet"],
    );
    assert!(stops.join("sensor.toml").exists(), "{}", words(&output));
    let base = [
        "calibrate",
        "stops",
        "--target",
        "board",
        "--board",
        board,
        "--at-stops",
        "--json",
        "hand-eye.json",
    ];
    // The camera of these pictures has a focal length of 2357 px because the sheet is bent. A fit of focal length, hand-eye
    // and board to corners of OpenCV, with the robot's poses held, has f = 2357 to 2373 px and the camera at [297.6, -36.9,
    // 126.8]. With the camera that a flat board gives, 2420 px, an own AX = XB has [291.5, -38.1, 126.8].
    let flat = "kind = \"camera_laser\"\n\n[camera]\nwidth = 1280\nheight = 1024\nfx = 2419.8\nfy = 2424.1\ncx = 632.5\ncy = 517.8\n\
                distortion = [-0.052, 0.0, 0.0, 0.0, 0.0]\n";
    for (camera, own) in [(None, [297.6, -36.9, 126.8]), (Some(flat), [291.5, -38.1, 126.8])] {
        if let Some(text) = camera {
            fs::write(stops.join("sensor.toml"), text).unwrap();
        }
        let output = trueline(dir.path(), &base);
        // This robot errs by a millimetre from stop to stop: its ± of 2 mm are more than is accepted.
        assert!(output.status.code().is_some_and(|code| code < 2), "{}", words(&output));
        let result = json(&dir.path().join("hand-eye.json"));
        assert!(result["time_offset_s"].is_null() && result["sigma"]["time_offset_s"].is_null());
        let at = three(&result["tool_from_camera"]["translation_mm"]);
        let sigma = three(&result["sigma"]["translation_mm"]);
        let off_mm = (0..3).map(|k| (at[k] - own[k]).powi(2)).sum::<f64>().sqrt();
        assert!(off_mm < 3.0, "{at:?}: {off_mm} mm off");
        for k in 0..3 {
            assert!((at[k] - own[k]).abs() < 3.0 * sigma[k], "{at:?} ± {sigma:?}");
        }
    }
    // A stop that is there twice is the table's fault, with its line.
    let mut twice = etna_poses(&stops);
    twice += "frame0003.png,0,0,0,1,0,0,0\n";
    fs::write(stops.join("poses.csv"), twice).unwrap();
    let output = trueline(dir.path(), &base);
    let said = words(&output);
    assert!(output.status.code() == Some(2) && said.contains("line 18") && said.contains("hint:"), "{said}");
}

#[test]
fn a_picture_a_second_of_a_moving_robot_shows_the_time_offset() {
    let dir = tempfile::tempdir().unwrap();
    let board = "chessboard:7x6:20";
    let made = trueline(dir.path(), &["simulate", "--quiet", "--boards", board, "--out", "bench"]);
    assert_eq!(made.status.code(), Some(0), "{}", words(&made));
    let moving = dir.path().join("bench/moving");
    let index = moving.join("images/index.csv");
    let rows = fs::read_to_string(&index).unwrap();
    let every_tenth: Vec<&str> =
        rows.lines().enumerate().filter(|(k, _)| *k == 0 || (k - 1) % 10 == 0).map(|(_, row)| row).collect();
    fs::write(&index, every_tenth.join("\n") + "\n").unwrap();
    let base = ["calibrate", "bench/moving", "--target", "board", "--board", board, "--json", "slow.json"];
    let output = trueline(dir.path(), &base);
    let said = words(&output);
    assert!(output.status.code().is_some_and(|code| code < 2), "{said}");
    let result = json(&dir.path().join("slow.json"));
    let truth: toml::Table = toml::from_str(&fs::read_to_string(moving.join("truth.toml")).unwrap()).unwrap();
    let offset_s = truth["time_offset_s"].as_float().unwrap();
    let off_s = result["time_offset_s"].as_f64().unwrap() - offset_s;
    let sigma_s = result["sigma"]["time_offset_s"].as_f64().unwrap();
    assert!(off_s.abs() < 4.0 * sigma_s && sigma_s < 2e-3, "{off_s} ± {sigma_s}");
    // The offset held at the truth, from a guess of the hand-eye transform.
    let held = [&base[..], &["--fix", "time-offset", "--initial", "bench/moving/truth.toml"]].concat();
    let output = trueline(dir.path(), &held);
    assert!(output.status.code().is_some_and(|code| code < 2), "{}", words(&output));
    let result = json(&dir.path().join("slow.json"));
    assert!(result["sigma"]["time_offset_s"].is_null());
    assert!((result["time_offset_s"].as_f64().unwrap() - offset_s).abs() < 1e-12);
}

/// Stops in the names of a robot's maker, with more stops than readings.
#[test]
fn stops_with_a_makers_names_are_imported() {
    let dir = tempfile::tempdir().unwrap();
    let imported = dir.path().join("imported");
    let logs = dir.path().join("logs");
    fs::create_dir(&logs).unwrap();
    fs::write(logs.join("sensor.toml"), "kind = \"profiler\"\n").unwrap();
    fs::write(logs.join("features.csv"), "stop;x_mm;z_mm\n1;0,5;100\n2;1,5;101\n").unwrap();
    let pose = |name: &str, x: &str| format!("{name};{x};0;300;1;0;0;0\n");
    let poses = |header: &str| header.to_owned() + &pose("1", "10,5") + &pose("2", "20") + &pose("3", "30");
    fs::write(logs.join("poses.csv"), poses("Cell 3\nstop;X;Y;Z;q1;q2;q3;q4\n")).unwrap();
    let output = trueline(dir.path(), &["import", "csv", "logs", "--robot", "abb", "--out", "imported"]);
    let said = words(&output);
    assert!(output.status.success() && said.contains("1 stops without a reading are ignored"), "{said}");
    assert!(said.contains("imported: 2 stops, 2 features"), "{said}");
    let written = |name: &str| fs::read_to_string(imported.join(name)).unwrap();
    assert_eq!(
        written("poses.csv"),
        "stop,x_mm,y_mm,z_mm,qw,qx,qy,qz\n1,10.5,0,300,1,0,0,0\n2,20,0,300,1,0,0,0\n"
    );
    assert_eq!(written("features.csv"), "stop,x_mm,z_mm\n1,0.5,100\n2,1.5,101\n");
    // A reading of no stop is at its line in the user's file.
    fs::write(logs.join("features.csv"), "stop;x_mm;z_mm\n1;0,5;100\n7;1,5;101\n").unwrap();
    let output = trueline(dir.path(), &["import", "csv", "logs", "--robot", "abb", "--out", "other"]);
    let said = words(&output);
    assert!(
        said.contains("features.csv, line 3") && said.contains("expected a stop of poses.csv, found 7"),
        "{said}"
    );
}
