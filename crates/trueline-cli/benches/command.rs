//! A user's waiting time: reading the files, and the complete command with JSON and report.
//!
//! `cargo bench -p trueline-cli`. `TRUELINE_BENCH_DATASET` names a dataset folder that is measured as well.
#![allow(missing_docs, clippy::unwrap_used, clippy::panic, reason = "a benchmark fails by panicking")]

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use std::path::{Path, PathBuf};
use std::process::Command;

fn trueline(arguments: &[&str]) {
    let output = Command::new(env!("CARGO_BIN_EXE_trueline")).args(arguments).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

fn datasets(scratch: &Path) -> Vec<(String, PathBuf)> {
    let simulated = ["quick", "paper", "two-lines"].map(|preset| {
        let folder = scratch.join(preset);
        trueline(&["simulate", "--preset", preset, "--out", folder.to_str().unwrap(), "--quiet"]);
        (preset.to_owned(), folder)
    });
    let given =
        std::env::var("TRUELINE_BENCH_DATASET").ok().map(|folder| ("given".to_owned(), folder.into()));
    simulated.into_iter().chain(given).collect()
}

fn commands(c: &mut Criterion) {
    let scratch = tempfile::tempdir().unwrap();
    let report = scratch.path().join("report.html");
    let result = scratch.path().join("result.json");
    for (name, folder) in datasets(scratch.path()) {
        let mut group = c.benchmark_group("files");
        group.bench_with_input(BenchmarkId::new("read", &name), &folder, |b, folder| {
            b.iter(|| trueline_dataset::folder::read(folder).unwrap());
        });
        group.sample_size(10);
        let words = ["calibrate", folder.to_str().unwrap(), "--quiet", "--json", result.to_str().unwrap()];
        group.bench_function(BenchmarkId::new("calibrate, JSON, report", &name), |b| {
            b.iter(|| trueline(&[&words[..], &["--report", report.to_str().unwrap()]].concat()));
        });
        group.finish();
    }
}

criterion_group!(benches, commands);
criterion_main!(benches);
