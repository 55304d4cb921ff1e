//! The log of the program: stages with their durations in a file, what RUST_LOG chooses, and nothing of it on stdout.

use crate::common;

use common::{code, command, trueline, words};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::Output;

/// A folder with a simulated scan.
fn scan() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(code(&trueline(folder.path(), &["simulate", "--out", "scan", "--quiet"])), 0);
    folder
}

fn lines(file: &Path) -> Vec<Value> {
    let text = fs::read_to_string(file).unwrap();
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

/// Calibrates with RUST_LOG, or with none.
fn calibrate(folder: &Path, rust_log: Option<&str>, options: &[&str]) -> Output {
    let mut command = command(folder, &[&["calibrate", "scan"], options].concat());
    command.env_remove("RUST_LOG");
    if let Some(chosen) = rust_log {
        command.env("RUST_LOG", chosen);
    }
    command.output().unwrap()
}

#[test]
fn a_log_holds_every_stage_with_its_duration_and_what_was_told_and_stdout_is_as_without() {
    let place = scan();
    let folder = place.path();
    let without = calibrate(folder, None, &[]);
    let with = calibrate(folder, None, &["--log-file", "run.jsonl", "--json", "result.json"]);
    assert_eq!((code(&with), &with.stdout, &with.stderr), (0, &without.stdout, &without.stderr));
    let log = lines(&folder.join("run.jsonl"));
    let duration = |span: &str| {
        let ended = log.iter().find(|line| line["span"] == span && line["duration_s"].is_number());
        ended.unwrap_or_else(|| panic!("no end of {span} in {log:#?}"))["duration_s"].as_f64().unwrap()
    };
    let whole = duration("calibrate");
    let stages = ["input", "search", "time_stamps", "clock_drift", "identifiability", "bias", "conclude"];
    let stages: f64 = stages.map(|stage| duration(&format!("calibrate/{stage}"))).iter().sum();
    // The last stages follow each other inside the whole. Some run again inside others: those are longer paths.
    assert!(stages > 0.0 && stages <= whole, "{stages} of {whole} s");
    assert!(duration("calibrate/conclude/covariance") <= duration("calibrate/conclude"));
    let read = log.iter().find(|line| line["span"] == "read").unwrap();
    assert!(read["fields"]["robot_poses"].as_u64().unwrap() > 100, "{read}");
    let written = log.iter().find(|line| line["message"] == "written").unwrap();
    let bytes = fs::metadata(folder.join("result.json")).unwrap().len();
    assert_eq!(
        (&written["fields"]["file"], &written["fields"]["bytes"]),
        (&"result.json".into(), &bytes.into())
    );
    for line in &log {
        assert!(
            line["time"].is_string() && line["level"].is_string() && line["target"].is_string(),
            "{line}"
        );
    }
    // Failures are in the log as well; a second run adds to it.
    let failed = trueline(folder, &["calibrate", "missing", "--log-file", "run.jsonl"]);
    assert_eq!(code(&failed), 2);
    let longer = lines(&folder.join("run.jsonl"));
    assert_eq!(longer[..log.len()], log);
    let last = longer.last().unwrap();
    assert!(last["level"] == "ERROR" && last["message"].as_str().unwrap().contains("missing"), "{last}");
}

#[test]
fn rust_log_chooses_what_is_logged_and_shows_it_on_stderr_without_a_file() {
    let place = scan();
    let folder = place.path();
    assert_eq!(code(&calibrate(folder, Some("off"), &["--log-file", "off.jsonl"])), 0);
    assert_eq!(lines(&folder.join("off.jsonl")), Vec::<Value>::new());
    assert_eq!(code(&calibrate(folder, Some("trueline_method=debug"), &["--log-file", "method.jsonl"])), 0);
    let log = lines(&folder.join("method.jsonl"));
    let is_method = |line: &Value| line["target"].as_str().unwrap().starts_with("trueline_method");
    assert!(log.len() > 5 && log.iter().all(is_method), "{log:#?}");
    // Only whole runs are at the level of what users read.
    calibrate(folder, Some("trueline_method=info"), &["--log-file", "info.jsonl"]);
    assert_eq!(lines(&folder.join("info.jsonl")).len(), 1);
    let shown = calibrate(folder, Some("debug"), &["--quiet"]);
    assert!(words(&shown).contains("calibrate/search: ") && shown.stdout.is_empty(), "{}", words(&shown));
    let wrong = calibrate(folder, Some("a=b=c"), &["--quiet"]);
    assert_eq!(code(&wrong), 0);
    assert!(words(&wrong).contains("warning: RUST_LOG is ignored"), "{}", words(&wrong));
}

#[test]
fn verbose_shows_what_is_read_and_written_and_how_long_it_took() {
    let place = scan();
    let quiet = calibrate(place.path(), None, &["--quiet", "--json", "result.json"]);
    let verbose = calibrate(place.path(), None, &["--quiet", "--json", "result.json", "-v"]);
    assert_eq!((words(&quiet).as_str(), &quiet.stdout), ("", &verbose.stdout));
    let said = words(&verbose);
    let first_words: Vec<&str> = said.lines().map(|line| line.split([':', ',']).next().unwrap()).collect();
    assert_eq!(first_words, ["read", "calibrate", "written"], "{said}");
    assert!(
        said.contains(" s, path scan, robot_poses ") && said.contains("file result.json, bytes "),
        "{said}"
    );
}

#[test]
fn a_log_that_cannot_be_written_ends_it_and_other_files_stay_as_they_are() {
    let place = scan();
    let folder = place.path();
    let robot = fs::read(folder.join("scan/robot.csv")).unwrap();
    for (file, why) in [
        ("none/run.jsonl", "cannot be written"),
        ("scan", "cannot be written"),
        ("scan/robot.csv", "not a log of trueline"),
    ] {
        let refused = calibrate(folder, None, &["--log-file", file]);
        let said = words(&refused);
        assert_eq!((code(&refused), refused.stdout.len()), (2, 0));
        assert!(said.contains(&format!("error: {file}: ")) && said.contains(why), "{said}");
        assert!(said.contains("hint: --log-file "), "{said}");
    }
    assert_eq!(fs::read(folder.join("scan/robot.csv")).unwrap(), robot);
}

#[test]
fn quiet_is_an_option_of_every_command_before_or_behind_its_name() {
    let place = tempfile::tempdir().unwrap();
    for command in [
        &["-q", "man", "--out", "a"][..],
        &["man", "--out", "b", "--quiet"],
        &["-q", "simulate", "--out", "c"],
    ] {
        let output = trueline(place.path(), command);
        assert_eq!((code(&output), words(&output).as_str(), output.stdout.len()), (0, "", 0), "{command:?}");
    }
}

/// Help of a command names global options once, below.
#[test]
fn global_options_stand_in_the_help_of_the_program_alone() {
    let place = tempfile::tempdir().unwrap();
    let help = |words: &[&str]| String::from_utf8(trueline(place.path(), words).stdout).unwrap();
    let whole = help(&["--help"]);
    let (_, global) = whole.split_once("Global options:").unwrap();
    assert!(
        ["--color", "--verbose", "--log-file", "--help"].iter().all(|name| global.contains(name)),
        "{whole}"
    );
    let of_command = help(&["diff", "--help"]);
    assert!(
        of_command
            .trim_end()
            .ends_with("Global options, such as --quiet, --verbose and --log-file: `trueline --help`")
    );
    assert!(!of_command.contains("  -v, --verbose"), "{of_command}");
}

#[cfg(unix)]
#[test]
fn names_of_strangers_are_written_out_in_the_log() {
    let place = scan();
    let folder = place.path();
    let evil = "a\x1b[2J\u{9b}31m\u{202e}b.json";
    assert_eq!(code(&calibrate(folder, None, &["--quiet", "--log-file", "run.jsonl", "--json", evil])), 0);
    let text = fs::read_to_string(folder.join("run.jsonl")).unwrap();
    let obeyed = |c: char| c.is_control() && c != '\n' || c == '\u{202e}';
    assert!(!text.contains(obeyed), "{text:?}");
    let log = lines(&folder.join("run.jsonl"));
    let written = log.iter().find(|line| line["message"] == "written").unwrap();
    assert_eq!(written["fields"]["file"], evil, "the text keeps its meaning");
}
