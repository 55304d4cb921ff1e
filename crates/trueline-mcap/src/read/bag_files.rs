//! The files of a recording, and their kinds.

use crate::import_error::ImportError;
use crate::read::damage::{Damage, DamagedFile};
use std::fs;
use std::io::{self, Read};
use std::path::{Component, Path, PathBuf};
use trueline_dataset::source_file;

/// How a file holds messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Storage {
    /// MCAP.
    Mcap,
    /// SQLite with the tables of rosbag2.
    #[cfg(feature = "rosbag2")]
    Sqlite,
}

/// One file of a recording.
pub(super) struct Part {
    /// The file under the user's name.
    pub name: PathBuf,
    /// The file with its messages: beside it, if it is compressed as a whole.
    pub path: PathBuf,
    pub storage: Storage,
    /// Removes the decompressed file.
    #[cfg(feature = "rosbag2")]
    _decompressed: Option<tempfile::TempPath>,
}

const SQLITE: &[u8] = b"SQLite format 3\0";
pub(crate) const ZSTD: &[u8] = &[0x28, 0xb5, 0x2f, 0xfd];
const ROS1: &[u8] = b"#ROSBAG V";

type Parts = (Vec<Part>, Vec<DamagedFile>);

/// The files of a recording, in their order.
pub(super) fn parts(path: &Path) -> Result<Parts, ImportError> {
    let meta = fs::metadata(path).map_err(|error| ImportError::io(path, &error))?;
    let (files, mut damages) = if meta.is_dir() { in_folder(path)? } else { (vec![path.to_owned()], vec![]) };
    let mut parts = Vec::new();
    for file in files {
        let (part, damage) = part(&file)?;
        parts.push(part);
        damages.extend(damage.map(|damage| DamagedFile { file, damage }));
    }
    Ok((parts, damages))
}

fn part(file: &Path) -> Result<(Part, Option<Damage>), ImportError> {
    let start = first_bytes(file)?;
    if start.starts_with(ZSTD) {
        return decompressed(file);
    }
    let storage = storage(file, &start)?;
    let (name, path) = (file.to_owned(), file.to_owned());
    #[cfg(feature = "rosbag2")]
    let part = Part { name, path, storage, _decompressed: None };
    #[cfg(not(feature = "rosbag2"))]
    let part = Part { name, path, storage };
    Ok((part, None))
}

fn first_bytes(file: &Path) -> Result<Vec<u8>, ImportError> {
    let mut start = Vec::new();
    source_file::open(file)?
        .take(16)
        .read_to_end(&mut start)
        .map_err(|error| ImportError::io(file, &error))?;
    Ok(start)
}

/// The name decides only if the first bytes do not: a damaged file keeps its kind.
fn storage(file: &Path, start: &[u8]) -> Result<Storage, ImportError> {
    let name = file.to_string_lossy();
    if start.starts_with(mcap::MAGIC) {
        return Ok(Storage::Mcap);
    }
    if start.starts_with(SQLITE) {
        return sqlite(file);
    }
    if start.starts_with(ROS1) {
        return Err(ImportError::RosBag1 { file: file.to_owned() });
    }
    if name.ends_with(".mcap") {
        return Ok(Storage::Mcap);
    }
    Err(ImportError::NotARecording { file: file.to_owned() })
}

#[cfg(feature = "rosbag2")]
#[expect(clippy::unnecessary_wraps, reason = "without data bases it is an error")]
fn sqlite(_: &Path) -> Result<Storage, ImportError> {
    Ok(Storage::Sqlite)
}

#[cfg(not(feature = "rosbag2"))]
fn sqlite(file: &Path) -> Result<Storage, ImportError> {
    Err(ImportError::WithoutRosbag2 { file: file.to_owned() })
}

#[cfg(not(feature = "rosbag2"))]
fn decompressed(file: &Path) -> Result<(Part, Option<Damage>), ImportError> {
    Err(ImportError::WithoutRosbag2 { file: file.to_owned() })
}

/// Largest ratio of a data base to its compressed size: a small file must not fill the disk.
#[cfg(feature = "rosbag2")]
const MOST_EXPANSION: u64 = 1000;

