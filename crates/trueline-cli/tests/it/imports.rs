//! Users' files of other programs for `import csv`: recognised forms, and the messages for others.

use crate::common;

use common::trueline;
use serde_json::Value;
use std::fmt::Write;
use std::fs;
use std::path::Path;

const FEATURES: &str = "time_s,x_mm,z_mm\n0.05,1,100\n0.15,2,101\n";

/// Exit code and words.
fn run(folder: &Path, line: &str) -> (Option<i32>, String) {
    let output = trueline(folder, &line.split_whitespace().collect::<Vec<_>>());
    let words = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap()).concat();
    (output.status.code(), words)
}

/// Imports logs of a profiler, with more options.
fn import(robot: &str, features: &str, more: &str) -> (Option<i32>, String) {
    let dir = tempfile::tempdir().unwrap();
    let logs = dir.path().join("logs");
    fs::create_dir(&logs).unwrap();
    for (name, text) in
        [("robot.csv", robot), ("features.csv", features), ("sensor.toml", "kind = \"profiler\"\n")]
    {
        fs::write(logs.join(name), text).unwrap();
    }
    run(dir.path(), &format!("import csv logs --out scan {more}"))
}

/// A robot's log under a line of names.
fn log(header: &str) -> String {
    (0..20).fold(format!("{header}\n"), |mut log, k| {
        writeln!(log, "{},{k},0,300,1,0,0,0", 0.01 * f64::from(k)).unwrap();
        log
    })
}

#[test]
fn names_that_are_near_are_offered_in_the_order_of_a_map() {
    let stamped = log("stamp_sec,x_mm,y_mm,z_mm,qw,qx,qy,qz");
    for (robot, features, more, hint) in [
        (stamped.as_str(), FEATURES, "--robot-map stamp_sec=time_s", "--robot-map 'time_s=stamp_sec'"),
        (
            &log("t,tcp_x,tcp_y,tcp_z,qw,qx,qy,qz"),
            FEATURES,
            "",
            "--robot-map 'x_mm=tcp_x,y_mm=tcp_y,z_mm=tcp_z'",
        ),
        (&log("robot_stamp,x_mm,y_mm,z_mm,qw,qx,qy,qz"), FEATURES, "", "--robot-map 'time_s=robot_stamp'"),
        (
            &log("time_s,x_mm,y_mm,z_mm,qw,qx,qy,qz"),
            "time_s,x [mm],Z\n0.05,1,100\n",
            "",
            "--features-map 'x_mm=x [mm]'",
        ),
        (
            "Zeit [s];$POS_FOR.X;$POS_FOR.Y;$POS_FOR.Z;$POS_FOR.A;$POS_FOR.B;$POS_FOR.C\n0;1;2;3;4;5;6\n",
            FEATURES,
            "",
            "$POS_FOR is the commanded pose",
        ),
    ] {
        let (code, said) = import(robot, features, more);
        assert!(code == Some(2) && said.contains(hint), "{hint}: {said}");
    }
    assert_eq!(import(&stamped, FEATURES, "--robot-map time_s=stamp_sec").0, Some(0));
}

#[test]
fn a_unit_that_says_there_is_none_leaves_the_name() {
    let log = log("Recording 12\ntime_s,x_mm,y_mm,z_mm,qw,qx,qy,qz\ns,mm,mm,mm,-,-,-,-");
    let (code, said) = import(&log, FEATURES, "");
    assert!(code == Some(0) && said.contains("20 robot poses"), "{said}");
}

#[test]
fn json_is_named_for_what_it_is() {
    let (code, said) = import("[\n{\"t\": 1.0, \"x\": 2.0},\n{\"t\": 2.0, \"x\": 2.0}\n]\n", FEATURES, "");
    assert!(code == Some(2) && said.contains("robot.csv: is JSON; this format is not supported"), "{said}");
}

