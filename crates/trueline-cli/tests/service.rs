//! Services: what systemd is told, and the unit files.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]
#![cfg(target_os = "linux")]

#[path = "it/common/mod.rs"]
mod common;

use common::{address, command};
use std::fs;
use std::os::unix::net::UnixDatagram;
use std::path::{Path, PathBuf};
use std::process::{Child, Command};
use std::time::Duration;

const LONG: Duration = Duration::from_secs(30);

/// Ends what a failed test leaves.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ended_already = self.0.kill();
        let _code = self.0.wait();
    }
}

/// A service's reports to systemd, from its start until SIGTERM ends it after its second sign of life.
fn told(arguments: &[&str]) -> Vec<String> {
    let place = tempfile::tempdir().unwrap();
    let socket = place.path().join("notify");
    let ear = UnixDatagram::bind(&socket).unwrap();
    ear.set_read_timeout(Some(LONG)).unwrap();
    let hear = || {
        let mut bytes = [0; 512];
        let length = ear.recv(&mut bytes).unwrap();
        String::from_utf8(bytes[..length].to_vec()).unwrap()
    };
    let mut service = command(place.path(), arguments);
    service.env("NOTIFY_SOCKET", &socket).env("WATCHDOG_USEC", "200000").env_remove("WATCHDOG_PID");
    let mut running = Running(service.spawn().unwrap());
    let mut told = vec![hear(), hear(), hear()];
    let id = running.0.id().to_string();
    assert!(Command::new("kill").args(["-TERM", &id]).status().unwrap().success());
    running.0.wait().unwrap();
    ear.set_nonblocking(true).unwrap();
    let mut bytes = [0; 512];
    while let Ok(length) = ear.recv(&mut bytes) {
        told.push(String::from_utf8(bytes[..length].to_vec()).unwrap());
    }
    told
}

#[test]
fn a_watch_and_a_record_are_ready_stay_alive_and_stop() {
    let bind = address();
    for (arguments, does) in [
        (&["watch", "--state", "cell.sqlite", "--serve", "127.0.0.1:0"][..], "serves a page"),
        (&["record", "--bind", &bind, "--out", "recording", "--quiet"], "records a robot"),
    ] {
        let told = told(arguments);
        assert_eq!(told[0], format!("READY=1\nSTATUS={does}\n"));
        let (last, signs) = told[1..].split_last().unwrap();
        assert!(signs.len() >= 2 && signs.iter().all(|sign| sign == "WATCHDOG=1\n"), "{told:?}");
        assert_eq!(last, "STOPPING=1\n");
    }
}

fn units() -> Vec<(PathBuf, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    if !root.join("packaging").exists() {
        // A published crate comes without them.
        assert!(!root.join("docs").exists());
        return Vec::new();
    }
    let files = fs::read_dir(root.join("packaging/systemd")).unwrap().map(|entry| entry.unwrap().path());
    files.map(|file| (file.clone(), fs::read_to_string(file).unwrap())).collect()
}

#[test]
fn the_commands_of_the_unit_files_are_commands() {
    let mut commands = Vec::new();
    for (file, text) in units() {
        assert!(text.contains("Type=notify\n") && text.contains("WatchdogSec="), "{}", file.display());
        let line = text.lines().find(|line| line.starts_with("ExecStart=")).unwrap();
        let (_, words) = line.split_once("trueline ").unwrap();
        // A shell's substitution is one word.
        let words = words.trim_end_matches('\'').replace("$(date -u +%%Y%%m%%dT%%H%%M%%SZ)", "NOW");
        let words = std::iter::once("trueline").chain(words.split_whitespace());
        let parsed = trueline_cli::command().try_get_matches_from(words);
        let parsed = parsed.unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        commands.push(parsed.subcommand_name().unwrap().to_owned());
    }
    commands.sort();
    assert!(commands.is_empty() || commands == ["record", "watch"], "{commands:?}");
}
