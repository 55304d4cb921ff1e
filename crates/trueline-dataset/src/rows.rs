//! The rows of a table that is in memory, as fields of text.
//!
//! Tables of numbers have no quotes: their fields are pieces of the text, found by one comparison a byte. From the first line with
//! a quote on the crate `csv` reads the rows, with the same meaning.

use csv::{ReaderBuilder, StringRecord, Trim};
use std::str::from_utf8;

/// The rows of a text in RFC 4180's form. Lines without a single character are not rows; every end of a line counts as one
/// line.
#[derive(Debug)]
pub(crate) struct Rows<'a> {
    text: &'a str,
    /// Start of the first line that is not yet read.
    next: usize,
    /// How many lines stand before it.
    lines_before: u64,
    /// Line of the current row, from 1.
    line: u64,
    /// Starts and ends of the current row's fields.
    fields: Vec<(usize, usize)>,
    quoted: Option<Quoted<'a>>,
}

/// The rest of a text from a line with a quote on.
#[derive(Debug)]
struct Quoted<'a> {
    reader: csv::Reader<&'a [u8]>,
    record: StringRecord,
    lines_before: u64,
}

/// Why rows cannot be read.
#[derive(Debug)]
pub(crate) enum RowsError {
    NotUtf8,
    Csv { line: Option<u64>, error: csv::Error },
}

/// How a line ended that was looked through.
enum LineEnd {
    /// With all fields found; there the next line begins.
    Next(usize),
    /// At a quote.
    Quote,
}

impl<'a> Rows<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Result<Self, RowsError> {
        let text = from_utf8(bytes).map_err(|_| RowsError::NotUtf8)?;
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        Ok(Self { text, next: 0, lines_before: 0, line: 0, fields: Vec::new(), quoted: None })
    }

    /// Goes to the next row; `false` at the end.
    pub(crate) fn advance(&mut self) -> Result<bool, RowsError> {
        while self.quoted.is_none() {
            if self.next == self.text.len() {
                return Ok(false);
            }
            match self.split_line() {
                LineEnd::Next(next) => {
                    self.next = next;
                    self.lines_before += 1;
                    if !matches!(self.fields[..], [(start, end)] if start == end) {
                        self.line = self.lines_before;
                        return Ok(true);
                    }
                }
                LineEnd::Quote => {
                    let rest = &self.text.as_bytes()[self.next..];
                    let mut reader = ReaderBuilder::new();
                    reader.has_headers(false).flexible(true).trim(Trim::All);
                    let (reader, record) = (reader.from_reader(rest), StringRecord::new());
                    self.quoted = Some(Quoted { reader, record, lines_before: self.lines_before });
                }
            }
        }
        self.advance_quoted()
    }

    fn advance_quoted(&mut self) -> Result<bool, RowsError> {
        let Some(Quoted { reader, record, lines_before }) = &mut self.quoted else { return Ok(false) };
        let line_of = |position: Option<&csv::Position>| position.map(|p| *lines_before + p.line());
        let read = reader.read_record(record);
        let there = read.map_err(|error| RowsError::Csv { line: line_of(error.position()), error })?;
        self.line = line_of(record.position()).unwrap_or(self.line);
        Ok(there)
    }

    /// Finds the fields of the next line.
    fn split_line(&mut self) -> LineEnd {
        let bytes = self.text.as_bytes();
        let mut start = self.next;
        self.fields.clear();
        let mut at = start;
        loop {
            at = end_of_plain(bytes, at);
            match bytes.get(at) {
                Some(b',') => {
                    self.fields.push((start, at));
                    start = at + 1;
                }
                Some(b'"') => return LineEnd::Quote,
                Some(b'\n' | b'\r') | None => {
                    self.fields.push((start, at));
                    let pair = bytes[at..].starts_with(b"\r\n");
                    return LineEnd::Next((at + 1 + usize::from(pair)).min(bytes.len()));
                }
                Some(_) => {}
            }
            at += 1;
        }
    }

    /// How many fields the current row has.
    pub(crate) fn len(&self) -> usize {
        self.quoted.as_ref().map_or(self.fields.len(), |quoted| quoted.record.len())
    }

    /// A field of the current row without blanks around it.
    pub(crate) fn field(&self, k: usize) -> &str {
        match &self.quoted {
            None => {
                let (start, end) = self.fields[k];
                self.text[start..end].trim_ascii()
            }
            Some(quoted) => &quoted.record[k],
        }
    }

    /// Largest number of following rows with as many fields as the current one; most tables have just as many.
    pub(crate) fn most_left(&self) -> usize {
        let rest = &self.text.as_bytes()[self.next..];
        let lines = rest.iter().filter(|&&byte| byte == b'\n').count() + 1;
        // A field has a character, and one after it. Empty lines are not rows.
        lines.min(rest.len() / (2 * self.len()).max(1) + 1)
    }

    /// Line of the current row, from 1.
    pub(crate) fn line(&self) -> u64 {
        self.line
    }
}

/// Place of the first byte from `at` on that is not above the comma. Of the characters of tables those are ends of lines,
/// quotes and the comma itself, blanks and the plus sign. Eight bytes are checked at once.
fn end_of_plain(bytes: &[u8], mut at: usize) -> usize {
    const ONES: u64 = u64::MAX / 0xff;
    while let Some(eight) = bytes[at..].first_chunk() {
        let eight = u64::from_le_bytes(*eight);
        // The lowest of the set flags is right: a subtraction from a byte borrows from higher ones alone.
        let flags = eight.wrapping_sub(ONES * 0x2d) & !eight & (ONES * 0x80);
        if flags != 0 {
            return at + flags.trailing_zeros() as usize / 8;
        }
        at += 8;
    }
    at + bytes[at..].iter().take_while(|&&byte| byte > b',').count()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use proptest::prelude::*;

    fn rows(text: &str) -> Vec<(u64, Vec<String>)> {
        let mut rows = Rows::new(text.as_bytes()).unwrap();
        let mut all = Vec::new();
        while rows.advance().unwrap() {
            all.push((rows.line(), (0..rows.len()).map(|k| rows.field(k).to_owned()).collect()));
        }
        all
    }

    fn words(words: &[&str]) -> Vec<String> {
        words.iter().map(|&word| word.to_owned()).collect()
    }

    #[test]
    fn rows_know_their_lines_and_fields() {
        let text = "\u{feff}a, b\r\n\n1 ,\t+2\r3,\n\n\"4\",\"5\n,\"\"6\"\n7,8";
        let expected = [
            (1, words(&["a", "b"])),
            (3, words(&["1", "+2"])),
            (4, words(&["3", ""])),
            (6, words(&["4", "5\n,\"6"])),
            (8, words(&["7", "8"])),
        ];
        assert_eq!(rows(text), expected);
    }

    #[test]
    fn what_is_not_utf8_is_refused() {
        assert!(matches!(Rows::new(b"a,\xb0\n"), Err(RowsError::NotUtf8)));
    }

    proptest! {
        /// For any text, the rows are those that the crate `csv` finds in all of it.
        #[test]
        fn rows_are_those_of_a_reader_of_csv(text in "[,\n\r\" 1aé.-]{0,60}") {
            let reader = ReaderBuilder::new().has_headers(false).flexible(true).trim(Trim::All)
                .from_reader(text.as_bytes());
            let theirs: Vec<Vec<String>> =
                reader.into_records().map(|row| row.unwrap().iter().map(str::to_owned).collect()).collect();
            let ours: Vec<Vec<String>> = rows(&text).into_iter().map(|(_, fields)| fields).collect();
            prop_assert_eq!(ours, theirs);
        }
    }
}
