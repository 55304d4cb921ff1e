//! A table of profiles, read piece by piece. In memory is one piece of some megabytes, under the header of all.
//!
//! A table in another form than plain CSV is one piece: its decimal signs and units are those of the whole text.

use crate::dialect::plain_csv;
use crate::error::{Error, Problem};
use crate::profile_stream::{Assembly, EachProfile};
use crate::profiles_csv::Tables;
use crate::source_file;
use crate::stop_poses::Pairing;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Bytes that are read at a time: more than the longest line.
const PIECE: u64 = 1 << 21;

/// Hands over the profiles of a table; a remark notes a table that is not plain CSV.
///
/// # Errors
/// Anything that is not a clean table with rising stamps.
pub(crate) fn each(
    path: &Path,
    file: &File,
    pairing: Pairing<'_>,
    notes: &mut Vec<String>,
    each: &mut EachProfile<'_>,
) -> Result<(), Error> {
    let mut source = Source { path, file, is_at_end: false };
    let mut tables = Tables { file: path, pairing, all: Assembly::new(each) };
    let mut bytes = Vec::new();
    source.add_to(&mut bytes, PIECE)?;
    let head = source.whole(&bytes);
    let (plain, dialect) = plain_csv(path, bytes[..head].to_vec(), None)?;
    if plain != bytes[..head] || !dialect.is_plain() {
        source.add_to(&mut bytes, u64::MAX)?;
        let (csv, dialect) = plain_csv(path, bytes, None)?;
        if !dialect.is_plain() {
            notes.push(format!("{}: {dialect}", path.display()));
        }
        return if tables.take(&csv)?.is_break() { Ok(()) } else { tables.end() };
    }
    drop(plain);
    let header = end_of_header(&bytes);
    let mut lines_before = 0;
    let in_file = |mut error: Error, lines_before: u64| {
        error.line = error.line.map(|line| line + lines_before);
        error
    };
    loop {
        source_file::expect_lines(path, &bytes).map_err(|error| in_file(error, lines_before))?;
        let whole = source.whole(&bytes);
        let taken = tables.take(&bytes[..whole]).map_err(|error| in_file(error, lines_before))?;
        if taken.is_break() {
            return Ok(());
        }
        if source.is_at_end {
            return tables.end();
        }
        lines_before += bytes[header..whole].iter().filter(|byte| **byte == b'\n').count() as u64;
        bytes.drain(header..whole);
        source.add_to(&mut bytes, PIECE)?;
    }
}

/// End of the first line with a character.
fn end_of_header(bytes: &[u8]) -> usize {
    let begin = bytes.iter().position(|byte| !byte.is_ascii_whitespace()).unwrap_or(bytes.len());
    let end = bytes[begin..].iter().position(|byte| *byte == b'\n');
    end.map_or(bytes.len(), |end| begin + end + 1)
}

/// The rest of a file.
struct Source<'a> {
    path: &'a Path,
    file: &'a File,
    is_at_end: bool,
}

impl Source<'_> {
    /// Reads on.
    fn add_to(&mut self, bytes: &mut Vec<u8>, most: u64) -> Result<(), Error> {
        let read = self.file.take(most).read_to_end(bytes);
        let read = read.map_err(|error| Error::in_file(self.path, Problem::Io(error)))?;
        self.is_at_end = (read as u64) < most;
        Ok(())
    }

    /// Length of the whole lines of a piece.
    fn whole(&self, bytes: &[u8]) -> usize {
        if self.is_at_end {
            return bytes.len();
        }
        bytes.iter().rposition(|byte| *byte == b'\n').map_or(0, |end| end + 1)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::profile::Profile;
    use crate::profiles_csv;
    use std::fmt::Write;
    use std::ops::ControlFlow;

    const ROWS: usize = 200_000;

    /// Some pieces of a table; profiles of 7 rows, so that they go across the pieces.
    fn table(separator: char) -> String {
        let mut text = format!("\ntime_s{separator}x_mm{separator}z_mm\n");
        for row in 0..ROWS {
            let (stamp_s, x_mm, z_mm) = (row / 7, row % 7, 200 + row % 13);
            writeln!(text, "{stamp_s}.25{separator}{x_mm}.5{separator}{z_mm}.125").unwrap();
        }
        text
    }

    fn read(text: &[u8], most: usize) -> (Result<(), Error>, Vec<Profile>, Vec<String>) {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("profiles.csv");
        std::fs::write(&path, text).unwrap();
        let (mut profiles, mut notes) = (Vec::new(), Vec::new());
        let mut keep = |profile| {
            profiles.push(profile);
            if profiles.len() < most { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        };
        let read = each(&path, &File::open(&path).unwrap(), Pairing::default(), &mut notes, &mut keep);
        (read, profiles, notes)
    }

    #[test]
    fn pieces_of_a_table_have_the_profiles_of_the_whole() {
        let text = table(',');
        assert!(text.len() as u64 > PIECE);
        let whole = profiles_csv::read(Path::new("profiles.csv"), text.as_bytes()).unwrap();
        let (done, pieces, _) = read(text.as_bytes(), usize::MAX);
        done.unwrap();
        assert!(pieces == whole && pieces.len() == ROWS.div_ceil(7));
        let (done, first, _) = read(text.as_bytes(), 3);
        assert!(done.is_ok() && first == whole[..3]);
        let (done, semicolons, notes) = read(table(';').as_bytes(), usize::MAX);
        done.unwrap();
        assert!(semicolons == whole && notes.len() == 1, "{notes:?}");
    }

    #[test]
    fn an_error_in_a_later_piece_names_the_line_of_the_file() {
        let mut lines: Vec<&str> = Vec::new();
        let text = table(',');
        lines.extend(text.lines());
        lines[ROWS - 10] = "1e9,nothing,2";
        let broken = lines.join("\r\n");
        let whole = profiles_csv::read(Path::new("profiles.csv"), broken.as_bytes()).unwrap_err();
        let (piece, ..) = read(broken.as_bytes(), usize::MAX);
        assert_eq!(piece.unwrap_err().line, whole.line);
        let text = table(',') + &"7".repeat(2 << 20);
        let (long, ..) = read(text.as_bytes(), usize::MAX);
        let long = long.unwrap_err();
        assert_eq!(
            (long.line, long.to_string().contains("more than a megabyte")),
            (Some(ROWS as u64 + 3), true)
        );
    }
}
