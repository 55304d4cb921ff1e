//! Present content of a cell's folder. It is read again for each request, and never written.

use std::fs::{self, Metadata};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};
use trueline_dataset::result_file::ResultFile;

/// Largest number of entries read of a folder: a cell has fewer.
const MOST_ENTRIES: usize = 2000;
/// A recording that was written to this recently is under way.
const UNDER_WAY: Duration = Duration::from_secs(5);
/// Content of a recorded folder; the first one present counts.
const RECORDED: [&str; 3] = ["recording.mcap", "robot.csv", "features.csv"];

/// A recording.
#[derive(Clone, Debug)]
pub(super) struct RecordingFile {
    /// The folder, or the file, within the cell's.
    pub name: String,
    /// Size of the recording, bytes.
    pub bytes: u64,
    /// How long ago it was written to; `None` where the system does not say.
    pub written_ago: Option<Duration>,
}

impl RecordingFile {
    /// Whether it is being written.
    pub(super) fn is_under_way(&self) -> bool {
        self.written_ago.is_some_and(|ago| ago < UNDER_WAY)
    }
}

/// A result, or why it cannot be read.
#[derive(Debug)]
pub(super) struct Answer {
    /// Its file within the cell's folder.
    pub name: String,
    /// Its content.
    pub result: Result<ResultFile, String>,
}

/// Everything that matters of a cell's folder.
#[derive(Debug, Default)]
pub(super) struct Contents {
    /// Recordings, the newest first.
    pub recordings: Vec<RecordingFile>,
    /// The newest result.
    pub answer: Option<Answer>,
    /// State files of `watch`.
    pub states: Vec<PathBuf>,
    /// Whether `listen --json link.json` was run.
    pub has_link: bool,
    /// Whether there is a sensor file.
    pub has_sensor: bool,
    /// Whether there is a cell for `plan`.
    pub has_cell: bool,
    /// Whether there is a plan.
    pub has_plan: bool,
}

impl Contents {
    /// The content.
    ///
    /// # Errors
    /// A folder that cannot be read.
    pub(super) fn of(folder: &Path) -> Result<Self, String> {
        let told = |error: &dyn std::fmt::Display| format!("{}: cannot be read: {error}", folder.display());
        let now = SystemTime::now();
        let mut contents = Self {
            has_link: folder.join("link.json").is_file(),
            has_sensor: folder.join("sensor.toml").is_file(),
            has_cell: folder.join("cell.toml").is_file(),
            has_plan: folder.join("plan").join("path.csv").is_file(),
            ..Self::default()
        };
        let mut results: Vec<(SystemTime, PathBuf)> = Vec::new();
        let mut paths: Vec<PathBuf> = Vec::new();
        for entry in fs::read_dir(folder).map_err(|error| told(&error))?.take(MOST_ENTRIES) {
            paths.push(entry.map_err(|error| told(&error))?.path());
        }
        paths.sort();
        for path in paths {
            let Ok(meta) = fs::metadata(&path) else { continue };
            let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
            match ending {
                _ if meta.is_dir() => contents.recordings.extend(recorded_in(&path, now)),
                "mcap" => contents.recordings.extend(recording(&path, &meta, now)),
                "sqlite" => contents.states.push(path),
                "json" if path.file_name().is_some_and(|name| name != "link.json") => {
                    results.push((meta.modified().unwrap_or(SystemTime::UNIX_EPOCH), path));
                }
                _ => {}
            }
        }
        let age = |file: &RecordingFile| file.written_ago.unwrap_or(Duration::MAX);
        contents.recordings.sort_by_key(age);
        results.sort();
        contents.answer = results.iter().rev().find_map(|(_, path)| answer(path));
        Ok(contents)
    }

    /// The recording that a result would be made of: the newest that is finished.
    pub(super) fn finished(&self) -> Option<&RecordingFile> {
        self.recordings.iter().find(|recording| !recording.is_under_way())
    }
}

fn recorded_in(folder: &Path, now: SystemTime) -> Option<RecordingFile> {
    let (_, meta) = RECORDED.iter().find_map(|name| Some((name, fs::metadata(folder.join(name)).ok()?)))?;
    recording(folder, &meta, now)
}

fn recording(path: &Path, meta: &Metadata, now: SystemTime) -> Option<RecordingFile> {
    let written_ago = meta.modified().ok().and_then(|written| now.duration_since(written).ok());
    let name = path.file_name()?.to_string_lossy().into_owned();
    Some(RecordingFile { name, bytes: meta.len(), written_ago })
}

/// A result; `None` of JSON that is something else.
fn answer(path: &Path) -> Option<Answer> {
    let name = path.file_name()?.to_string_lossy().into_owned();
    let text = match fs::read_to_string(path) {
        Ok(text) => text,
        Err(error) => return Some(Answer { name, result: Err(error.to_string()) }),
    };
    if !text.contains("\"tool_from_camera\"") {
        return None;
    }
    Some(Answer { name, result: ResultFile::parse(path, &text).map_err(|error| error.to_string()) })
}
