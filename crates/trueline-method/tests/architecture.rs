//! The dependency edges of ARCHITECTURE.md: an invariant that is not a test is a wish.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use std::fs;
use std::path::Path;

const ALLOWED: [(&str, &[&str]); 21] = [
    ("trueline-geometry", &[]),
    ("trueline-lsq", &[]),
    ("trueline-model", &["trueline-geometry"]),
    ("trueline-dataset", &["trueline-geometry", "trueline-model"]),
    ("trueline-method", &["trueline-dataset", "trueline-geometry", "trueline-lsq", "trueline-model"]),
    (
        "trueline-fuzz",
        &[
            "trueline-camera",
            "trueline-dataset",
            "trueline-geometry",
            "trueline-live",
            "trueline-mcap",
            "trueline-plan",
            "trueline-watch",
        ],
    ),
    (
        "trueline-experiments",
        &[
            "trueline-method",
            "trueline-dataset",
            "trueline-geometry",
            "trueline-lsq",
            "trueline-model",
            "trueline-plan",
            "trueline-sensor",
            "trueline-sim",
        ],
    ),
    ("trueline-camera", &["trueline-dataset", "trueline-live"]),
    (
        "trueline-cell",
        &[
            "trueline-camera",
            "trueline-dataset",
            "trueline-geometry",
            "trueline-live",
            "trueline-mcap",
            "trueline-method",
            "trueline-rt",
            "trueline-sim",
            "trueline-vision",
        ],
    ),
    ("trueline-live", &["trueline-dataset", "trueline-geometry"]),
    ("trueline-mcap", &["trueline-dataset", "trueline-geometry"]),
    (
        "trueline-plan",
        &["trueline-method", "trueline-dataset", "trueline-geometry", "trueline-lsq", "trueline-model"],
    ),
    ("trueline-rt", &["trueline-geometry", "trueline-model"]),
    ("trueline-rt-c", &["trueline-geometry", "trueline-model", "trueline-rt"]),
    (
        "trueline-sensor",
        &[
            "trueline-dataset",
            "trueline-geometry",
            "trueline-lsq",
            "trueline-method",
            "trueline-model",
            "trueline-vision",
        ],
    ),
    ("trueline-sim", &["trueline-dataset", "trueline-geometry", "trueline-model"]),
    ("trueline-vision", &["trueline-dataset", "trueline-geometry", "trueline-model"]),
    (
        "trueline-watch",
        &[
            "trueline-dataset",
            "trueline-geometry",
            "trueline-lsq",
            "trueline-method",
            "trueline-model",
            "trueline-report",
        ],
    ),
    (
        "trueline-report",
        &[
            "trueline-method",
            "trueline-dataset",
            "trueline-experiments",
            "trueline-geometry",
            "trueline-model",
            "trueline-plan",
            "trueline-sensor",
        ],
    ),
    (
        "trueline",
        &[
            "trueline-cell",
            "trueline-dataset",
            "trueline-geometry",
            "trueline-mcap",
            "trueline-method",
            "trueline-model",
            "trueline-report",
            "trueline-rt",
            "trueline-vision",
        ],
    ),
    (
        "trueline-cli",
        &[
            "trueline",
            "trueline-method",
            "trueline-camera",
            "trueline-cell",
            "trueline-dataset",
            "trueline-experiments",
            "trueline-geometry",
            "trueline-live",
            "trueline-lsq",
            "trueline-mcap",
            "trueline-plan",
            "trueline-report",
            "trueline-sensor",
            "trueline-sim",
            "trueline-vision",
            "trueline-watch",
        ],
    ),
];

fn crates() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

/// Crates of the workspace that a manifest's `[dependencies]` name; development dependencies are free.
fn dependencies(name: &str) -> Vec<String> {
    let manifest = fs::read_to_string(crates().join(name).join("Cargo.toml")).unwrap();
    let table = manifest.split("\n[dependencies]").nth(1).unwrap().split("\n[").next().unwrap().to_owned();
    let names = table.lines().filter_map(|line| line.split(['.', ' ', '=']).next());
    names.filter(|name| name.starts_with("trueline")).map(str::to_owned).collect()
}

#[test]
fn crates_depend_only_on_what_is_allowed() {
    let mut found: Vec<String> = fs::read_dir(crates())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    found.sort();
    let mut listed: Vec<&str> = ALLOWED.iter().map(|(name, _)| *name).collect();
    listed.sort_unstable();
    assert_eq!(found, listed, "a crate is missing in this list, and in ARCHITECTURE.md");
    for (name, allowed) in ALLOWED {
        for dependency in dependencies(name) {
            assert!(allowed.contains(&dependency.as_str()), "{name} must not depend on {dependency}");
        }
    }
}

#[test]
fn nothing_depends_on_the_studies() {
    for (name, _) in ALLOWED {
        let manifest = fs::read_to_string(crates().join(name).join("Cargo.toml")).unwrap();
        assert!(!manifest.contains("trueline-studies"), "{name} must not depend on the studies");
    }
}

#[test]
fn files_hold_one_concept() {
    for folder in ALLOWED.iter().map(|(name, _)| *name).chain(["../studies"]) {
        let mut folders = vec![crates().join(folder).join("src")];
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    folders.push(path);
                } else {
                    let lines = fs::read_to_string(&path).unwrap().lines().count();
                    assert!(lines <= 450, "{} has {lines} lines: one concept a file", path.display());
                }
            }
        }
    }
}

#[test]
fn the_commands_hold_no_mathematics() {
    // The options fill in settings, and so name types of libraries that the commands themselves must not use.
    let mut folders = vec![crates().join("trueline-cli/src")];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.extend((!path.ends_with("args")).then_some(path));
                continue;
            }
            let text = fs::read_to_string(&path).unwrap();
            for mathematics in ["nalgebra::", "trueline_lsq::", "trueline_model::"] {
                assert!(
                    !text.contains(mathematics),
                    "{}: an estimate belongs into a library",
                    path.display()
                );
            }
        }
    }
}
