//! A folder of results that appears as a whole or not at all.

use crate::error::{Error, Problem};
use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::{self, BufRead, BufReader};
use std::path::{Path, PathBuf};

/// Files that commands write into a folder, pictures aside. A folder with any other file is never replaced.
const OURS: [&str; 25] = [
    "sensor.toml",
    "robot.csv",
    "poses.csv",
    "sightings.csv",
    "features.csv",
    "stripes.csv",
    "profiles.csv",
    "profiles.parquet",
    "initial.toml",
    "truth.toml",
    "truth_features.csv",
    "truth_sensor.toml",
    "truth_curve.csv",
    "images",
    "boards",
    "stripes",
    "without-laser",
    "moving",
    "index.csv",
    "report.html",
    "result.json",
    "check",
    "truth.json",
    "axes.csv",
    "cell.toml",
];

/// The folders among them.
const FOLDERS: [&str; 6] = ["images", "boards", "stripes", "without-laser", "moving", "check"];

/// A folder in the making, beside its final place.
#[derive(Debug)]
pub struct WholeFolder {
    target: PathBuf,
    unfinished: PathBuf,
    finished: bool,
}

impl WholeFolder {
    /// Begins. The target must not exist, or be empty, unless it may be replaced. Leftovers of an interrupted run beside it
    /// are removed.
    ///
    /// # Errors
    /// Refuses a target in use or without a name of its own (`.`, `..`, `/`), a target with foreign content, and a folder
    /// that cannot be made.
    pub fn begin(target: &Path, replace: bool) -> Result<Self, Error> {
        if target.file_name().is_none() {
            return Err(Error::in_file(target, Problem::FolderWithoutName));
        }
        let is_used = fs::read_dir(target).map_or(target.exists(), |mut entries| entries.next().is_some());
        if is_used && !replace {
            return Err(Error::in_file(target, Problem::AlreadyExists));
        }
        check_is_ours(target)?;
        let unfinished = beside(target, "unfinished");
        check_is_ours(&unfinished)?;
        removed(&unfinished)?;
        fs::create_dir_all(&unfinished).map_err(|error| Error::in_file(&unfinished, Problem::Io(error)))?;
        Ok(Self { target: target.to_owned(), unfinished, finished: false })
    }

    /// Begins a folder of files of any name, which must not exist or be empty. One that is there stays the same folder, for it may be the
    /// one that the user works in, or a disk of its own.
    ///
    /// # Errors
    /// A target that is in use; what cannot be made.
    pub fn begin_new(target: &Path) -> Result<Self, Error> {
        let is_used = fs::read_dir(target).is_ok_and(|mut entries| entries.next().is_some());
        if is_used || target.is_file() {
            return Err(Error::in_file(target, Problem::AlreadyExists));
        }
        let name = format!("{}.unfinished", std::process::id());
        let unfinished = if target.is_dir() { target.join(name) } else { beside(target, &name) };
        fs::create_dir_all(&unfinished).map_err(|error| Error::in_file(target, Problem::Io(error)))?;
        Ok(Self { target: target.to_owned(), unfinished, finished: false })
    }

    /// Where to write.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.unfinished
    }

    /// Gives the folder its name. A replaced folder is kept next to it, unless it has the same files with the same
    /// content: names do not distinguish a simulation from a recording. Returns where the former folder is now, if it is
    /// kept.
    ///
    /// # Errors
    /// A target with files that the new folder does not have, pictures of a scan say. Error of the operating system. Then
    /// the target is as it was.
    pub fn finish(mut self) -> Result<Option<PathBuf>, Error> {
        let renamed = |from: &Path, to: &Path| {
            fs::rename(from, to).map_err(|error| Error::in_file(to, Problem::Io(error)))
        };
        if self.unfinished.parent() == Some(&self.target) {
            return self.move_up().map(|()| None);
        }
        let replaced = free_beside(&self.target);
        let was_there = self.target.exists();
        if was_there {
            check_nothing_is_lost(&self.target, &self.unfinished)?;
            renamed(&self.target, &replaced)?;
        }
        if let Err(error) = renamed(&self.unfinished, &self.target) {
            if was_there {
                renamed(&replaced, &self.target)?;
            }
            return Err(error);
        }
        self.finished = true;
        if !was_there {
            return Ok(None);
        }
        if is_contained(&replaced, &self.target)? {
            removed(&replaced)?;
            return Ok(None);
        }
        Ok(Some(replaced))
    }

    /// Moves everything into the target, in which it was made. Renaming needs no space.
    fn move_up(&mut self) -> Result<(), Error> {
        let moved = || {
            for entry in fs::read_dir(&self.unfinished)? {
                let entry = entry?;
                fs::rename(entry.path(), self.target.join(entry.file_name()))?;
            }
            fs::remove_dir(&self.unfinished)
        };
        moved().map_err(|error| Error::in_file(&self.target, Problem::Io(error)))?;
        self.finished = true;
        Ok(())
    }
}

