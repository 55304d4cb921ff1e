//! A program that is killed loses a moment, and nothing that was before it.
#![cfg(unix)]

use crate::common;

use common::{about, messages, read_items, robot};
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;
use trueline_mcap::{Damage, Entry, Recorder};

const CHILD: &str = "TRUELINE_MCAP_TEST_RECORDS_TO";

/// The program that is killed: it does nothing unless it is started by the test below.
#[test]
fn child_that_records_until_it_is_killed() {
    let Some(file) = std::env::var_os(CHILD) else { return };
    let recorder = Recorder::create(Path::new(&file), &about()).unwrap();
    let mut out = std::io::stdout();
    for k in 0.. {
        assert!(recorder.handle().offer(Entry::Robot(robot(k))));
        writeln!(out, "offered {k}").unwrap();
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn a_killed_program_leaves_a_recording_that_can_be_read() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.mcap");
    let mut child = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "killed::child_that_records_until_it_is_killed", "--nocapture"])
        .env(CHILD, &file)
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines().map_while(Result::ok);
    let offered = |line: String| line.strip_prefix("offered ").and_then(|k| k.parse::<u32>().ok());
    // At least 1.2 s: several times the time after which entries are handed over.
    lines.by_ref().filter_map(offered).find(|k| *k >= 1200).unwrap();
    child.kill().unwrap();
    child.wait().unwrap();
    let last = lines.filter_map(offered).last().unwrap_or(1200);

    let (items, damages) = read_items(&std::fs::read(&file).unwrap());
    assert!(matches!(damages.as_slice(), [Damage::Truncated { .. }]), "{damages:?}");
    let poses = messages(&items, "/tf");
    for (k, pose) in (0..).zip(&poses) {
        assert_eq!(pose.1, robot(k).steady_ns as u64, "nothing is missing before the end");
    }
    // A second of a thousand entries, as promised; it is a quarter of one where the machine is not busy.
    let lost = last + 1 - poses.len() as u32;
    assert!(lost <= 1000, "{lost} of {last} entries are lost");
}
