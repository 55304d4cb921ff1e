//! A folder that fills with welds.
//!
//! The writer may take its time: a weld is read when its files, their sizes and their times have been constant for a
//! moment, by this program's clock alone. Times of files are compared with each other, never with a clock: a copy
//! keeps the original's times, and a file server has a clock of its own. A weld is read again if its files change
//! afterwards.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

/// Files that have not changed for so long are finished.
const SETTLED: Duration = Duration::from_secs(2);

/// A folder and its contents so far.
#[derive(Debug)]
pub struct WeldFolder {
    folder: PathBuf,
    seen: BTreeMap<PathBuf, Seen>,
    settled: Duration,
}

/// State of a weld at the last check.
#[derive(Debug)]
struct Seen {
    files: Vec<File>,
    since: Instant,
    taken: bool,
}

#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
struct File {
    name: PathBuf,
    bytes: u64,
    changed: Option<SystemTime>,
}

/// Result of one look.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Found {
    /// Welds that are finished and have not been taken, in the order of their names.
    pub finished: Vec<PathBuf>,
    /// How many may still be written to.
    pub unfinished: usize,
}

impl WeldFolder {
    /// Nothing has been taken yet.
    #[must_use]
    pub fn of(folder: &Path) -> Self {
        Self { folder: folder.to_owned(), seen: BTreeMap::new(), settled: SETTLED }
    }

    /// Whether the last look found no weld at all.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.seen.is_empty()
    }

    /// Looks at the folder, and takes the welds that are finished.
    ///
    /// # Errors
    /// A folder that cannot be read.
    pub fn look(&mut self) -> io::Result<Found> {
        self.look_at(Instant::now())
    }

    fn look_at(&mut self, now: Instant) -> io::Result<Found> {
        let mut found = Found::default();
        let mut before = std::mem::take(&mut self.seen);
        for entry in std::fs::read_dir(&self.folder)? {
            let path = entry?.path();
            let Some(files) = weld_files(&path) else { continue };
            let mut seen = match before.remove(&path) {
                Some(seen) if seen.files == files => seen,
                _ => Seen { files, since: now, taken: false },
            };
            if !seen.taken {
                seen.taken = now.saturating_duration_since(seen.since) >= self.settled;
                if seen.taken {
                    found.finished.push(path.clone());
                } else {
                    found.unfinished += 1;
                }
            }
            self.seen.insert(path, seen);
        }
        found.finished.sort();
        Ok(found)
    }
}

/// The files of a dataset folder, a bag, or a recording; `None` of anything else, or if they go away meanwhile.
fn weld_files(path: &Path) -> Option<Vec<File>> {
    if path.is_file() {
        let is_recording = path.extension().is_some_and(|end| end == "mcap");
        return if is_recording { Some(vec![file(path)?]) } else { None };
    }
    let holds = |name: &str| path.join(name).exists();
    let is_weld =
        (holds("sensor.toml") && holds("robot.csv")) || holds("recording.mcap") || holds("metadata.yaml");
    if !is_weld {
        return None;
    }
    let mut files = Vec::new();
    for entry in std::fs::read_dir(path).ok()? {
        files.push(file(&entry.ok()?.path())?);
    }
    files.sort();
    Some(files)
}

fn file(path: &Path) -> Option<File> {
    let meta = path.metadata().ok()?;
    Some(File { name: path.to_owned(), bytes: meta.len(), changed: meta.modified().ok() })
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use std::fs;

    struct Copied {
        dir: tempfile::TempDir,
        folder: WeldFolder,
        start: Instant,
    }

    impl Copied {
        fn new() -> Self {
            let dir = tempfile::tempdir().unwrap();
            let folder = WeldFolder::of(dir.path());
            Self { dir, folder, start: Instant::now() }
        }

        /// Writes a file of a weld with a time of its own, as a copy that keeps times does.
        fn write(&self, name: &str, text: &str, changed: SystemTime) {
            let path = self.dir.path().join("weld-1").join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(&path, text).unwrap();
            fs::File::options().write(true).open(&path).unwrap().set_modified(changed).unwrap();
        }

        fn at(&mut self, ms: u64) -> (usize, usize) {
            let found = self.folder.look_at(self.start + Duration::from_millis(ms)).unwrap();
            (found.finished.len(), found.unfinished)
        }
    }

    fn old() -> SystemTime {
        SystemTime::UNIX_EPOCH + Duration::from_secs(1_000_000_000)
    }

    #[test]
    fn a_copy_that_keeps_the_times_of_its_files_is_not_taken_half() {
        let mut copied = Copied::new();
        copied.write("sensor.toml", "kind", old());
        assert_eq!(copied.at(0), (0, 0), "no weld yet");
        copied.write("robot.csv", "half", old());
        assert_eq!(copied.at(500), (0, 1));
        assert_eq!(copied.at(2000), (0, 1));
        copied.write("robot.csv", "half and the rest", old());
        assert_eq!(copied.at(2400), (0, 1), "it grew");
        copied.write("features.csv", "", old());
        assert_eq!(copied.at(4300), (0, 1), "a file more");
        assert_eq!(copied.at(6300), (1, 0));
        assert_eq!(copied.at(9000), (0, 0), "it is taken once");
    }

    #[test]
    fn files_from_a_clock_that_is_ahead_are_taken() {
        let mut copied = Copied::new();
        let tomorrow = SystemTime::now() + Duration::from_secs(86_400);
        copied.write("sensor.toml", "kind", tomorrow);
        copied.write("robot.csv", "rows", tomorrow);
        assert_eq!(copied.at(0), (0, 1));
        assert_eq!(copied.at(2000), (1, 0));
    }

    #[test]
    fn a_weld_that_goes_on_after_a_pause_is_taken_again() {
        let mut copied = Copied::new();
        copied.write("sensor.toml", "kind", old());
        copied.write("robot.csv", "half", old());
        assert_eq!([copied.at(0), copied.at(2000)], [(0, 1), (1, 0)]);
        copied.write("robot.csv", "half and the rest", old());
        assert_eq!([copied.at(3000), copied.at(5000)], [(0, 1), (1, 0)]);
    }
}