/// A file that rosbag2 compressed as a whole: SQLite needs it as a file again.
#[cfg(feature = "rosbag2")]
fn decompressed(file: &Path) -> Result<(Part, Option<Damage>), ImportError> {
    let error = |error: io::Error| ImportError::io(file, &error);
    let mut whole = tempfile::NamedTempFile::new().map_err(error)?;
    let mut decoder = fs::File::open(file).and_then(zstd::Decoder::new).map_err(error)?;
    let mut block = vec![0; 1 << 20];
    let mut damage = None;
    let most_bytes = fs::metadata(file).map_err(error)?.len().saturating_mul(MOST_EXPANSION);
    let mut written = 0_u64;
    loop {
        match decoder.read(&mut block) {
            Ok(0) => break,
            Ok(bytes) => {
                written += bytes as u64;
                if written > most_bytes {
                    let why =
                        format!("it is more than {MOST_EXPANSION} times as large when it is decompressed");
                    damage = Some(Damage::Compressed { why });
                    break;
                }
                io::Write::write_all(&mut whole, &block[..bytes]).map_err(error)?;
            }
            // The data before it may still be readable.
            Err(error) => {
                damage = Some(Damage::Compressed { why: error.to_string() });
                break;
            }
        }
    }
    let path = whole.into_temp_path();
    let storage = storage(file, &first_bytes(&path)?)?;
    let part = Part { name: file.to_owned(), path: path.to_path_buf(), storage, _decompressed: Some(path) };
    Ok((part, damage))
}

type Files = (Vec<PathBuf>, Vec<DamagedFile>);

/// The files that metadata.yaml names, or all data files by their numbers.
fn in_folder(folder: &Path) -> Result<Files, ImportError> {
    let present = data_files(folder)?;
    let listed = source_file::text(&folder.join("metadata.yaml"));
    let listed = listed.map(|text| relative_file_paths(&text)).unwrap_or_default();
    if present.is_empty() {
        return Err(ImportError::NotARecording { file: folder.to_owned() });
    }
    if listed.is_empty() {
        return Ok((present, Vec::new()));
    }
    let listed: Vec<PathBuf> = listed.iter().map(|name| folder.join(name)).collect();
    let (there, missing): (Vec<_>, Vec<_>) = listed.into_iter().partition(|file| present.contains(file));
    let unlisted = present.into_iter().filter(|file| !there.contains(file));
    let mut damages: Vec<DamagedFile> =
        missing.into_iter().map(|file| DamagedFile { file, damage: Damage::MissingPart }).collect();
    damages.extend(unlisted.map(|file| DamagedFile { file, damage: Damage::UnlistedPart }));
    if there.is_empty() {
        return Err(ImportError::NotARecording { file: folder.to_owned() });
    }
    Ok((there, damages))
}

fn data_files(folder: &Path) -> Result<Vec<PathBuf>, ImportError> {
    let error = |error: io::Error| ImportError::io(folder, &error);
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).map_err(error)? {
        let path = entry.map_err(error)?.path();
        let name = path.to_string_lossy();
        let name = name.strip_suffix(".zstd").unwrap_or(&name);
        if name.ends_with(".mcap") || name.ends_with(".db3") {
            files.push(path);
        }
    }
    files.sort_by_key(|file| by_numbers(file));
    Ok(files)
}

/// Sorts `bag_10` behind `bag_9`.
fn by_numbers(file: &Path) -> Vec<(u64, String)> {
    let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
    name.split_inclusive(|c: char| !c.is_ascii_digit())
        .map(|piece| {
            let digits = piece.trim_end_matches(|c: char| !c.is_ascii_digit());
            (digits.parse().unwrap_or(0), piece[digits.len()..].to_owned())
        })
        .collect()
}

/// The list of that name in a metadata.yaml. rosbag2 writes it in one form; a reader of all of YAML would be the largest part
/// of this crate. Names that lead out of the folder are left out.
fn relative_file_paths(text: &str) -> Vec<String> {
    let after = text.lines().map(str::trim).skip_while(|line| *line != "relative_file_paths:").skip(1);
    let names = after.map_while(|line| line.strip_prefix("- ").or(line.strip_prefix("-")));
    names
        .map(|name| name.trim().trim_matches(['"', '\'']).to_owned())
        .filter(|name| Path::new(name).components().all(|c| matches!(c, Component::Normal(_))))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_sorted_by_their_numbers() {
        let mut names =
            ["bag_10.db3", "bag_9.db3", "bag_0.db3", "a_99999999999999999999.mcap"].map(PathBuf::from);
        names.sort_by_key(|name| by_numbers(name));
        assert_eq!(
            names.map(|n| n.to_string_lossy().into_owned()),
            ["a_99999999999999999999.mcap", "bag_0.db3", "bag_9.db3", "bag_10.db3"]
        );
    }

    #[test]
    fn the_list_of_files_ends_where_it_ends() {
        let text = "rosbag2_bagfile_information:\n  files:\n  - path: no.db3\n  relative_file_paths:\n    - \"a b.db3\"\n    - b.db3\n    - ../c.db3\n  duration: 1\n    - d.db3\n";
        assert_eq!(relative_file_paths(text), ["a b.db3", "b.db3"]);
        assert!(relative_file_paths("relative_file_paths: []\n").is_empty());
    }
}
