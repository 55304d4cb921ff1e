//! The permanent part of fuzzing: every file of the corpus, complete, truncated anywhere, and with bytes altered.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use trueline_fuzz::TARGETS;

/// Of a long file so many cuts and alterations are tried, spread over it.
const TRIES: usize = 300;
/// This many inputs of targets that take milliseconds (files, databases, paths, sequences).
const TRIES_OF_SLOW: usize = 20;
const SLOW: [&str; 5] = ["gate", "plan", "rosbag", "table_of_program", "watch_state"];

fn corpus() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus")
}

fn files(folder: &Path) -> Vec<PathBuf> {
    fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect()
}

#[test]
fn every_target_has_a_corpus_and_every_corpus_a_target() {
    let folders: BTreeSet<String> =
        files(&corpus()).iter().map(|f| f.file_name().unwrap().to_str().unwrap().to_owned()).collect();
    let targets: BTreeSet<String> = TARGETS.iter().map(|(name, _)| (*name).to_owned()).collect();
    assert_eq!(folders, targets);
    assert!(folders.iter().all(|name| !files(&corpus().join(name)).is_empty()));
}

#[test]
fn every_target_has_its_entry_for_the_fuzzer() {
    let entries = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/fuzz_targets");
    let entries: BTreeSet<String> =
        files(&entries).iter().map(|f| f.file_stem().unwrap().to_str().unwrap().to_owned()).collect();
    let targets: BTreeSet<String> = TARGETS.iter().map(|(name, _)| (*name).to_owned()).collect();
    assert_eq!(entries, targets);
}

#[test]
fn the_corpus_is_read_whole_cut_off_and_altered() {
    for (name, target) in TARGETS {
        for file in files(&corpus().join(name)) {
            let whole = fs::read(&file).unwrap();
            target(&whole);
            let tries = if SLOW.contains(&name) { TRIES_OF_SLOW } else { TRIES };
            let step = whole.len().div_ceil(tries).max(1);
            for at in (0..whole.len()).step_by(step) {
                target(&whole[..at]);
                for byte in [0x00, 0xff, b'9', b'"'] {
                    let mut altered = whole.clone();
                    altered[at] = byte;
                    target(&altered);
                }
            }
        }
    }
}
