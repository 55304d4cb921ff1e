//! Where words and data go.

use crate::failure::Failure;
use std::io::{ErrorKind, Write};
use std::path::Path;

/// Words for a person: stderr.
pub fn words(text: &str) {
    // If stderr is gone there is nobody left to tell.
    let _ = writeln!(std::io::stderr().lock(), "{}", text.trim_end());
}

/// Data for the next program: stdout.
pub fn data(text: &str) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    match writeln!(out, "{}", text.trim_end()).and_then(|()| out.flush()) {
        Ok(()) => Ok(()),
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Err(Failure::BrokenPipe),
        Err(error) => Err(Failure::new(format!("stdout cannot be written: {error}"), "is the disk full?")),
    }
}

/// A line on a terminal that the next one overwrites.
pub fn status(text: &str) {
    let mut out = std::io::stderr().lock();
    let _ = write!(out, "\r\x1b[2K{text}").and_then(|()| out.flush());
}

/// JSON into the file that a user named; - is stdout.
pub fn json(path: &Path, text: &str) -> Result<(), Failure> {
    if path == Path::new("-") { data(text) } else { file(path, text) }
}

/// A summary for a person: on stdout, unless JSON goes there.
pub fn summary(json: Option<&Path>, text: &str) -> Result<(), Failure> {
    if json == Some(Path::new("-")) {
        words(text);
        return Ok(());
    }
    data(text)
}

/// A file that a user named as output.
pub fn file(path: &Path, text: &str) -> Result<(), Failure> {
    std::fs::write(path, text).map_err(|error| Failure::cannot_write(path, &error))
}

/// The command that is running, as a person types it.
pub fn command_line() -> String {
    let quoted = |word: String| if word.contains([' ', '"', '\'']) { format!("{word:?}") } else { word };
    let words = std::env::args_os().skip(1).map(|word| quoted(word.to_string_lossy().into_owned()));
    std::iter::once("trueline".to_owned()).chain(words).collect::<Vec<_>>().join(" ")
}
