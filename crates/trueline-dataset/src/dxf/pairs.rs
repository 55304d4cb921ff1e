//! The lines of a DXF file in pairs.

use crate::error::{Error, Problem};
use crate::table::LARGEST;
use std::path::Path;

/// The lines of a file with their numbers from 0.
type Lines<'a> = std::iter::Enumerate<std::slice::Split<'a, u8, fn(&u8) -> bool>>;

/// How a file of another form begins.
const BINARY: &[u8] = b"AutoCAD Binary DXF";

/// A code and its value.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair<'a> {
    /// Kind of the value.
    pub code: i64,
    /// The value.
    pub value: &'a str,
    /// Line of the value, from 1.
    pub line: u64,
}

/// The pairs of a file, one after the other.
pub(super) struct Pairs<'a> {
    file: &'a Path,
    lines: Lines<'a>,
}

impl<'a> Pairs<'a> {
    /// Of a file in text.
    pub(super) fn new(file: &'a Path, bytes: &'a [u8]) -> Result<Self, Error> {
        if bytes.starts_with(BINARY) {
            let hint = "export it as DXF in text (ASCII)";
            return Err(Error::unreadable(file, "a drawing in binary DXF", hint));
        }
        let is_end: fn(&u8) -> bool = |byte| *byte == b'\n';
        Ok(Self { file, lines: bytes.split(is_end).enumerate() })
    }

    /// The next pair; `None` at the end.
    pub(super) fn next_pair(&mut self) -> Result<Option<Pair<'a>>, Error> {
        let Some((at, code)) = self.lines.next() else { return Ok(None) };
        let code = text(code);
        // Text after the last line end, and empty lines there.
        if code.is_empty() && self.lines.clone().all(|(_, line)| text(line).is_empty()) {
            return Ok(None);
        }
        let broken = |pairs: &Self, what: String| {
            pairs.error(
                at as u64 + 1,
                what,
                "check that this is a DXF drawing: its lines are a code and a value in turn",
            )
        };
        let code: i64 =
            code.parse().map_err(|_| broken(self, format!("a DXF file with `{code}` in place of a code")))?;
        let Some((next, value)) = self.lines.next() else {
            return Err(broken(self, "a DXF file that ends after a code".to_owned()));
        };
        Ok(Some(Pair { code, value: text(value), line: next as u64 + 1 }))
    }

    /// A value as a number.
    pub(super) fn number(&self, pair: &Pair<'_>) -> Result<f64, Error> {
        let number = pair.value.parse::<f64>().ok().filter(|number| number.abs() < LARGEST);
        number.ok_or_else(|| self.no_number(pair, "a number"))
    }

    /// A value as a whole number.
    pub(super) fn whole(&self, pair: &Pair<'_>) -> Result<i64, Error> {
        pair.value.parse().map_err(|_| self.no_number(pair, "a whole number"))
    }

    fn no_number(&self, pair: &Pair<'_>, expected: &str) -> Error {
        let what = format!("a DXF file with `{}` in place of {expected}", pair.value);
        self.error(pair.line, what, "export the drawing again: this value is broken")
    }

    /// The fault in a line.
    pub(super) fn error(&self, line: u64, what: String, hint: &'static str) -> Error {
        Error::at_line(self.file, line, Problem::Unreadable { what, hint })
    }

    /// The fault of all.
    pub(super) fn file_error(&self, what: &str, hint: &'static str) -> Error {
        Error::unreadable(self.file, what, hint)
    }
}

/// A line without its blanks. Bytes that are not text are not a number either, and are refused where one is needed.
fn text(line: &[u8]) -> &str {
    std::str::from_utf8(line).unwrap_or("?").trim()
}
