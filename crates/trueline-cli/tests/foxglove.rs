//! The live view of whole programs, seen by a viewer not written here.
//!
//! Opt-in: `TRUELINE_NODE_MODULES` names a folder `node_modules` with `@foxglove/ws-protocol`, `ws` and `protobufjs`
//! (`npm install @foxglove/ws-protocol@0.8.0 ws@8 protobufjs@7`), and `node` is in the path. `interop/foxglove.sh` does both.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "it/common/mod.rs"]
mod common;

use common::{command, trueline, words};
use serde_json::Value;
use std::fs;
use std::io::{BufRead, BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// Where the viewer's libraries are, or the word that the test is skipped.
fn node_modules() -> Option<PathBuf> {
    let modules = std::env::var_os("TRUELINE_NODE_MODULES").map(PathBuf::from);
    if modules.is_none() {
        let mut stderr = std::io::stderr();
        writeln!(stderr, "SKIPPED: foxglove: TRUELINE_NODE_MODULES names no viewer").unwrap();
    }
    modules
}

/// A program that ends with the test.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Starts a program with a live view; where that is.
fn started(folder: &Path, arguments: &[&str]) -> (Running, String) {
    let mut child = command(folder, arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
    let url = lines.by_ref().map(Result::unwrap).find_map(|line| {
        let (_, rest) = line.split_once("live view: ")?;
        Some(rest.split(' ').next()?.to_owned())
    });
    // What it says later must find a reader.
    std::thread::spawn(move || lines.for_each(drop));
    (Running(child), url.expect("it says where"))
}

/// What the viewer saw: the first message of each topic.
fn seen(modules: &Path, url: &str, topics: &[&str]) -> Vec<Value> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/interop/foxglove_client.mjs");
    let output =
        Command::new("node").arg(script).arg(modules).arg(url).args(topics).output().expect("node is there");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout)
        .unwrap()
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}

fn of<'a>(seen: &'a [Value], topic: &str) -> &'a Value {
    &seen.iter().find(|one| one["topic"] == topic).expect("it was asked for")["message"]
}

#[test]
fn a_foreign_viewer_sees_a_robot_that_is_recorded() {
    let Some(modules) = node_modules() else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let made = trueline(path, &["simulate", "--quiet", "--seed", "3", "--out", "cell"]);
    assert!(made.status.success(), "{}", words(&made));
    let result = trueline(path, &["calibrate", "cell", "--quiet", "--json", "result.json"]);
    assert!(result.status.success(), "{}", words(&result));
    let bind = common::address();
    let (_record, url) = started(
        path,
        &[
            "record",
            "--bind",
            &bind,
            "--out",
            "scan",
            "--sensor",
            "cell/sensor.toml",
            "--calibration",
            "result.json",
            "--foxglove",
            "0",
            "--for-s",
            "120",
        ],
    );
    let robot = ["robot-sim", "--pc", &bind, "--path", "cell/robot.csv", "--for-s", "120"];
    let _robot = Running(command(path, &robot).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap());
    let seen = seen(&modules, &url, &["/tf", "/estimate", "/robot/egm", "/clock"]);
    let tf = of(&seen, "/tf");
    assert_eq!(tf["parent_frame_id"].as_str(), Some("base"), "{tf}");
    assert!(tf["translation"]["x"].is_number() && tf["rotation"]["w"].is_number(), "{tf}");
    let estimate = of(&seen, "/estimate");
    assert!(estimate["time_offset_ms"].is_null() && estimate["poses"].is_u64(), "{estimate}");
    assert!(of(&seen, "/robot/egm")["robot"]["header"]["seqno"].is_u64());
}

#[test]
fn a_foreign_viewer_sees_what_welds_show() {
    let Some(modules) = node_modules() else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let made = trueline(path, &["simulate", "--quiet", "--seed", "3", "--out", "cell"]);
    assert!(made.status.success(), "{}", words(&made));
    let result = trueline(path, &["calibrate", "cell", "--quiet", "--json", "result.json"]);
    assert!(result.status.success(), "{}", words(&result));
    fs::create_dir(path.join("welds")).unwrap();
    let (_watch, url) = started(
        path,
        &[
            "watch",
            "--state",
            "cell.sqlite",
            "--calibration",
            "result.json",
            "--folder",
            "welds",
            "--foxglove",
            "0",
        ],
    );
    // A weld that appears before the viewer has subscribed is not seen, so they keep appearing.
    let appearing = path.to_owned();
    std::thread::spawn(move || {
        for k in 0..200 {
            let (from, to) = (appearing.join("cell"), appearing.join(format!("welds/weld-{k:03}")));
            if fs::create_dir(&to).is_err() {
                return;
            }
            for file in ["sensor.toml", "features.csv", "robot.csv"] {
                let _gone_with_the_test = fs::copy(from.join(file), to.join(file));
            }
            std::thread::sleep(std::time::Duration::from_millis(700));
        }
    });
    let seen = seen(&modules, &url, &["/weld", "/log"]);
    let weld = of(&seen, "/weld");
    assert!(weld["weld"].as_str().is_some_and(|name| name.contains("weld-")), "{weld}");
    assert!(weld["alarm"].is_null(), "{weld}");
    assert_eq!(of(&seen, "/log")["name"].as_str(), Some("trueline"));
}
