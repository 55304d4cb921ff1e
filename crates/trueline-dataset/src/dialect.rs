//! How a table was written (encoding, separator, decimal sign), and the same table as plain CSV.
//!
//! Programs in German write `1,5;2,5`, Excel writes UTF-16, controllers write blanks. The recognised form is returned for a
//! remark. Two decimal signs in one file are an error. If commas do not separate columns, the only comma of a number is its
//! decimal sign. Robots log millimetres with three decimals, and none separates thousands.

use crate::error::{Error, Problem};
pub use crate::separator::Separator;
use crate::separator::{GROUPS, fields};
use crate::source_file;
use crate::table_start;
use encoding_rs::{SHIFT_JIS, WINDOWS_1252};
use std::borrow::Cow;
use std::fmt;
use std::path::Path;

/// How the characters of a file are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// UTF-8, with or without a byte order mark; ASCII is a part of it.
    Utf8,
    /// UTF-16, least significant byte first.
    Utf16Le,
    /// UTF-16, most significant byte first.
    Utf16Be,
    /// One byte a character, as Windows in western Europe writes.
    Windows1252,
    /// As Windows in Japan writes.
    ShiftJis,
}

/// How a table was written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dialect {
    /// Its characters.
    pub encoding: Encoding,
    /// Separator of its columns.
    pub separator: Separator,
    /// Whether `1,5` is one and a half.
    pub decimal_comma: bool,
    /// How many lines stand before the header, or before the first row if no line has names.
    pub lines_before: usize,
}

impl Dialect {
    /// Whether no remark is needed: UTF-8, commas, decimal points.
    #[must_use]
    pub fn is_plain(&self) -> bool {
        let plain = Self {
            encoding: Encoding::Utf8,
            separator: Separator::Character(','),
            decimal_comma: false,
            lines_before: 0,
        };
        *self == plain
    }
}

impl fmt::Display for Dialect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.encoding {
            Encoding::Utf8 => {}
            Encoding::Utf16Le | Encoding::Utf16Be => write!(f, "UTF-16, ")?,
            Encoding::Windows1252 => write!(f, "Windows-1252, ")?,
            Encoding::ShiftJis => write!(f, "Shift JIS, ")?,
        }
        let decimal = if self.decimal_comma { "commas" } else { "points" };
        write!(f, "{} between columns, decimal {decimal}", self.separator)?;
        match self.lines_before {
            0 => Ok(()),
            lines => write!(f, ", columns named in line {}", lines + 1),
        }
    }
}

impl fmt::Display for Separator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Character(';') => write!(f, "semicolons"),
            Self::Character('\t') => write!(f, "tabs"),
            Self::Character(',') => write!(f, "commas"),
            Self::Character(other) => write!(f, "`{other}`"),
            Self::Blanks => write!(f, "blanks"),
        }
    }
}

/// A file as text, and how it was stored.
///
/// # Errors
/// UTF-16 that is cut off or broken.
pub fn decode(file: &Path, bytes: Vec<u8>) -> Result<(String, Encoding), Error> {
    let half = |read: fn([u8; 2]) -> u16, from: usize| {
        let (units, rest) = bytes[from..].as_chunks::<2>();
        // A lone NUL at the end is not a character.
        let whole = rest.iter().all(|&byte| byte == 0);
        let units = units.iter().map(|&unit| read(unit));
        let text = char::decode_utf16(units).collect::<Result<String, _>>().ok().filter(|_| whole);
        text.map(|text| text.trim_end_matches('\0').to_owned())
            .ok_or_else(|| Error::in_file(file, Problem::Csv("broken UTF-16".to_owned())))
    };
    // Text in Latin letters has a zero in every second byte.
    let zero_at = |first: usize| {
        let looked_at = &bytes[..bytes.len().min(64)];
        looked_at.len() >= 8 && looked_at.iter().skip(first).step_by(2).all(|&byte| byte == 0)
    };
    if bytes.starts_with(&[0xff, 0xfe]) {
        return Ok((half(u16::from_le_bytes, 2)?, Encoding::Utf16Le));
    }
    if bytes.starts_with(&[0xfe, 0xff]) {
        return Ok((half(u16::from_be_bytes, 2)?, Encoding::Utf16Be));
    }
    if zero_at(1) {
        return Ok((half(u16::from_le_bytes, 0)?, Encoding::Utf16Le));
    }
    if zero_at(0) {
        return Ok((half(u16::from_be_bytes, 0)?, Encoding::Utf16Be));
    }
    match String::from_utf8(bytes) {
        Ok(text) => Ok((text, Encoding::Utf8)),
        Err(error) => Ok(of_windows(error.as_bytes())),
    }
}

