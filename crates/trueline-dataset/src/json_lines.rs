//! A log of JSON, one object a line. Its content stays, and every new line is appended at once.

use crate::error::{Error, Problem};
use std::fs::{File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;

/// Adds a line. One before it that was cut off, the machine having stopped, keeps a line of its own.
///
/// # Errors
/// A file that is not such a log; error of the operating system.
pub fn append(path: &Path, line: &str) -> Result<(), Error> {
    let is_cut_off = ends_within_a_line(path)?;
    let line = format!("{}{line}\n", if is_cut_off { "\n" } else { "" });
    let add = || OpenOptions::new().append(true).create(true).open(path)?.write_all(line.as_bytes());
    add().map_err(|error| Error::in_file(path, Problem::Io(error)))
}

/// Refuses a file to which no line should be added.
///
/// # Errors
/// A file that does not begin with an object; error of the operating system.
pub fn expect(path: &Path) -> Result<(), Error> {
    ends_within_a_line(path).map(drop)
}

fn ends_within_a_line(path: &Path) -> Result<bool, Error> {
    // Pipes and devices have neither beginning nor end.
    if !path.is_file() {
        return Ok(false);
    }
    let [first, last] = ends(path).map_err(|error| Error::in_file(path, Problem::Io(error)))?;
    match (first, last) {
        (None, _) => Ok(false),
        (Some(b'{'), last) => Ok(last != Some(b'\n')),
        _ => Err(Error::in_file(path, Problem::NotJsonLines)),
    }
}

/// First and last byte of a file.
fn ends(path: &Path) -> io::Result<[Option<u8>; 2]> {
    let mut file = File::open(path)?;
    if file.metadata()?.len() == 0 {
        return Ok([None; 2]);
    }
    let mut byte = [0; 1];
    file.read_exact(&mut byte)?;
    let first = byte[0];
    file.seek(SeekFrom::End(-1))?;
    file.read_exact(&mut byte)?;
    Ok([Some(first), Some(byte[0])])
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn lines_are_added_to_what_is_there_and_to_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let log = folder.path().join("alarms.jsonl");
        expect(&log).unwrap();
        append(&log, "{\"weld\":0}").unwrap();
        append(&log, "{\"weld\":1}").unwrap();
        fs::write(&log, fs::read_to_string(&log).unwrap() + "{\"we").unwrap();
        append(&log, "{\"weld\":2}").unwrap();
        assert_eq!(fs::read_to_string(&log).unwrap(), "{\"weld\":0}\n{\"weld\":1}\n{\"we\n{\"weld\":2}\n");
        let table = folder.path().join("robot.csv");
        fs::write(&table, "time_s,x_mm\n").unwrap();
        assert!(matches!(append(&table, "{}").unwrap_err().problem, Problem::NotJsonLines));
        assert_eq!(fs::read_to_string(&table).unwrap(), "time_s,x_mm\n");
    }
}
