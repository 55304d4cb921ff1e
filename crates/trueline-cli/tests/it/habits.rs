//! Habits common to every command: help, numbers out of range, output that cannot be written.

use std::fs;
use std::path::Path;
use std::process::Command;

/// Exit code and words.
fn trueline(folder: &Path, line: &str) -> (i32, String) {
    let program = env!("CARGO_BIN_EXE_trueline");
    let output = Command::new(program).current_dir(folder).args(line.split(' ')).output().unwrap();
    (output.status.code().unwrap(), String::from_utf8(output.stderr).unwrap())
}

#[test]
fn help_begins_with_what_the_program_does() {
    let output = Command::new(env!("CARGO_BIN_EXE_trueline")).arg("--help").output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    let first = "Calibrate a laser seam sensor on a robot: time offset, hand-eye and line, from one scan\n";
    assert!(text.starts_with(first), "{text}");
}

#[test]
fn a_number_that_is_out_of_range_is_told_and_not_taken_for_an_option() {
    let place = tempfile::tempdir().unwrap();
    for (line, words) in [
        ("simulate --out scan --duration-s -3", "`--duration-s`: expected 1 to 3600 s, found -3"),
        ("simulate --out scan --outliers 40", "`--outliers`: expected a share from 0 to 1, found 40"),
        ("simulate --out scan --drops -0.1", "`--drops`: expected a share from 0 to 1, found -0.1"),
        (
            "calibrate scan --speed-mm-s -5",
            "`--speed-mm-s`: expected a number of at least zero, up to 1e9, found -5",
        ),
    ] {
        let (code, told) = trueline(place.path(), line);
        assert_eq!(code, 2, "{line}: {told}");
        assert!(told.contains(words), "{line}: {told}");
        assert_eq!(fs::read_dir(place.path()).unwrap().count(), 0, "{line}: nothing is written");
    }
}

#[test]
fn a_dataset_that_is_not_there_or_is_a_file_is_told_as_such() {
    let place = tempfile::tempdir().unwrap();
    assert_eq!(trueline(place.path(), "simulate --preset quick --out scan --quiet").0, 0);
    for (line, words, hint) in [
        ("calibrate nowhere", "there is no file or folder `nowhere`", "give a dataset folder"),
        ("doctor scan/robot.csv", "scan/robot.csv: is a file of a dataset", "give its folder: `scan`"),
    ] {
        let (code, told) = trueline(place.path(), line);
        assert_eq!(code, 2, "{told}");
        assert!(told.contains(words) && told.contains(hint), "{told}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_called_that_and_leaves_no_half_file() {
    let place = tempfile::tempdir().unwrap();
    assert_eq!(trueline(place.path(), "simulate --preset quick --out scan --quiet").0, 0);
    let (code, told) = trueline(place.path(), "calibrate scan --quiet --json /dev/full");
    assert_eq!(code, 2, "{told}");
    assert!(told.contains("hint: the disk is full"), "{told}");
    // A file that cannot get its name is taken away again.
    let (code, _) = trueline(place.path(), "calibrate scan --quiet --json nowhere/result.json");
    assert_eq!(code, 2);
    let (code, _) = trueline(place.path(), "calibrate scan --quiet --json result.json");
    assert_eq!(code, 0);
    let mut names: Vec<_> =
        fs::read_dir(place.path()).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    assert_eq!(names, ["result.json", "scan"]);
}