/// Text of a Windows that does not write Unicode. Japanese text has kana of two bytes, the first of which western text hardly ever has.
fn of_windows(bytes: &[u8]) -> (String, Encoding) {
    let (japanese, is_broken) = SHIFT_JIS.decode_without_bom_handling(bytes);
    let is_kana = |c: char| matches!(c, '\u{3041}'..='\u{30fa}');
    if !is_broken && japanese.contains(is_kana) {
        return (japanese.into_owned(), Encoding::ShiftJis);
    }
    let (western, _) = WINDOWS_1252.decode_without_bom_handling(bytes);
    (western.into_owned(), Encoding::Windows1252)
}

/// A table as plain CSV with decimal points, line by line, and how it was written. A separator that the user named is used as it is.
///
/// # Errors
/// Broken UTF-16, decimal commas beside decimal points, or a named separator that is not there.
pub fn plain_csv(
    file: &Path,
    bytes: Vec<u8>,
    separator: Option<Separator>,
) -> Result<(Vec<u8>, Dialect), Error> {
    plain_csv_below(file, bytes, separator, 0)
}

/// The same of the table below this many lines, which are left out.
///
/// # Errors
/// As [`plain_csv`].
pub(crate) fn plain_csv_below(
    file: &Path,
    bytes: Vec<u8>,
    separator: Option<Separator>,
    skipped: usize,
) -> Result<(Vec<u8>, Dialect), Error> {
    source_file::expect_lines(file, &bytes)?;
    let (text, encoding) = decode(file, bytes)?;
    let text = without_lines(text, skipped);
    let start = table_start::find(text.trim_start_matches('\u{feff}'), separator);
    if let Some(named) = separator {
        expect_separator(file, &text, named)?;
    }
    let separator = start.separator;
    let rows_from = start.lines_before + 1 + start.units;
    let decimal_comma =
        separator != Separator::Character(',') && has_decimal_commas(file, &text, separator, rows_from)?;
    let dialect = Dialect { encoding, separator, decimal_comma, lines_before: start.lines_before };
    let text = without_lines(text, start.lines_before);
    let header = text.lines().nth(start.lines_before).unwrap_or_default();
    let names = start.names.clone().unwrap_or_else(|| fields(header, separator));
    // A separator at the end of the header makes no column.
    let ends_with_separator = names.len() > 1 && names.last().is_some_and(String::is_empty);
    let is_plain = separator == Separator::Character(',') && !ends_with_separator && start.names.is_none();
    // One character at a time is found with vector instructions, several are not.
    if is_plain && !GROUPS.iter().any(|bracket| text.contains(*bracket)) {
        return Ok((text.into_bytes(), dialect));
    }
    let columns = names.len() - usize::from(ends_with_separator);
    let mut csv = String::with_capacity(text.len());
    for (index, line) in text.lines().enumerate() {
        let mut fields = match index.checked_sub(start.lines_before) {
            Some(0) => names.clone(),
            Some(below) if below <= start.units => Vec::new(),
            _ => fields(line, separator),
        };
        if fields.len() == columns + 1 && fields[columns].is_empty() {
            fields.pop();
        }
        for (k, field) in fields.iter().enumerate() {
            csv.push_str(if k > 0 { "," } else { "" });
            if decimal_comma && is_number_with(',', field) {
                csv.push_str(&field.replace(',', "."));
            } else {
                csv.push_str(&quoted(field));
            }
        }
        csv.push('\n');
    }
    Ok((csv.into_bytes(), dialect))
}

/// Error if the columns have another separator than the user stated.
fn expect_separator(file: &Path, text: &str, named: Separator) -> Result<(), Error> {
    let recognised = table_start::find(text.trim_start_matches('\u{feff}'), None);
    let line = text.lines().nth(recognised.lines_before).unwrap_or_default();
    let parts = |separator| fields(line, separator).len();
    if parts(named) < 2 && parts(recognised.separator) > 1 {
        let found = recognised.separator.to_string();
        let problem = Problem::OtherSeparator { named: named.to_string(), found };
        return Err(Error::at_line(file, recognised.lines_before as u64 + 1, problem));
    }
    Ok(())
}

/// A table in a file as plain CSV, however it was written.
///
/// # Errors
/// As [`plain_csv`], and a file that cannot be read.
pub fn plain_file(file: &Path) -> Result<Vec<u8>, Error> {
    Ok(plain_csv(file, source_file::bytes(file)?, None)?.0)
}

/// A field in the form of plain CSV.
pub(crate) fn quoted(field: &str) -> Cow<'_, str> {
    if field.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", field.replace('"', "\"\"")).into()
    } else {
        field.into()
    }
}

/// The text with its first lines emptied, so that the others keep their numbers.
fn without_lines(text: String, count: usize) -> String {
    if count == 0 {
        return text;
    }
    let body = text.trim_start_matches('\u{feff}');
    // More than there are leave nothing.
    let count = count.min(body.lines().count());
    let length: usize = body.split_inclusive('\n').take(count).map(str::len).sum();
    "\n".repeat(count) + &body[length..]
}

