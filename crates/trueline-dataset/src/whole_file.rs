//! A file that appears whole or not at all: the old one stays until then.

use crate::error::{Error, Problem};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::{fs, io};

/// Links in a row that are followed, as many as Linux follows.
const MOST_LINKS: usize = 40;

/// Writes beside the file and gives it its name when it is complete. A link keeps naming the file, and the file keeps its permissions.
///
/// # Errors
/// Error of the operating system; the file is as it was then, and nothing is left beside it.
pub fn write(path: &Path, content: &[u8]) -> io::Result<()> {
    // Pipes and devices have no whole that could appear.
    if fs::metadata(path).is_ok_and(|meta| !meta.is_file()) {
        return fs::write(path, content);
    }
    let path = followed(path)?;
    let unfinished = unfinished(&path);
    let written = write_to_disk(&unfinished, content)
        .and_then(|()| keep_permissions(&path, &unfinished))
        .and_then(|()| fs::rename(&unfinished, &path));
    if written.is_err() {
        // The reason of the failed write is reported. A failed removal of the rest would add nothing.
        drop(fs::remove_file(&unfinished));
    }
    written
}

/// Without `sync_all` a crash of the machine could leave the new name with nothing behind it.
fn write_to_disk(path: &Path, content: &[u8]) -> io::Result<()> {
    let mut file = fs::File::create(path)?;
    file.write_all(content)?;
    file.sync_all()
}

/// The file that a chain of links names; it need not be there.
fn followed(path: &Path) -> io::Result<PathBuf> {
    let mut at = path.to_owned();
    for _ in 0..MOST_LINKS {
        let Ok(named) = fs::read_link(&at) else { return Ok(at) };
        at = at.parent().map_or_else(|| named.clone(), |folder| folder.join(&named));
    }
    Err(io::Error::other("its links lead in a circle"))
}

/// Gives a new file the permissions of the one that it replaces.
fn keep_permissions(replaced: &Path, by: &Path) -> io::Result<()> {
    fs::metadata(replaced).map_or(Ok(()), |meta| fs::set_permissions(by, meta.permissions()))
}

/// A file that is being written beside the one that it will be; without [`Unfinished::finish`] nothing is left of it.
#[derive(Debug)]
pub struct Unfinished {
    file: fs::File,
    at: PathBuf,
    path: PathBuf,
    is_finished: bool,
}

impl Unfinished {
    /// Begins a file, open for writing and reading.
    ///
    /// # Errors
    /// Error of the operating system; and a pipe or a device, which has no whole that could appear.
    pub fn create(path: &Path) -> io::Result<Self> {
        if fs::metadata(path).is_ok_and(|meta| !meta.is_file()) {
            return Err(io::Error::new(io::ErrorKind::InvalidInput, "only a file can be written in parts"));
        }
        let path = followed(path)?;
        let at = unfinished(&path);
        let file = fs::File::options().read(true).write(true).create(true).truncate(true).open(&at)?;
        Ok(Self { file, at, path, is_finished: false })
    }

    /// The file.
    #[must_use]
    pub fn file(&self) -> &fs::File {
        &self.file
    }

    /// Gives the file its name.
    ///
    /// # Errors
    /// Error of the operating system; the old file stays.
    pub fn finish(mut self) -> io::Result<()> {
        self.file.sync_all()?;
        keep_permissions(&self.path, &self.at)?;
        fs::rename(&self.at, &self.path)?;
        self.is_finished = true;
        Ok(())
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        if !self.is_finished {
            // The reason of the failed write is reported. A failed removal of the rest would add nothing.
            drop(fs::remove_file(&self.at));
        }
    }
}

/// The name of a file until it is complete.
fn unfinished(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(format!(".{}.unfinished", std::process::id()));
    path.with_file_name(name)
}

/// Checks whether a file can be written at its place, before the work is done.
///
/// # Errors
/// A folder of that name, and a folder that is not there.
pub(crate) fn expect_writable(path: &Path) -> Result<(), Error> {
    if path.is_dir() {
        return Err(Error::in_file(path, Problem::OutputIsFolder));
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty() && !folder.is_dir());
    folder.map_or(Ok(()), |folder| Err(Error::in_file(path, Problem::NoFolder { folder: folder.to_owned() })))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_finished_leaves_what_was_there() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("result.json");
        write(&file, b"first").unwrap();
        write(&file, b"second").unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"second");
        // In parts likewise: nothing appears before the end, and nothing is left without one.
        let parts = Unfinished::create(&file).unwrap();
        parts.file().write_all(b"third").unwrap();
        drop(parts);
        assert_eq!(fs::read(&file).unwrap(), b"second");
        let parts = Unfinished::create(&file).unwrap();
        parts.file().write_all(b"third").unwrap();
        parts.finish().unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"third");
        // A folder of that name is in the way of the last step.
        let taken = folder.path().join("taken");
        fs::create_dir(&taken).unwrap();
        assert!(write(&taken, b"lost").is_err());
        let left: Vec<_> =
            fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        assert_eq!(left.len(), 2, "{left:?}");
    }

    #[cfg(unix)]
    #[test]
    fn a_link_and_the_permissions_behind_it_stay() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir(at("results")).unwrap();
        fs::write(at("results/real.json"), "first").unwrap();
        fs::set_permissions(at("results/real.json"), fs::Permissions::from_mode(0o640)).unwrap();
        symlink("results/real.json", at("near")).unwrap();
        symlink(at("near"), at("far")).unwrap();
        write(&at("far"), b"second").unwrap();
        let parts = Unfinished::create(&at("near")).unwrap();
        assert_eq!(fs::read(at("results/real.json")).unwrap(), b"second");
        parts.file().write_all(b"third").unwrap();
        parts.finish().unwrap();
        assert_eq!(fs::read(at("results/real.json")).unwrap(), b"third");
        assert_eq!(fs::metadata(at("results/real.json")).unwrap().permissions().mode() & 0o777, 0o640);
        assert!(fs::symlink_metadata(at("far")).unwrap().is_symlink());
        // A link to a file that is not there yet, and one in a circle.
        symlink("results/new.json", at("new")).unwrap();
        write(&at("new"), b"new").unwrap();
        assert_eq!(fs::read(at("results/new.json")).unwrap(), b"new");
        symlink("circle", at("circle")).unwrap();
        write(&at("circle"), b"lost").unwrap_err();
    }
}
