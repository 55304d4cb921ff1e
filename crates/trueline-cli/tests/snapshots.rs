//! Users, the book and other programs rely on these words: help, and messages about mistakes. They change only on
//! purpose.
//!
//! After a change on purpose: `INSTA_UPDATE=always cargo test -p trueline-cli --test snapshots`, and `docs/book/check.py --update`
//! for the help.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;

/// Exit code, stdout and stderr.
fn told(folder: &Path, line: &str) -> (i32, String, String) {
    let words = line.split_whitespace();
    let program = env!("CARGO_BIN_EXE_trueline");
    let output =
        Command::new(program).current_dir(folder).args(words).env_remove("COLUMNS").output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

/// The book has the help of every command, made by its check; here without the book's tools.
#[test]
fn the_help_of_every_command_is_that_of_the_book() {
    let book = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/book/src/reference/commands.md");
    let Ok(book) = fs::read_to_string(book) else {
        // A published crate comes without the book.
        assert!(!Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs").exists());
        return;
    };
    let sections: Vec<&str> = book.split("\n## `trueline").skip(1).collect();
    assert!(sections.len() >= 30, "{} commands", sections.len());
    let place = tempfile::tempdir().unwrap();
    for section in sections {
        let (name, rest) = section.split_once('`').unwrap();
        // `trueline robot-sim` is `trueline-testbench robot-sim`.
        let name = name.trim_start_matches("-testbench").trim_start();
        let text = rest.split_once("```text\n").unwrap().1.rsplit_once("\n```").unwrap().0;
        let (code, help, _) = told(place.path(), &format!("{name} --help"));
        let help: Vec<&str> = help.lines().map(str::trim_end).collect();
        assert!(
            code == 0 && help.join("\n").trim_end() == text.trim_end(),
            "`trueline {name} --help` is not the book's"
        );
    }
}

#[test]
fn every_command_is_in_the_book() {
    let book = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/book/src/reference/commands.md");
    let Ok(book) = fs::read_to_string(book) else {
        // A published crate comes without the book.
        assert!(!Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs").exists());
        return;
    };
    let (_, help, _) = told(Path::new("."), "--help");
    let commands = help.split_once("\nCommands:\n").unwrap().1.split("\n\n").next().unwrap();
    // Names begin in the third column; what continues a sentence stands further right.
    let names = commands.lines().filter(|line| line.starts_with("  ") && !line.starts_with("   "));
    for name in names.map(|line| line.split_whitespace().next().unwrap()).filter(|name| *name != "help") {
        assert!(book.contains(&format!("\n## `trueline {name}` ")), "{name}");
    }
}

/// Complete messages about mistakes: command line, words, exit code. Some of the words are the operating system's.
#[cfg(unix)]
#[test]
fn mistakes_are_told_in_these_words() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    assert_eq!(told(folder, "simulate --preset quick --out scan --quiet").0, 0);
    fs::write(folder.join("broken.json"), "{").unwrap();
    fs::write(folder.join("broken.toml"), "[[").unwrap();
    fs::write(folder.join("empty.csv"), "").unwrap();
    fs::write(folder.join("words.csv"), "t_s,x_mm\n1,two\n").unwrap();
    let changed = |name: &str, change: &dyn Fn(&str) -> String| {
        let copy = folder.join(name);
        fs::create_dir(&copy).unwrap();
        for file in ["robot.csv", "features.csv", "sensor.toml"] {
            fs::copy(folder.join("scan").join(file), copy.join(file)).unwrap();
        }
        let text = fs::read_to_string(copy.join("robot.csv")).unwrap();
        fs::write(copy.join("robot.csv"), change(&text)).unwrap();
    };
    changed("renamed", &|text| text.replace("x_mm,y_mm,z_mm", "X,Y,Z"));
    changed("headless", &|text| text.split_once('\n').unwrap().1.to_owned());
    changed("short", &|text| text.lines().take(2).fold(String::new(), |all, line| all + line + "\n"));
    changed("ragged", &|text| text.replacen('\n', "\n1,2\n", 1));
    changed("nothing", &|_| String::new());
    let mut all = String::new();
    for line in LINES {
        let (code, out, words) = told(folder, line);
        assert!(out.is_empty(), "`{line}` writes to standard output: {out}");
        let words: Vec<&str> = words.lines().map(str::trim_end).collect();
        writeln!(all, "$ trueline {line}\n{}\n[{code}]\n", words.join("\n")).unwrap();
    }
    insta::assert_snapshot!(all);
}

#[cfg(unix)]
const LINES: [&str; 51] = [
    "callibrate scan",
    "calibrate",
    "calibrate nowhere",
    "calibrate scan/robot.csv",
    "calibrate scan --initial gess.toml",
    "calibrate scan --initial broken.toml",
    "calibrate scan --require time=1mm",
    "calibrate scan --require seam",
    "calibrate scan --speed-mm-s -5",
    "calibrate scan --drawn-line 1,2",
    "calibrate scan --json nowhere/result.json",
    "calibrate renamed",
    "calibrate headless",
    "calibrate short",
    "calibrate ragged",
    "calibrate nothing",
    "simulate --out scan",
    "simulate --out other --preset quik",
    "simulate --out other --duration-s -3",
    "simulate --out other --outliers 40",
    "evaluate scan --calibration nothing.json",
    "evaluate scan --calibration broken.json",
    "evaluate scan",
    "diff broken.json broken.json",
    "apply scan --calibration broken.json --out seam.csv",
    "export nowhere.json --as abb-rapid",
    "export scan/truth.toml --as nobody",
    "features scan",
    "import lvs-st-calib nowhere --out x",
    "import tum words.csv --features scan/features.csv --sensor scan/sensor.toml --out x",
    "import tum empty.csv --features scan/features.csv --sensor scan/sensor.toml --out x",
    "import mcap words.csv --out x",
    "import rosbag2 nowhere --out x",
    "sensor intrinsics nowhere",
    "plan nowhere.toml --out p",
    "plan broken.toml --out p",
    "watch nowhere --calibration broken.json --state watch.db",
    "history --state nowhere.db",
    "scan nowhere.csv --limits nowhere.toml",
    "scan scan/robot.csv --limits nowhere.toml",
    "scan scan/robot.csv --limits broken.toml",
    "listen --protocol fanuc-hspo --bind 127.0.0.1:5000 --inputs DI1",
    "listen --protocol fanuc-stream-motion --robot 127.0.0.1 --inputs 101",
    "listen --protocol kuka-rsi --bind 127.0.0.1:5000 --answer-rsi nowhere.xml",
    "listen --protocol kuka-rsi --bind 127.0.0.1:5000 --robot 127.0.0.1 --answer-rsi broken.toml",
    "robot-program ur scan/robot.csv --out x --signal 3",
    "robot-program kuka scan/robot.csv --out x --pc 192.168.1.20:49152 --tool tCam",
    "robot-program kuka scan/robot.csv --out x --pc 192.168.1.20:49152 --signal doCamera",
    "robot-program abb scan/robot.csv --out x --tool tCam",
    "robot-program abb scan/robot.csv --out x --pc 192.168.125.10:6510 --timeout-s 0.5",
    "robot-program abb scan/robot.csv --out x --pc 0.0.0.0:6510",
];
