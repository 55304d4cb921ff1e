//! Files that a user named, read as a whole: only regular ones, because a pipe or a device may never end.

use crate::error::{Error, Problem};
use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::Path;

/// Opens a file.
///
/// # Errors
/// A file that is missing, is not a regular file, or that the operating system refuses.
pub fn open(file: &Path) -> Result<File, Error> {
    let refused = |error: std::io::Error| {
        let missing = error.kind() == ErrorKind::NotFound;
        Error::in_file(file, if missing { Problem::Missing } else { Problem::Io(error) })
    };
    // Asked before it is opened: opening a pipe waits for somebody who writes.
    let kind = std::fs::metadata(file).map_err(refused)?.file_type();
    if kind.is_dir() {
        return Err(Error::in_file(file, Problem::IsFolder));
    }
    if !kind.is_file() {
        let hint = "pipes and devices may never end: copy their content into a file first";
        return Err(Error::unreadable(file, "a pipe, a socket or a device", hint));
    }
    File::open(file).map_err(refused)
}

/// The bytes of a file.
///
/// # Errors
/// As [`open`].
pub fn bytes(file: &Path) -> Result<Vec<u8>, Error> {
    let mut bytes = Vec::new();
    open(file)?.read_to_end(&mut bytes).map_err(|error| Error::in_file(file, Problem::Io(error)))?;
    Ok(bytes)
}

/// The same, or `None` if the file is not there.
///
/// # Errors
/// As [`open`], but for a file that is missing.
pub(crate) fn bytes_if_there(file: &Path) -> Result<Option<Vec<u8>>, Error> {
    match bytes(file) {
        Err(error) if matches!(error.problem, Problem::Missing) => Ok(None),
        read => read.map(Some),
    }
}

/// An open file, or `None` if it is not there.
///
/// # Errors
/// As [`open`], but for a file that is missing.
pub(crate) fn open_if_there(file: &Path) -> Result<Option<File>, Error> {
    match open(file) {
        Err(error) if matches!(error.problem, Problem::Missing) => Ok(None),
        opened => opened.map(Some),
    }
}

/// The text of a file.
///
/// # Errors
/// As [`open`], or a file that is not UTF-8.
pub fn text(file: &Path) -> Result<String, Error> {
    let mut text = String::new();
    open(file)?.read_to_string(&mut text).map_err(|error| {
        let problem =
            if error.kind() == ErrorKind::InvalidData { Problem::NotUtf8 } else { Problem::Io(error) };
        Error::in_file(file, problem)
    })?;
    Ok(text)
}

/// The same of a file that a user named himself, which is not missing in something.
///
/// # Errors
/// The files that were read.
pub fn named<T>(read: Result<T, Error>) -> Result<T, Error> {
    read.map_err(|mut error| {
        if matches!(error.problem, Problem::Missing) {
            error.problem = Problem::NoSuchFile;
        }
        error
    })
}

/// Longest line of a table, bytes. A profile of 65,536 points has less than half of it.
const LONGEST_LINE: usize = 1 << 20;

/// Refuses data that cannot be a table: rows are copied as a whole while they are read.
///
/// # Errors
/// A line of more than a megabyte.
pub(crate) fn expect_lines(file: &Path, bytes: &[u8]) -> Result<(), Error> {
    let mut rest = bytes;
    // The last end of a line within reach: all lines before it are short enough, and only the last of them is looked through.
    while rest.len() > LONGEST_LINE {
        let Some(end) = rest[..=LONGEST_LINE].iter().rposition(|&byte| byte == b'\n') else {
            let before = &bytes[..bytes.len() - rest.len()];
            let line = 1 + before.iter().filter(|&&byte| byte == b'\n').count() as u64;
            let what = "a line of more than a megabyte".to_owned();
            let problem = Problem::Unreadable { what, hint: "check that this is the intended file" };
            return Err(Error::at_line(file, line, problem));
        };
        rest = &rest[end + 1..];
    }
    Ok(())
}
