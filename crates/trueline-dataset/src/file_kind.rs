//! Kind of a file by its content, for a user who named it in place of another one.

use std::fmt;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Bytes that are checked.
const LOOKED_AT: u64 = 4096;
/// Columns of a table that are named.
const NAMED_COLUMNS: usize = 4;

/// Kind of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FileKind {
    /// A folder with the files of a scan.
    Dataset,
    /// Another folder.
    Folder,
    /// A result of `calibrate --json`.
    Result,
    /// Other JSON.
    Json,
    /// A sensor.toml.
    Sensor,
    /// A guess or a truth: time offset, hand-eye, lines.
    Guess,
    /// A cell that a scan is planned for.
    Cell,
    /// A table, with the first of its columns.
    Table(String),
    /// An SQLite data base: a state of `watch` or a rosbag2.
    Database,
    /// A recording in MCAP.
    Mcap,
    /// A picture.
    Picture,
    /// Parquet.
    Parquet,
}

/// How a file is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// Not a file.
    Folder,
    /// JSON.
    Json,
    /// TOML.
    Toml,
    /// Lines of columns.
    Table,
    /// Anything that is not text.
    Binary,
}

/// Keys that only one kind of TOML has.
const SENSOR_KEYS: [&str; 4] = ["kind", "camera", "laser_plane", "profiler"];
const GUESS_KEYS: [&str; 3] = ["time_offset_s", "tool_from_camera", "lines"];
const CELL_KEYS: [&str; 4] = ["guess_error", "limits", "attitude", "seam"];
/// The one of them that a sensor's file may have too.
const OF_BOTH: &str = "seam";

/// First bytes of files that are not text.
const MAGIC: [(&[u8], FileKind); 7] = [
    (b"SQLite format 3\0", FileKind::Database),
    (b"\x89MCAP0", FileKind::Mcap),
    (b"\x89PNG", FileKind::Picture),
    (b"\xff\xd8\xff", FileKind::Picture),
    (b"II*\0", FileKind::Picture),
    (b"MM\0*", FileKind::Picture),
    (b"PAR1", FileKind::Parquet),
];

impl FileKind {
    /// The kind; `None` if it is not recognised, or nothing is there.
    #[must_use]
    pub fn of(path: &Path) -> Option<Self> {
        if path.is_dir() {
            let is_dataset = ["sensor.toml", "robot.csv"].iter().any(|name| path.join(name).is_file());
            return Some(if is_dataset { Self::Dataset } else { Self::Folder });
        }
        if !path.is_file() {
            return None;
        }
        let mut bytes = Vec::new();
        File::open(path).ok()?.take(LOOKED_AT).read_to_end(&mut bytes).ok()?;
        if let Some((_, kind)) = MAGIC.iter().find(|(magic, _)| bytes.starts_with(magic)) {
            return Some(kind.clone());
        }
        // The last character may be cut in two.
        Self::of_text(&String::from_utf8_lossy(&bytes))
    }

    fn of_text(text: &str) -> Option<Self> {
        let text = text.trim_start_matches('\u{feff}').trim_start();
        if text.starts_with('{') {
            let is_result = text.contains("\"schema_version\"");
            return Some(if is_result { Self::Result } else { Self::Json });
        }
        let lines = text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
        let keys: Vec<&str> = lines.clone().filter_map(key).collect();
        let has = |known: &[&str]| keys.iter().any(|key| known.contains(key));
        let of_cell = CELL_KEYS.iter().any(|key| *key != OF_BOTH && keys.contains(key));
        if !of_cell && has(&SENSOR_KEYS) {
            return Some(Self::Sensor);
        }
        if has(&CELL_KEYS) {
            return Some(Self::Cell);
        }
        if has(&GUESS_KEYS) {
            return Some(Self::Guess);
        }
        let columns: Vec<&str> = lines.clone().next()?.split([',', ';', '\t']).map(str::trim).collect();
        let more = if columns.len() > NAMED_COLUMNS { ", …" } else { "" };
        let named = columns.iter().take(NAMED_COLUMNS).copied().collect::<Vec<_>>().join(", ");
        (columns.len() > 1 && keys.is_empty()).then(|| Self::Table(format!("{named}{more}")))
    }

    /// How it is written.
    #[must_use]
    pub fn form(&self) -> Form {
        match self {
            Self::Dataset | Self::Folder => Form::Folder,
            Self::Result | Self::Json => Form::Json,
            Self::Sensor | Self::Guess | Self::Cell => Form::Toml,
            Self::Table(_) => Form::Table,
            Self::Database | Self::Mcap | Self::Picture | Self::Parquet => Form::Binary,
        }
    }

    /// Whether a key distinguishes this kind of TOML from others.
    #[must_use]
    pub fn has_key(&self, key: &str) -> bool {
        match self {
            Self::Sensor => SENSOR_KEYS.contains(&key),
            Self::Guess => GUESS_KEYS.contains(&key),
            Self::Cell => CELL_KEYS.contains(&key),
            _ => false,
        }
    }
}

/// The key or the table that a line of TOML begins.
fn key(line: &str) -> Option<&str> {
    if let Some(table) = line.strip_prefix('[') {
        return table.trim_start_matches('[').split([']', '.']).next().map(str::trim);
    }
    let (key, _) = line.split_once('=')?;
    let key = key.trim();
    key.chars().all(|c| c.is_ascii_alphanumeric() || c == '_').then_some(key)
}

impl fmt::Display for FileKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Dataset => f.write_str("a dataset folder"),
            Self::Folder => f.write_str("a folder"),
            Self::Result => f.write_str("a result of trueline"),
            Self::Json => f.write_str("a JSON file"),
            Self::Sensor => f.write_str("a sensor's file"),
            Self::Guess => f.write_str("a guess or truth of time offset and hand-eye"),
            Self::Cell => f.write_str("a cell that scans are planned for"),
            Self::Table(columns) => write!(f, "a table with the columns {columns}"),
            Self::Database => f.write_str("an SQLite data base"),
            Self::Mcap => f.write_str("a recording in MCAP"),
            Self::Picture => f.write_str("a picture"),
            Self::Parquet => f.write_str("a Parquet file"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_told_by_what_they_begin_with() {
        let of = |text: &str| FileKind::of_text(text);
        assert_eq!(of("{\n \"schema_version\": 3"), Some(FileKind::Result));
        assert_eq!(of("{\"a\": 1}"), Some(FileKind::Json));
        assert_eq!(of("kind = \"profiler\"\n"), Some(FileKind::Sensor));
        assert_eq!(of("# comment\n[camera]\nwidth = 3"), Some(FileKind::Sensor));
        assert_eq!(of("time_offset_s = 0.01\n[[lines]]\n"), Some(FileKind::Guess));
        assert_eq!(of("[sensor]\nkind = \"profiler\"\n[limits]\n"), Some(FileKind::Cell));
        let robot = of("time_s,x_mm,y_mm,z_mm,qw\n1,2,3,4,5\n");
        assert_eq!(robot, Some(FileKind::Table("time_s, x_mm, y_mm, z_mm, …".to_owned())));
        assert_eq!(of("just words"), None);
        assert_eq!(of(""), None);
    }
}
