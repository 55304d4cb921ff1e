//! Watching a production as a user does it: lines of JSON, words, exit codes, and what the state says afterwards.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use serde_json::Value;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Command, Output, Stdio};

fn trueline(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_trueline")).current_dir(folder).args(arguments).output().unwrap()
}

fn words(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn lines(output: &Output) -> Vec<Value> {
    let text = String::from_utf8_lossy(&output.stdout);
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

const STATE: [&str; 4] = ["--state", "cell.sqlite", "--calibration", "result.json"];

#[test]
fn a_production_is_watched_from_its_calibration_to_an_alarm() {
    let dir = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| trueline(dir.path(), arguments);
    // The same cell: calibrated once on a good scan, then six check scans, the last two of them 0.3 ms late.
    assert!(run(&["simulate", "--preset", "good", "--out", "scan", "--quiet"]).status.success());
    assert!(run(&["calibrate", "scan", "--json", "result.json", "--quiet"]).status.code().unwrap() < 2);
    let change = ["--layout", "check-scan", "--change", "timing=0.3@4", "--out", "welds", "--quiet"];
    assert!(run(&[&["simulate", "--production", "6"], change.as_slice()].concat()).status.success());

    let watched =
        run(&[&["watch", "welds/weld-0000", "welds/weld-0001", "--json", "-"], STATE.as_slice()].concat());
    assert_eq!(watched.status.code(), Some(0), "{}", words(&watched));
    let told = lines(&watched);
    let words_of_first = words(&watched);
    assert_eq!(told.len(), 2);
    for line in &told {
        assert!(line["used"].as_u64().unwrap() > 100 && line["alarm"].is_null(), "{line}");
        // A moving scan is blind to nothing but the fixture, which has not been learnt.
        assert_eq!(line["blind_to"], serde_json::json!(["seam"]), "{line}");
    }

    let watched = run(&[&["watch", "--folder", "welds", "--once", "--json", "-"], STATE.as_slice()].concat());
    // Files that were written a moment ago are waited for: all six have been watched, two of them before.
    assert_eq!(watched.status.code(), Some(1), "{}", words(&watched));
    assert_eq!(lines(&watched).len(), 6);
    let said = words(&watched);
    assert!(said.contains("weld 0 (welds/weld-0000): already watched; no change was seen"), "{said}");
    // The two late welds: all words once, then one line.
    assert_eq!(said.matches("  check: ").count(), 1, "{said}");
    assert_eq!(said.matches("since weld 4 (welds/weld-0004)").count(), 2, "{said}");
    let silent: Vec<&str> = said.lines().filter(|line| line.contains("no change")).collect();
    assert_eq!(silent.len(), 4, "{said}");
    // Their blindness was reported with the first weld of the shift, and has not changed.
    assert!(!said.contains("blind"), "{said}");
    assert!(
        words_of_first.contains("  blind to seam: these welds cannot detect a moved part"),
        "{words_of_first}"
    );
    an_empty_folder_is_no_alarm(dir.path());
    let rest = ["welds/weld-0002", "welds/weld-0003", "welds/weld-0004", "welds/weld-0005"];
    let watched = run(&[&["watch", "--json", "-"], rest.as_slice(), STATE.as_slice()].concat());
    assert_eq!(watched.status.code(), Some(1), "{}", words(&watched));
    let told = lines(&watched);
    assert!(told[1]["alarm"].is_null());
    let alarm = &told[3]["alarm"];
    assert_eq!(alarm["kind"], "timing", "{alarm}");
    assert!(alarm["since"].as_str().unwrap().ends_with("weld-0004"), "{alarm}");
    assert!(alarm["p_log10"].as_f64().unwrap() <= -6.25);
    let (value, sigma) = (&alarm["change"]["time_offset_ms"], &alarm["change"]["sigma"]["time_offset_ms"]);
    assert!((value.as_f64().unwrap() - 0.3).abs() < 4.0 * sigma.as_f64().unwrap(), "{alarm}");

    let history = run(&["history", "--state", "cell.sqlite", "--csv", "-", "--report", "history.html"]);
    assert_eq!(history.status.code(), Some(0), "{}", words(&history));
    let table = String::from_utf8_lossy(&history.stdout).into_owned();
    assert_eq!(table.lines().count(), 7, "{table}");
    assert!(words(&history).contains("alarm: timing: Pictures arrive 0."), "{}", words(&history));
    let parquet = run(&["history", "--state", "cell.sqlite", "--parquet", "history.parquet", "--quiet"]);
    assert_eq!(parquet.status.code(), Some(0), "{}", words(&parquet));
    assert!(std::fs::read(dir.path().join("history.parquet")).unwrap().starts_with(b"PAR1"));
    is_served(dir.path());
    assert!(told.iter().all(|line| line["sensor_file_differs"] == false), "{told:?}");
    another_sensor_file_is_said(dir.path());
    let page = std::fs::read_to_string(dir.path().join("history.html")).unwrap();
    assert!(
        page.contains("Control charts")
            && page.contains("later since weld 4 (")
            && page.contains("blind to: seam")
    );
}

fn an_empty_folder_is_no_alarm(folder: &Path) {
    std::fs::create_dir(folder.join("empty")).unwrap();
    let empty = trueline(folder, &[&["watch", "--folder", "empty", "--once"], STATE.as_slice()].concat());
    assert_eq!(empty.status.code(), Some(0));
    assert!(words(&empty).contains("there is no weld in it"), "{}", words(&empty));
}

/// The same weld with another file of the sensor: what that may look like is said, and stands in its line.
fn another_sensor_file_is_said(folder: &Path) {
    let sensor = folder.join("welds/weld-0000/sensor.toml");
    let another = std::fs::read_to_string(&sensor).unwrap() + "\n# measured anew\n";
    std::fs::write(&sensor, another).unwrap();
    let other = [
        "watch",
        "welds/weld-0000",
        "--state",
        "other.sqlite",
        "--calibration",
        "result.json",
        "--json",
        "-",
    ];
    let watched = trueline(folder, &other);
    assert_eq!(lines(&watched)[0]["sensor_file_differs"], true);
    assert!(
        words(&watched).contains("sensor.toml differs from the file of the calibration"),
        "{}",
        words(&watched)
    );
}

/// A read-only program's text about the state, until it is interrupted.
#[cfg(feature = "serve")]
fn is_served(folder: &Path) {
    let mut program = Command::new(env!("CARGO_BIN_EXE_trueline"))
        .current_dir(folder)
        .args(["watch", "--state", "cell.sqlite", "--serve", "0"])
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut said = String::new();
    BufReader::new(program.stderr.take().unwrap()).read_line(&mut said).unwrap();
    let address =
        said.split("http://").nth(1).and_then(|rest| rest.split('/').next()).expect("no address").to_owned();
    assert!(address.starts_with("127.0.0.1:"), "loopback unless named: {said}");
    let get = |path: &str| {
        let mut stream = TcpStream::connect(&address).unwrap();
        write!(stream, "GET {path} HTTP/1.1\r\nHost: {address}\r\n\r\n").unwrap();
        let mut reply = String::new();
        stream.read_to_string(&mut reply).unwrap();
        reply
    };
    assert!(get("/").contains("ALARM: Pictures arrive 0."));
    assert!(get("/metrics").contains("trueline_watch_alarm{cell=\"cell\",kind=\"timing\"} 1.0"));
    program.kill().unwrap();
    program.wait().unwrap();
}

/// A cell's folder is served under a proxy's prefix until it is interrupted; a wrong prefix or folder is refused.
#[test]
#[cfg(feature = "serve")]
fn the_folder_of_a_cell_is_served() {
    let dir = tempfile::tempdir().unwrap();
    let mut program = Command::new(env!("CARGO_BIN_EXE_trueline"))
        .current_dir(dir.path())
        .args(["serve", ".", "--serve", "0", "--prefix", "/cells/7"])
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut said = String::new();
    BufReader::new(program.stderr.take().unwrap()).read_line(&mut said).unwrap();
    let (address, prefix) =
        said.split("http://").nth(1).and_then(|rest| rest.split_once('/')).expect("no address");
    assert!(prefix.starts_with("cells/7/ "), "{said}");
    let mut stream = TcpStream::connect(address).unwrap();
    write!(stream, "GET /cells/7/first-scan/ HTTP/1.1\r\nHost: {address}\r\n\r\n").unwrap();
    let mut reply = String::new();
    stream.read_to_string(&mut reply).unwrap();
    assert!(reply.starts_with("HTTP/1.1 200") && reply.contains("trueline calibrate "), "{reply}");
    program.kill().unwrap();
    program.wait().unwrap();
    for (line, told) in
        [("serve . --prefix cells", "expected a path"), ("serve nothing", "there is no folder `nothing`")]
    {
        let output = trueline(dir.path(), &line.split(' ').collect::<Vec<_>>());
        assert_eq!(output.status.code(), Some(2), "{line}");
        assert!(words(&output).contains(told), "{line}: {}", words(&output));
    }
}

/// Good check scans and some that are 0.3 mm off along the seam, of one cell and its calibration.
fn bumped_and_good(folder: &Path) {
    let layout = ["--layout", "check-scan", "--quiet", "--production", "14"];
    let make = |more: &[&str]| trueline(folder, &[&["simulate"], layout.as_slice(), more].concat()).status;
    assert!(make(&["--out", "good"]).success());
    assert!(make(&["--change", "bracket-x=0.3@8", "--out", "bumped"]).success());
}

fn names(folder: &str, numbers: std::ops::Range<usize>) -> Vec<String> {
    numbers.map(|number| format!("{folder}/weld-{number:04}")).collect()
}

fn watch(folder: &Path, welds: &[String], more: &[&str]) -> Output {
    let fixed = ["watch", "--state", "cell.sqlite", "--calibration", "good/weld-0000/truth.toml"];
    let welds = welds.iter().map(String::as_str);
    trueline(folder, &fixed.into_iter().chain(more.iter().copied()).chain(welds).collect::<Vec<_>>())
}

/// Six good welds, two bad ones, the good ones again: the alarm ends with the first of them, and none comes later.
#[test]
fn a_mended_fault_is_over_and_stays_so() {
    let dir = tempfile::tempdir().unwrap();
    bumped_and_good(dir.path());
    let welds = [names("good", 0..6), names("bumped", 8..10), names("good", 6..14)].concat();
    let watched = watch(dir.path(), &welds, &["--json", "-"]);
    assert_eq!(watched.status.code(), Some(0), "no alarm stands: {}", words(&watched));
    let told = lines(&watched);
    let states: Vec<&str> = told.iter().map(|line| line["state"].as_str().unwrap()).collect();
    assert_eq!(states, [vec!["good"; 6], vec!["alarm"; 2], vec!["good"; 8]].concat());
    let alarm = &told[7]["alarm"];
    assert_eq!((&alarm["kind"], &alarm["since_number"]), (&"bracket".into(), &6.into()), "{alarm}");
    let (error_mm, sigma_mm) =
        (alarm["seam_error_mm"].as_f64().unwrap(), alarm["seam_error_sigma_mm"].as_f64().unwrap());
    assert!((error_mm - 0.3).abs() < 4.0 * sigma_mm && sigma_mm < 0.05, "{alarm}");
    let text = alarm["text"].as_str().unwrap();
    assert!(text.starts_with("Seam points are 0.") && text.ends_with("Calibrate again."), "{text}");
    assert_eq!((&told[8]["good_since_number"], &told[8]["alarm"]), (&8.into(), &Value::Null));
    assert!(
        words(&watched).contains("The fault has been gone since weld 8 (good/weld-0006)"),
        "{}",
        words(&watched)
    );
    // Its welds teach nothing about the fixture.
    assert_eq!(told[15]["learning"]["pieces"], 14, "{}", told[15]);
    let history = trueline(dir.path(), &["history", "--state", "cell.sqlite", "--report", "history.html"]);
    assert!(words(&history).contains("no change seen"), "{}", words(&history));
    let page = std::fs::read_to_string(dir.path().join("history.html")).unwrap();
    assert!(
        page.contains("cleared at weld 8 (good/weld-0006)") && page.contains(text),
        "the alarm and its end"
    );
}

/// Below the tolerance a change is told everywhere, and is no alarm; above it is one.
#[test]
fn a_change_within_the_tolerance_is_told_and_is_no_alarm() {
    let dir = tempfile::tempdir().unwrap();
    bumped_and_good(dir.path());
    let welds = [names("good", 0..4), names("bumped", 8..10)].concat();
    let watched = watch(dir.path(), &welds, &["--json", "-", "--tolerance", "0.5mm"]);
    assert_eq!(watched.status.code(), Some(0), "{}", words(&watched));
    let told = lines(&watched);
    assert_eq!(told[5]["state"], "changed-within-tolerance", "{}", told[5]);
    let change = &told[5]["change_within_tolerance"];
    assert!(told[5]["alarm"].is_null() && change["kind"] == "bracket" && change["tolerance_mm"] == 0.5);
    assert!(change["text"].as_str().unwrap().contains("within the tolerance of 0.50 mm"), "{change}");
    let history = trueline(dir.path(), &["history", "--state", "cell.sqlite", "--csv", "-"]);
    assert!(words(&history).contains("changed within the tolerance: bracket: Seam points are 0."));
    let table = String::from_utf8_lossy(&history.stdout).into_owned();
    assert_eq!(table.matches(",changed-within-tolerance,bracket,").count(), 2, "{table}");
    let watched = watch(dir.path(), &names("bumped", 10..11), &["--tolerance", "0.1mm"]);
    assert_eq!(watched.status.code(), Some(1), "{}", words(&watched));
    assert!(words(&watched).contains("ALARM: Seam points are 0."), "{}", words(&watched));
}

/// A repair that is reported is believed until the welds say otherwise.
#[test]
fn a_repair_is_noted_and_a_wrong_one_is_told() {
    let dir = tempfile::tempdir().unwrap();
    bumped_and_good(dir.path());
    let said = |welds: &[String], more: &[&str]| {
        let output = watch(dir.path(), welds, more);
        (output.status.code().unwrap(), words(&output))
    };
    assert_eq!(said(&[names("good", 0..6), names("bumped", 8..10)].concat(), &["--quiet"]).0, 1);
    assert_eq!(
        said(&[], &["--repaired"]),
        (0, "Noted: the fault was repaired before weld 8. The next welds will verify it.\n".to_owned())
    );
    let history = trueline(dir.path(), &["history", "--state", "cell.sqlite"]);
    assert!(words(&history).contains("A repair before weld 8 is reported"), "{}", words(&history));
    let (code, words) = said(&names("bumped", 10..11), &[]);
    assert_eq!(code, 1, "{words}");
    assert!(words.contains("The repair reported before this weld did not clear it."), "{words}");
    assert!(words.contains("The first wrong weld is weld 6"), "{words}");
    let (code, words) = said(&[], &["--repaired", "good/weld-0006"]);
    assert!(code == 0 && words.contains("before weld 9") && words.contains("no change seen"), "{words}");
    assert!(said(&[], &["--repaired"]).1.contains("No change is active"));
    assert_eq!(said(&names("bumped", 11..12), &["--quiet"]).0, 1);
    for wrong in ["3", "weld-9999"] {
        let (code, words) = said(&[], &["--repaired", wrong]);
        assert!(code == 2 && words.contains("hint:"), "{words}");
    }
}

#[cfg(feature = "webhook")]
#[test]
fn a_receiver_that_is_not_there_changes_nothing_and_is_named() {
    let dir = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| trueline(dir.path(), arguments);
    let change = ["--layout", "check-scan", "--change", "timing=1@2", "--out", "welds", "--quiet"];
    assert!(run(&[&["simulate", "--production", "3"], change.as_slice()].concat()).status.success());
    let watched = run(&[
        "watch",
        "--state",
        "cell.sqlite",
        "--calibration",
        "welds/weld-0000/truth.toml",
        "--tell",
        "http://127.0.0.1:9/alarm?token=secret",
        "welds/weld-0000",
        "welds/weld-0001",
        "welds/weld-0002",
    ]);
    assert_eq!(watched.status.code(), Some(1), "an alarm: {}", words(&watched));
    let said = words(&watched);
    assert!(
        said.contains("127.0.0.1 has not received 1 alarm message (") && !said.contains("secret"),
        "{said}"
    );
    let wrong = run(&["watch", "--state", "cell.sqlite", "--calibration", "x", "--tell", "ftp://a/b"]);
    assert_eq!(wrong.status.code(), Some(2));
}

/// A spin of 0.2° in a box with a weave: its whole stripes show it, in files as in memory.
#[test]
fn welds_with_stripes_are_watched_by_them() {
    let dir = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| trueline(dir.path(), arguments);
    let change = [
        "--layout",
        "box-weave",
        "--plates",
        "--change",
        "bracket-turn-z=0.2@2",
        "--out",
        "welds",
        "--quiet",
    ];
    assert!(run(&[&["simulate", "--production", "3"], change.as_slice()].concat()).status.success());
    let truth = ["--state", "cell.sqlite", "--calibration", "welds/weld-0000/truth.toml", "--json", "-"];
    let watched = run(&[
        &["watch", "welds/weld-0000", "welds/weld-0001", "welds/weld-0002"],
        truth.as_slice(),
    ]
    .concat());
    assert_eq!(watched.status.code(), Some(1), "{}", words(&watched));
    let told = lines(&watched);
    assert!(told[1]["alarm"].is_null(), "{}", told[1]);
    let alarm = &told[2]["alarm"];
    assert_eq!((&alarm["kind"], &alarm["since_number"]), (&"bracket".into(), &2.into()), "{alarm}");
    let (value, sigma) = (&alarm["change"]["rotation_deg"][2], &alarm["change"]["sigma"]["rotation_deg"][2]);
    let sigma = sigma.as_f64().unwrap();
    assert!(sigma < 0.05 && (value.as_f64().unwrap() - 0.2).abs() < 4.0 * sigma, "{alarm}");
}

#[test]
fn what_cannot_be_watched_is_told_and_is_no_alarm() {
    let dir = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| trueline(dir.path(), arguments);
    std::fs::create_dir(dir.path().join("empty")).unwrap();
    for nothing in
        [&["watch"][..], &["watch", "--folder", "nothing"], &["watch", "nothing"], &["watch", "empty"]]
    {
        let nothing = run(&[nothing, STATE.as_slice()].concat());
        assert_eq!(nothing.status.code(), Some(2));
        assert!(words(&nothing).contains("hint:"), "{}", words(&nothing));
        assert!(!dir.path().join("cell.sqlite").exists(), "a state of nothing: {}", words(&nothing));
    }
    let history = run(&["history", "--state", "none.sqlite"]);
    assert_eq!(history.status.code(), Some(2));
    assert!(!dir.path().join("none.sqlite").exists(), "reading made a file");
    let change = run(&["simulate", "--production", "1", "--change", "weather=3@1", "--out", "x"]);
    assert_eq!(change.status.code(), Some(2));
    assert!(words(&change).contains("timing (ms)"), "{}", words(&change));
    let many = run(&["simulate", "--production", "1000000000", "--out", "many"]);
    assert_eq!(many.status.code(), Some(2));
    assert!(words(&many).contains("1..=10000"), "{}", words(&many));
    assert!(!dir.path().join("many").exists());
}