/// Whether numbers have decimal commas.
fn has_decimal_commas(file: &Path, text: &str, separator: Separator, from: usize) -> Result<bool, Error> {
    let (mut comma, mut point) = (None, None);
    for (index, line) in text.lines().enumerate().skip(from) {
        for field in fields(line, separator) {
            if is_number_with(',', &field) {
                comma.get_or_insert((index, field));
            } else if is_number_with('.', &field) {
                point.get_or_insert((index, field));
            }
        }
        if let (Some((_, comma)), Some((_, point))) = (&comma, &point) {
            let problem = Problem::MixedDecimals { comma: comma.clone(), point: point.clone() };
            return Err(Error::at_line(file, index as u64 + 1, problem));
        }
    }
    Ok(comma.is_some())
}

/// Whether a field is a number with exactly one such decimal sign.
fn is_number_with(decimal: char, field: &str) -> bool {
    let Some((whole, fraction)) = field.split_once(decimal) else {
        return false;
    };
    let whole = whole.strip_prefix(['-', '+']).unwrap_or(whole);
    let mantissa = fraction.split(['e', 'E']).next().unwrap_or("");
    let digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    digits(whole)
        && digits(mantissa)
        && whole.len() + mantissa.len() > 0
        && format!("0{whole}.{fraction}").parse::<f64>().is_ok()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    fn plain(bytes: &[u8]) -> (String, String) {
        let (csv, dialect) = plain_csv(Path::new("robot.csv"), bytes.to_vec(), None).unwrap();
        (String::from_utf8(csv).unwrap(), dialect.to_string())
    }

    fn utf16(text: &str, bytes_of: fn(u16) -> [u8; 2]) -> Vec<u8> {
        text.encode_utf16().flat_map(bytes_of).collect()
    }

    #[test]
    fn semicolons_and_decimal_commas_become_plain() {
        let (csv, said) = plain(b"t;X;Y;name;\r\n1,000063982;-2,5;3;\"a;b\";\r\n,5;1e-3;+7,;x;\r\n");
        assert_eq!(csv, "t,X,Y,name\n1.000063982,-2.5,3,a;b\n.5,1e-3,+7.,x\n");
        assert_eq!(said, "semicolons between columns, decimal commas");
    }

    #[test]
    fn tabs_and_blanks_are_recognised() {
        assert_eq!(
            plain(b"a\tb\n1\t2.5\n"),
            ("a,b\n1,2.5\n".into(), "tabs between columns, decimal points".into())
        );
        assert_eq!(
            plain(b"a  b\n 1   2 \n"),
            ("a,b\n1,2\n".into(), "blanks between columns, decimal points".into())
        );
        let dialect = plain_csv(Path::new("f"), b"a,b\n1,2\n".to_vec(), None).unwrap().1;
        assert!(dialect.is_plain());
    }

    #[test]
    fn utf16_is_read_with_and_without_a_mark_and_windows_1252_as_such() {
        let text = "zeit;X\n0;1,5\n1;2,5\n";
        let expected = "zeit,X\n0,1.5\n1,2.5\n";
        for (mark, bytes_of) in [
            (vec![0xff, 0xfe], u16::to_le_bytes as fn(u16) -> [u8; 2]),
            (vec![0xfe, 0xff], u16::to_be_bytes),
            (vec![], u16::to_le_bytes),
            (vec![], u16::to_be_bytes),
        ] {
            let (csv, said) = plain(&[mark, utf16(text, bytes_of)].concat());
            assert_eq!((csv.as_str(), said.contains("UTF-16")), (expected, true));
        }
        let (csv, said) = plain(b"A [\xb0];X\n1;2\n");
        assert_eq!((csv.as_str(), said.contains("Windows-1252")), ("A [°],X\n1,2\n", true));
        // 0x80 is the sign of the euro there, and a control character in Latin-1.
        assert_eq!(plain(b"\x80,X\xe4\n1,2\n").0, "€,Xä\n1,2\n");
        assert!(plain_csv(Path::new("f"), vec![0xff, 0xfe, 0x41, 0x00, 0x42], None).is_err());
    }

    #[test]
    fn text_of_a_japanese_controller_is_recognised() {
        // "とき" (time) and "位置" (position).
        let (csv, said) = plain(b"\x82\xc6\x82\xab,\x88\xca\x92u\n1,2\n");
        assert_eq!((csv.as_str(), said.contains("Shift JIS")), ("とき,位置\n1,2\n", true));
        // Half a character is none of Shift JIS.
        assert!(plain(b"\x82\xc6\x82,X\n1,2\n").1.contains("Windows-1252"));
    }

    #[test]
    fn decimal_commas_beside_points_are_refused_at_their_line() {
        let error = plain_csv(Path::new("f.csv"), b"a;b\n1,5;2\n3;2.5\n".to_vec(), None).unwrap_err();
        assert_eq!(
            error.to_string(),
            "f.csv, line 3: decimal commas (`1,5`) and decimal points (`2.5`) in one file"
        );
        // A thousands separator is not part of a number; the text stays as in the file.
        let (csv, _) = plain(b"a;b\n1.234,5;2,5\n");
        assert_eq!(csv, "a,b\n\"1.234,5\",2.5\n");
    }
}