/// Points of a program that writes decimal commas, in its numbers and in its times.
#[test]
fn points_with_decimal_commas_in_their_times_come_in() {
    let dir = tempfile::tempdir().unwrap();
    let logs = dir.path().join("logs");
    fs::create_dir(&logs).unwrap();
    let mut robot = "t,x,y,z,q1,q2,q3,q4\n".to_owned();
    let mut points = "X;Z;Timestamp;ProfileCounter\n".to_owned();
    for k in 0..20 {
        writeln!(robot, "{},{k},0,300,1,0,0,0", 50_592.0 + f64::from(k)).unwrap();
        for x in 0..30 {
            writeln!(points, "{x},5;80,{k};14:03:{:02},{:03};{k}", 12 + k, 5 * k).unwrap();
        }
    }
    fs::write(logs.join("robot.csv"), robot).unwrap();
    fs::write(logs.join("scan.asc"), points).unwrap();
    let base = "import csv logs --robot abb --profiles scan.asc --profile-format scancontrol --out scan";
    let (code, said) = run(dir.path(), base);
    assert!(code == Some(0) && said.contains("20 profiles (profiler)"), "{said}");
    let written = fs::read_to_string(dir.path().join("scan/profiles.csv")).unwrap();
    assert!(written.contains("50593.005000000,1,0.5,80.1\n"), "{}", &written[..200]);
    fs::write(logs.join("scan.asc"), "1;2;3;4\n1;2;3;4\n").unwrap();
    let (_, said) = run(dir.path(), base);
    assert!(said.contains("scan.asc, line 1: expected 3 fields, found 4"), "{said}");
}

/// One number everywhere: the statement about the stamps holds for the written dataset.
#[test]
fn an_import_says_which_stamps_it_has_moved() {
    let dir = tempfile::tempdir().unwrap();
    assert_eq!(run(dir.path(), "simulate --preset quick --out scan --quiet").0, Some(0));
    let file = dir.path().join("scan/features.csv");
    let text = fs::read_to_string(&file).unwrap();
    let first = |text: &str| -> f64 {
        let row = text.lines().nth(1).unwrap();
        row.split(',').next().unwrap().parse().unwrap()
    };
    let mut late = String::new();
    for (index, line) in text.lines().enumerate() {
        let (time, rest) = line.split_once(',').unwrap();
        match index {
            0 => writeln!(late, "{line}").unwrap(),
            _ => writeln!(late, "{:.9},{rest}", time.parse::<f64>().unwrap() + 500.0).unwrap(),
        }
    }
    fs::write(&file, &late).unwrap();
    let (code, said) = run(dir.path(), "import csv scan --align-clocks --out aligned");
    assert_eq!(code, Some(0), "{said}");
    let moved = first(&fs::read_to_string(dir.path().join("aligned/features.csv")).unwrap()) - first(&late);
    assert!((moved + 500.0).abs() < 0.1, "{moved}");
    let of_dataset = format!("{moved:+.3} s is added to the sensor's stamps in this dataset");
    let of_sensor = format!("add {:+.3} s to it", -moved);
    assert!(said.contains(&of_dataset) && said.contains(&of_sensor), "{said}");
    assert!(!said.contains("below"), "{said}");
}

#[test]
fn the_time_offset_of_a_refused_result_is_not_exported() {
    let dir = tempfile::tempdir().unwrap();
    assert_eq!(run(dir.path(), "simulate --preset quick --out scan --quiet").0, Some(0));
    assert_eq!(run(dir.path(), "calibrate scan --json result.json --quiet").0, Some(0));
    let file = dir.path().join("result.json");
    let mut result: Value = serde_json::from_str(&fs::read_to_string(&file).unwrap()).unwrap();
    result["status"] = "not_accepted".into();
    fs::write(&file, result.to_string()).unwrap();
    let (code, said) = run(dir.path(), "export result.json --as time-offset");
    assert!(code == Some(1) && said.contains("result.json: the result was not accepted"), "{said}");
    assert!(!said.contains("true exposure"), "{said}");
    let (code, said) = run(dir.path(), "export result.json --as kuka");
    assert!(code == Some(1) && said.contains("TOOL_DATA") && !said.contains("true exposure"), "{said}");
    // It is 17.73 ms; the other forms have the pose alone.
    for form in ["csv", "json", "opencv"] {
        let (code, said) = run(dir.path(), &format!("export result.json --as {form}"));
        assert!(code == Some(1) && !said.contains("17.7") && !said.contains("0.0177"), "{form}: {said}");
    }
}
