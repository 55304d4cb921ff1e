//! The live commands as their user runs them, against the simulated controller on loopback.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "it/common/mod.rs"]
mod common;

use common::{address, code, command, trueline, words};
use serde_json::Value;
use std::fs;
use std::io::Write;
use std::net::UdpSocket;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

fn start(folder: &Path, arguments: &[&str]) -> Child {
    command(folder, arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// A gentle path of 3 s, a pose every 20 ms.
fn write_path(folder: &Path) {
    let mut text = String::from("time_s,x_mm,y_mm,z_mm,qw,qx,qy,qz\n");
    for k in 0..=150 {
        let t = f64::from(k) * 0.02;
        let a = 0.05 * (2.0 * t).sin();
        let (x, y) = (900.0 + 30.0 * t, 5.0 * (3.0 * t).sin());
        text.push_str(&format!("{t:.2},{x:.6},{y:.6},600,{:.9},{:.9},0,0\n", a.sin(), a.cos()));
    }
    fs::write(folder.join("path.csv"), text).unwrap();
}

/// On a machine that is busy with other tests a scan may be interrupted, but not ended by it.
const PATIENT: [&str; 2] = ["--timeout-s", "1.9"];

/// A simulated controller that ends with the test.
struct Robot(Child);

impl Drop for Robot {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn guided(folder: &Path, pc: &str, more: &[&str]) -> Robot {
    let mut arguments = vec![
        "robot-sim",
        "--pc",
        pc,
        "--mode",
        "guidance",
        "--path",
        "path.csv",
        "--gain-per-s",
        "20",
        "--near-mm",
        "0.05",
        "--near-deg",
        "0.05",
        "--near-for-s",
        "3",
        "--timeout-s",
        "2",
        "--for-s",
        "30",
    ];
    arguments.extend(more);
    Robot(start(folder, &arguments))
}

fn lead(folder: &Path, pc: &str, more: &[&str]) -> Child {
    let mut arguments = vec![
        "scan",
        "path.csv",
        "--limits",
        "limits.toml",
        "--enable-motion",
        "--bind",
        pc,
        "--robot",
        "127.0.0.1",
        "--out",
        "scan",
        "--hold-s",
        "3.5",
    ];
    arguments.extend(PATIENT);
    arguments.extend(more);
    let mut scan = start(folder, &arguments);
    scan.stdin.take().unwrap().write_all(b"move\n").unwrap();
    thread::sleep(Duration::from_millis(300));
    scan
}

fn interrupt(child: &Child) {
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
}

/// Waits for a sentence in what a simulated controller says at its end.
fn ended(mut robot: Child) -> String {
    let deadline = Instant::now() + Duration::from_secs(20);
    while robot.try_wait().unwrap().is_none() && Instant::now() < deadline {
        thread::sleep(Duration::from_millis(100));
    }
    let _ = robot.kill();
    words(&robot.wait_with_output().unwrap())
}

fn folder_with_limits() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    write_path(dir.path());
    let written = trueline(dir.path(), &["scan", "path.csv", "--write-limits", "limits.toml"]);
    assert_eq!(code(&written), 0, "{}", words(&written));
    dir
}

#[test]
fn a_recording_to_which_nothing_came_does_not_stand_in_the_way_of_the_next() {
    let dir = tempfile::tempdir().unwrap();
    let pc = address();
    for _ in 0..2 {
        let silent = trueline(dir.path(), &["record", "--bind", &pc, "--out", "scan", "--for-s", "0.3"]);
        assert_eq!(code(&silent), 1, "{}", words(&silent));
        assert!(words(&silent).contains("nothing arrived, so there is no scan"), "{}", words(&silent));
        assert!(!words(&silent).contains("written to"), "{}", words(&silent));
        assert_eq!(fs::read_dir(dir.path().join("scan")).unwrap().count(), 0);
    }
    // Nothing came, and a stranger's packets are the only known reason.
    let stranger = UdpSocket::bind("127.0.0.1:0").unwrap();
    let record = start(dir.path(), &["record", "--bind", &pc, "--out", "scan", "--for-s", "2"]);
    for _ in 0..150 {
        let _not_there_yet = stranger.send_to(b"hello", &pc);
        thread::sleep(Duration::from_millis(10));
    }
    assert_eq!(record.wait_with_output().unwrap().status.code(), Some(1));
    assert!(dir.path().join("scan/recording.mcap").exists());
}

#[test]
fn listen_tells_who_talks_and_says_what_to_look_at_when_nobody_does() {
    let dir = tempfile::tempdir().unwrap();
    let pc = address();
    let silent = trueline(dir.path(), &["listen", "--bind", &pc, "--for-s", "0.2"]);
    assert_eq!(code(&silent), 1);
    assert!(
        String::from_utf8_lossy(&silent.stdout).contains("UDPUC device's remote address must be 127.0.0.1")
    );

    let robot = start(
        dir.path(),
        &[
            "robot-sim",
            "--pc",
            &pc,
            "--for-s",
            "3",
            "--robotware",
            "6.10",
            "--loss",
            "0.02",
            "--drift-ppm",
            "-200",
        ],
    );
    let heard = trueline(dir.path(), &["listen", "--bind", &pc, "--for-s", "2", "--json", "link.json"]);
    assert_eq!(code(&heard), 0, "{}", words(&heard));
    let link: Value = serde_json::from_slice(&fs::read(dir.path().join("link.json")).unwrap()).unwrap();
    let robot_heard = &link["robot"];
    assert_eq!(robot_heard["robotware"], "RobotWare 6.10 or later");
    assert!((robot_heard["period_s"].as_f64().unwrap() - 0.004_032).abs() < 2e-6);
    assert!(robot_heard["lost"].as_u64().unwrap() > 0);
    // 200 ppm of the second between the quickest frames of both ends, to some 0.05 ms of the machine's.
    assert!((robot_heard["clock_drift_ppm"].as_f64().unwrap() + 200.0).abs() < 150.0, "{robot_heard}");
    assert!(robot_heard["state"].as_str().unwrap().contains("streaming only"));
    assert!(ended(robot).contains("frames sent"));

    let _robot = Robot(start(dir.path(), &["robot-sim", "--pc", &pc, "--for-s", "3"]));
    let other = trueline(dir.path(), &["listen", "--bind", &pc, "--robot", "127.0.0.9", "--for-s", "1.5"]);
    assert_eq!(code(&other), 1);
    assert!(String::from_utf8_lossy(&other.stdout).contains("--robot names 127.0.0.9"));
}

#[test]
fn addresses_that_are_not_ours_or_taken_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let foreign = trueline(dir.path(), &["listen", "--bind", "192.0.2.77:6510"]);
    assert_eq!(code(&foreign), 2);
    assert!(words(&foreign).contains("not an address of this PC"));
    let taken = UdpSocket::bind("127.0.0.1:0").unwrap();
    let busy = trueline(dir.path(), &["listen", "--bind", &taken.local_addr().unwrap().to_string()]);
    assert_eq!(code(&busy), 2);
    assert!(words(&busy).contains("another program listens there"));
    for bad in [["--loss", "1.5"], ["--period-ms", "0"], ["--event", "5:explode"], ["--gain-per-s", "NaN"]] {
        let mut arguments = vec!["robot-sim", "--pc", "127.0.0.1:9"];
        arguments.extend(bad);
        assert_eq!(code(&trueline(dir.path(), &arguments)), 2, "{bad:?}");
    }
}

/// A stream that loses a third is recorded, with a message; occasional losses in a network are no fault.
#[test]
fn a_recording_that_lost_much_of_the_robots_stream_says_so() {
    let dir = tempfile::tempdir().unwrap();
    for (loss, expected) in [("0.35", 1), ("0.01", 0)] {
        let (pc, out) = (address(), format!("rec{loss}"));
        let _robot = Robot(start(dir.path(), &["robot-sim", "--pc", &pc, "--for-s", "8", "--loss", loss]));
        let recorded = trueline(dir.path(), &["record", "--bind", &pc, "--out", &out, "--for-s", "2"]);
        let said = words(&recorded);
        assert_eq!(code(&recorded), expected, "{said}");
        assert_eq!(said.contains("packet loss from the robot"), expected == 1, "{said}");
    }
}

#[test]
fn what_is_of_cameras_alone_is_refused_where_there_is_none() {
    let dir = tempfile::tempdir().unwrap();
    let record = ["record", "--bind", "127.0.0.1:0", "--out", "rec", "--for-s", "0.1"];
    for of_camera in [["--stamp", "exposure"], ["--joint", "lap"], ["--fps", "5"], ["--trigger", "Line1"]] {
        let refused = trueline(dir.path(), &[&record[..], &of_camera].concat());
        assert_eq!(code(&refused), 2, "{of_camera:?}");
        assert!(words(&refused).contains("--camera"), "{}", words(&refused));
    }
    assert!(!dir.path().join("rec").exists());
    let planned = trueline(
        dir.path(),
        &["plan", "--example", "--out", "plan", "--duration-s", "10", "--tries", "100", "--quiet"],
    );
    assert!(dir.path().join("plan").is_dir(), "{}", words(&planned));
    let truth = address();
    let camera =
        ["camera-sim", "plan", "--robot-truth", &truth, "--profiles-per-frame", "4", "--for-s", "0.1"];
    let refused = trueline(dir.path(), &camera);
    assert_eq!(code(&refused), 2);
    assert!(words(&refused).contains("is a camera"), "{}", words(&refused));
}

#[test]
fn nothing_moves_without_limits_the_option_and_the_word() {
    let dir = folder_with_limits();
    let pc = address();
    let dry = trueline(dir.path(), &["scan", "path.csv", "--limits", "limits.toml"]);
    assert_eq!(code(&dry), 0);
    assert!(String::from_utf8_lossy(&dry.stdout).contains("Nothing moves"));
    let enabled =
        ["scan", "path.csv", "--enable-motion", "--bind", &pc, "--robot", "127.0.0.1", "--out", "scan"];
    assert_eq!(code(&trueline(dir.path(), &enabled)), 2, "limits are asked for");
    let mut with_limits = enabled.to_vec();
    with_limits.extend(["--limits", "limits.toml"]);
    let socket = UdpSocket::bind(&pc).unwrap();
    drop(socket);
    for typed in ["", "yes\n", "Move it\n"] {
        let mut scan = start(dir.path(), &with_limits);
        scan.stdin.take().unwrap().write_all(typed.as_bytes()).unwrap();
        let output = scan.wait_with_output().unwrap();
        assert_eq!(code(&output), 2);
        assert!(words(&output).contains("not confirmed: nothing was sent"));
    }
    assert!(!dir.path().join("scan").exists());
}

#[test]
fn limits_files_say_everything_and_are_checked() {
    let dir = folder_with_limits();
    let good = fs::read_to_string(dir.path().join("limits.toml")).unwrap();
    let refused = |text: &str, word: &str| {
        fs::write(dir.path().join("bad.toml"), text).unwrap();
        let output = trueline(dir.path(), &["scan", "path.csv", "--limits", "bad.toml"]);
        assert_eq!(code(&output), 2, "{word}");
        assert!(words(&output).contains(word), "{word}: {}", words(&output));
    };
    let without = |key: &str| -> String {
        good.lines().filter(|line| !line.starts_with(key)).map(|line| format!("{line}\n")).collect()
    };
    let with = |key: &str, value: &str| -> String {
        good.lines()
            .map(
                |line| if line.starts_with(key) { format!("{key} = {value}\n") } else { format!("{line}\n") },
            )
            .collect()
    };
    refused(&without("jerk_mm_s3"), "jerk_mm_s3");
    refused(&with("speed_mm_s", "251"), "250 mm/s");
    refused(&with("speed_mm_s", "-1"), "above 0");
    refused(&with("speed_mm_s", "nan"), "above 0");
    refused(&with("axis", "[0, 0, 0]"), "a direction");
    refused(&with("min_mm", "[2000, 0, 0]"), "min_mm below max_mm");
    refused(&(good.clone() + "\n[extra]\na = 1\n"), "extra");
    refused(&with("speed_mm_s", "10"), "the speed reaches");
    refused(&with("max_mm", "[950, 100, 700]"), "outside the box");
}

#[test]
fn a_scan_travels_its_path_and_records_it() {
    let dir = folder_with_limits();
    let pc = address();
    let scan = lead(dir.path(), &pc, &[]);
    let robot = guided(dir.path(), &pc, &["--loss", "0.01", "--reorder", "0.01"]);
    let output = scan.wait_with_output().unwrap();
    assert_eq!(code(&output), 0, "{}", words(&output));
    assert!(words(&output).contains("the path was travelled"));
    assert!(String::from_utf8_lossy(&output.stdout).contains("answers"));
    // At rest for the condition time, EGMRunPose returned.
    drop(robot);
    let recording = dir.path().join("scan/recording.mcap");
    assert!(fs::metadata(&recording).unwrap().len() > 100_000);
    // Recordings are never overwritten.
    let mut again = start(
        dir.path(),
        &[
            "scan",
            "path.csv",
            "--limits",
            "limits.toml",
            "--enable-motion",
            "--robot",
            "127.0.0.1",
            "--bind",
            &pc,
            "--out",
            "scan",
        ],
    );
    again.stdin.take().unwrap().write_all(b"move\n").unwrap();
    let again = again.wait_with_output().unwrap();
    assert_eq!(code(&again), 2);
    assert!(words(&again).contains("overwritten"));
}

#[test]
fn ctrl_c_stops_smoothly_and_twice_falls_silent() {
    let dir = folder_with_limits();
    let pc = address();
    let scan = lead(dir.path(), &pc, &[]);
    let robot = guided(dir.path(), &pc, &[]);
    thread::sleep(Duration::from_millis(1500));
    interrupt(&scan);
    let output = scan.wait_with_output().unwrap();
    assert_eq!(code(&output), 1);
    assert!(words(&output).contains("stopped by the operator"), "{}", words(&output));
    drop(robot);

    fs::rename(dir.path().join("scan"), dir.path().join("first")).unwrap();
    let pc = address();
    let scan = lead(dir.path(), &pc, &[]);
    let robot = guided(dir.path(), &pc, &[]);
    thread::sleep(Duration::from_millis(1500));
    let start = Instant::now();
    interrupt(&scan);
    thread::sleep(Duration::from_millis(50));
    interrupt(&scan);
    let output = scan.wait_with_output().unwrap();
    assert_eq!(code(&output), 1);
    assert!(start.elapsed() < Duration::from_secs(3), "it does not hold for 3.5 s");
    // The controller notices by its timeout.
    drop(robot);
}

#[test]
fn faults_of_the_robot_end_the_scan_with_their_name() {
    for (event, sentence) in [("2:emergency-stop", "left guidance"), ("2:collision", "collision")] {
        let dir = folder_with_limits();
        let pc = address();
        let scan = lead(dir.path(), &pc, &[]);
        let robot = guided(dir.path(), &pc, &["--event", event]);
        let output = scan.wait_with_output().unwrap();
        assert_eq!(code(&output), 1, "{event}");
        assert!(words(&output).contains(sentence), "{event}: {}", words(&output));
        drop(robot);
    }
}

#[test]
fn a_robot_elsewhere_is_not_led() {
    let dir = folder_with_limits();
    let moved = fs::read_to_string(dir.path().join("path.csv")).unwrap().replace(",600,", ",620,");
    fs::create_dir(dir.path().join("elsewhere")).unwrap();
    fs::write(dir.path().join("elsewhere/path.csv"), moved).unwrap();
    let pc = address();
    let scan = lead(dir.path(), &pc, &[]);
    let robot = guided(&dir.path().join("elsewhere"), &pc, &[]);
    let output = scan.wait_with_output().unwrap();
    assert_eq!(code(&output), 1);
    assert!(words(&output).contains("20.0 mm"), "{}", words(&output));
    drop(robot);
}

#[test]
fn ctrl_c_ends_a_recording_of_pictures_that_is_behind_within_a_second_and_says_what_is_kept() {
    let dir = tempfile::tempdir().unwrap();
    let simulate = "simulate --preset good --duration-s 4 --images --out scan";
    assert_eq!(code(&trueline(dir.path(), &simulate.split(' ').collect::<Vec<_>>())), 0);
    // All pictures are due within 0.2 s: nobody finds the seam in so many so quickly.
    let index = dir.path().join("scan/images/index.csv");
    let quick = |line: &str| match line.split_once(',') {
        Some((time_s, rest)) if time_s != "time_s" => {
            format!("{:.6},{rest}\n", time_s.parse::<f64>().unwrap() / 20.0)
        }
        _ => format!("{line}\n"),
    };
    let text: String = fs::read_to_string(&index).unwrap().lines().map(quick).collect();
    let all = text.lines().count() - 1;
    fs::write(&index, text).unwrap();

    let pc = address();
    let line = format!("record --bind {pc} --replay scan --sensor scan/sensor.toml --out rec");
    let record = start(dir.path(), &line.split(' ').collect::<Vec<_>>());
    let robot = Robot(start(dir.path(), &["robot-sim", "--pc", &pc, "--for-s", "20"]));
    let file = dir.path().join("rec/recording.mcap");
    let deadline = Instant::now() + Duration::from_secs(20);
    while fs::metadata(&file).map_or(0, |file| file.len()) < 10_000 && Instant::now() < deadline {
        thread::sleep(Duration::from_millis(20));
    }
    thread::sleep(Duration::from_millis(300));
    let stopped = Instant::now();
    interrupt(&record);
    let output = record.wait_with_output().unwrap();
    let took = stopped.elapsed();
    drop(robot);
    let said = words(&output);
    assert!(took < Duration::from_secs(1), "{took:?}: {said}");
    let kept = said
        .split("camera: ")
        .nth(1)
        .and_then(|rest| rest.split(' ').next())
        .unwrap_or_else(|| panic!("{said}"));
    let kept: usize = kept.parse().unwrap();
    assert!(0 < kept && kept < all, "it was not behind: {kept} of {all} pictures; {said}");
    assert!(said.contains("written to rec/recording.mcap"), "{said}");
}

#[test]
fn a_joint_is_not_looked_for_in_pictures_that_are_still_to_come() {
    let dir = tempfile::tempdir().unwrap();
    let refused = trueline(dir.path(), &["record", "--joint", "auto", "--out", "rec"]);
    assert_eq!(code(&refused), 2);
    assert!(words(&refused).contains("invalid value 'auto' for '--joint"), "{}", words(&refused));
    let help = trueline(dir.path(), &["record", "--help"]);
    let help = String::from_utf8(help.stdout).unwrap();
    let joint = help.split("--joint").nth(1).unwrap().split("--want").next().unwrap();
    assert!(joint.contains("live estimate alone") && joint.contains("[default: fillet; with"), "{joint}");
    assert!(!dir.path().join("rec").exists());
}

#[test]
fn recordings_survive_a_restart_junk_and_kill_9() {
    let dir = tempfile::tempdir().unwrap();
    let pc = address();
    let mut record = start(dir.path(), &["record", "--bind", &pc, "--out", "rec"]);
    thread::sleep(Duration::from_millis(300));
    let junk = UdpSocket::bind("127.0.0.1:0").unwrap();
    let robot =
        Robot(start(dir.path(), &["robot-sim", "--pc", &pc, "--for-s", "3", "--event", "1.5:restart"]));
    for k in 0..40 {
        thread::sleep(Duration::from_millis(50));
        let _ = junk.send_to(&vec![0xff; k * 60], &pc);
    }
    thread::sleep(Duration::from_millis(700));
    record.kill().unwrap();
    record.wait().unwrap();
    drop(robot);
    let size = fs::metadata(dir.path().join("rec/recording.mcap")).unwrap().len();
    assert!(size > 50_000, "{size} bytes");
}

#[test]
fn rapid_modules_are_written_once_and_say_what_nobody_tried() {
    let dir = tempfile::tempdir().unwrap();
    write_path(dir.path());
    for mode in ["stream", "guidance"] {
        let arguments = [
            "robot-program",
            "abb",
            "path.csv",
            "--mode",
            mode,
            "--pc",
            "192.168.125.10:6510",
            "--out",
            mode,
            "--tool",
            "tCam",
        ];
        let written = trueline(dir.path(), &arguments);
        assert_eq!(code(&written), 0, "{}", words(&written));
        let text = fs::read_to_string(dir.path().join(mode).join("LineScan.mod")).unwrap();
        assert!(text.contains("NOT TRIED") && text.contains("tCam") && text.contains("192.168.125.10"));
        assert_eq!(code(&trueline(dir.path(), &arguments)), 2, "never overwritten");
    }
}
