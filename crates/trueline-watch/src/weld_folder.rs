//! A folder that fills with welds.
//!
//! Whoever fills it may take its time: a weld is taken when its files have not changed between two looks and for a moment
//! before, so that no half of one is read.

use std::collections::BTreeSet;
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

/// Files that have not changed for so long are finished.
const SETTLED: Duration = Duration::from_secs(2);

/// A folder and what has been taken from it.
#[derive(Debug)]
pub struct WeldFolder {
    folder: PathBuf,
    taken: BTreeSet<PathBuf>,
}

impl WeldFolder {
    /// Nothing has been taken yet.
    #[must_use]
    pub fn of(folder: &Path) -> Self {
        Self { folder: folder.to_owned(), taken: BTreeSet::new() }
    }

    /// Welds that are finished and have not been taken, in the order of their names.
    ///
    /// # Errors
    /// A folder that cannot be read.
    pub fn next_ones(&mut self) -> io::Result<Vec<PathBuf>> {
        let mut found = Vec::new();
        for entry in std::fs::read_dir(&self.folder)? {
            let path = entry?.path();
            if is_weld(&path) && !self.taken.contains(&path) && is_settled(&path) {
                found.push(path);
            }
        }
        found.sort();
        self.taken.extend(found.iter().cloned());
        Ok(found)
    }
}

/// A dataset folder, a bag, or a recording.
fn is_weld(path: &Path) -> bool {
    let is_recording = path.is_file() && path.extension().is_some_and(|end| end == "mcap");
    let holds = |name: &str| path.join(name).exists();
    is_recording
        || (holds("sensor.toml") && holds("robot.csv"))
        || holds("recording.mcap")
        || holds("metadata.yaml")
}

fn is_settled(path: &Path) -> bool {
    let quiet = |path: &Path| {
        let changed = path.metadata().and_then(|meta| meta.modified());
        changed.is_ok_and(|at| SystemTime::now().duration_since(at).is_ok_and(|age| age >= SETTLED))
    };
    if path.is_file() {
        return quiet(path);
    }
    let Ok(entries) = std::fs::read_dir(path) else { return false };
    entries.flatten().all(|entry| quiet(&entry.path()))
}