impl Drop for WholeFolder {
    fn drop(&mut self) {
        if !self.finished {
            // The reason for the missing folder is reported already.
            drop(fs::remove_dir_all(&self.unfinished));
        }
    }
}

fn beside(target: &Path, what: &str) -> PathBuf {
    let mut name = target.file_name().unwrap_or_else(|| OsStr::new("out")).to_owned();
    name.push(".");
    name.push(what);
    target.with_file_name(name)
}

/// An unused name for the replaced folder: only our own copy is removed.
fn free_beside(target: &Path) -> PathBuf {
    let mut names = (1..).map(|k| beside(target, &format!("replaced-{k}")));
    names.find(|name| !name.exists()).unwrap_or_else(|| unreachable!("numbers do not end"))
}

fn removed(folder: &Path) -> Result<(), Error> {
    match fs::remove_dir_all(folder) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(Error::in_file(folder, Problem::Io(error)))
        }
        _ => Ok(()),
    }
}

/// Refuses to replace files by nothing.
fn check_nothing_is_lost(before: &Path, after: &Path) -> Result<(), Error> {
    let Ok(entries) = fs::read_dir(before) else { return Ok(()) };
    for entry in entries.flatten() {
        let next = after.join(entry.file_name());
        if !next.exists() {
            let other = entry.file_name().to_string_lossy().into_owned();
            return Err(Error::in_file(before, Problem::NotOurs { other }));
        }
        check_nothing_is_lost(&entry.path(), &next)?;
    }
    Ok(())
}

/// Whether every file below a folder is in the other one too, with the same content.
fn is_contained(before: &Path, after: &Path) -> Result<bool, Error> {
    let io = |error| Error::in_file(before, Problem::Io(error));
    // A link's target is not a copy of ours.
    let kind = fs::symlink_metadata(before).map_err(io)?;
    if !kind.is_dir() {
        return Ok(kind.is_file() && after.is_file() && is_same_content(before, after).map_err(io)?);
    }
    for entry in fs::read_dir(before).map_err(io)? {
        let entry = entry.map_err(io)?;
        if !is_contained(&entry.path(), &after.join(entry.file_name()))? {
            return Ok(false);
        }
    }
    Ok(true)
}

fn is_same_content(one: &Path, other: &Path) -> io::Result<bool> {
    if fs::metadata(one)?.len() != fs::metadata(other)?.len() {
        return Ok(false);
    }
    let mut one = BufReader::new(File::open(one)?);
    let mut other = BufReader::new(File::open(other)?);
    loop {
        let (left, right) = (one.fill_buf()?, other.fill_buf()?);
        let count = left.len().min(right.len());
        if left[..count] != right[..count] || (count == 0 && left.len() != right.len()) {
            return Ok(false);
        }
        if count == 0 {
            return Ok(true);
        }
        one.consume(count);
        other.consume(count);
    }
}

/// Refuses a file, and a folder with files that no command writes.
fn check_is_ours(folder: &Path) -> Result<(), Error> {
    if folder.is_file() {
        return Err(Error::in_file(folder, Problem::AlreadyExists));
    }
    let Ok(entries) = fs::read_dir(folder) else { return Ok(()) };
    for entry in entries.flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let is_picture = Path::new(&name).extension().is_some_and(|end| end == "png");
        if !OURS.contains(&name.as_str()) && !is_picture {
            return Err(Error::in_file(folder, Problem::NotOurs { other: name }));
        }
        if FOLDERS.contains(&name.as_str()) {
            check_is_ours(&entry.path())?;
        }
    }
    Ok(())
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect()
    }

    #[test]
    fn a_new_folder_appears_whole_or_not_at_all() {
        let place = tempfile::tempdir().unwrap();
        let (new, there) = (place.path().join("new"), place.path().join("there"));
        fs::create_dir(&there).unwrap();
        for target in [&new, &there] {
            let given_up = WholeFolder::begin_new(target).unwrap();
            fs::write(given_up.path().join("page.1"), "half").unwrap();
            drop(given_up);
            assert!(!target.exists() || names(target).is_empty());
            let whole = WholeFolder::begin_new(target).unwrap();
            fs::write(whole.path().join("page.1"), "whole").unwrap();
            assert!(!target.join("page.1").exists());
            assert_eq!(whole.finish().unwrap(), None);
            assert_eq!(names(target), ["page.1"]);
            WholeFolder::begin_new(target).unwrap_err();
        }
        assert_eq!(names(place.path()).len(), 2);
    }
}
