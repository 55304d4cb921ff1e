//! Tables in other formats than CSV: workbooks of Excel and LibreOffice, files of MATLAB, logs of RSI. Files that are no
//! table are reported by their kind.

use super::table_text::TableText;
use crate::error::Error;
use std::path::Path;

/// A file's bytes as text: those of a workbook, of MATLAB or of RSI as CSV, all others unchanged. A note names the table
/// that was used. `wanted` weighs a column: of several tables of MATLAB the one that weighs most is meant.
///
/// # Errors
/// A file that cannot be read as its kind, or a program built without `foreign-tables`.
pub fn as_text(
    file: &Path,
    bytes: Vec<u8>,
    wanted: &dyn Fn(&str) -> usize,
    notes: &mut Vec<String>,
) -> Result<TableText, Error> {
    expect_table(file, &bytes)?;
    match kind(&bytes) {
        None => Ok(bytes.into()),
        Some(Kind::Matlab73) => Err(Error::unreadable(
            file,
            "a MATLAB file of version 7.3",
            "save it in version 7: save('log.mat', '-v7'), or write CSV: writetable",
        )),
        #[cfg(feature = "foreign-tables")]
        Some(Kind::Matlab) => super::matlab::as_csv(file, &bytes, wanted, notes).map(TableText::from),
        #[cfg(feature = "foreign-tables")]
        Some(Kind::Workbook) => super::workbook::as_csv(file, bytes, notes).map(TableText::from),
        #[cfg(feature = "foreign-tables")]
        Some(Kind::Rsi) => super::rsi_xml::as_csv(file, &bytes, notes),
        #[cfg(not(feature = "foreign-tables"))]
        Some(_) => {
            let _ = (wanted, notes);
            let hint = "export the table as CSV; or build trueline with the feature foreign-tables";
            Err(Error::unreadable(file, "no text", hint))
        }
    }
}

/// Kind of a file that is not text.
enum Kind {
    Workbook,
    Matlab,
    Matlab73,
    Rsi,
}

/// Files that are no table: their first bytes, their kind, and a remedy.
const OTHERS: [(&[u8], &str, &str); 14] = [
    (b"\x89MCAP", "a recording in MCAP", "`trueline import mcap FILE --out DIR` reads it"),
    (
        b"SQLite format 3",
        "a data base of SQLite",
        "if it is a rosbag2, `trueline import rosbag2 FILE --out DIR` reads it",
    ),
    (
        b"#ROSBAG",
        "a bag of ROS 1",
        "convert it: rosbags-convert --src FILE --dst BAG, and `trueline import rosbag2 BAG`",
    ),
    (b"\x89PNG", "a picture", "pictures lie in SRC/images, with their stamps in images/index.csv"),
    (b"\xff\xd8\xff", "a picture", "pictures lie in SRC/images, with their stamps in images/index.csv"),
    (b"%PDF", "a PDF", "export the table as CSV"),
    (b"\x1f\x8b", "compressed with gzip", "unpack it first: gunzip FILE"),
    (b"\x28\xb5\x2f\xfd", "compressed with Zstandard", "unpack it first: zstd -d FILE"),
    (b"7z\xbc\xaf", "a 7-zip archive", "unpack it first"),
    (
        b"\x89HDF",
        "an HDF5 file",
        "export the table as CSV; of MATLAB save it in version 7: save('log.mat', '-v7')",
    ),
    (b"<!DOCTYPE html", "a web page", "probably a login page: export the table as CSV"),
    (b"<html", "a web page", "probably a login page: export the table as CSV"),
    (b"{", "JSON", "write one row a pose as CSV: time_s,x_mm,y_mm,z_mm,qw,qx,qy,qz"),
    (b"[", "JSON", "write one row a pose as CSV: time_s,x_mm,y_mm,z_mm,qw,qx,qy,qz"),
];

/// Error with the kind of a file that is no table.
fn expect_table(file: &Path, bytes: &[u8]) -> Result<(), Error> {
    let start = bytes.trim_ascii_start();
    let other = OTHERS
        .iter()
        .find(|(begin, ..)| start.get(..begin.len()).is_some_and(|s| s.eq_ignore_ascii_case(begin)));
    if let Some((begin, what, hint)) = other
        // A pose of KUKA begins with a brace as well, and one of UR or ABB with a bracket.
        && (*begin != b"{" || start[1..].trim_ascii_start().starts_with(b"\""))
        && (*begin != b"[" || start[1..].trim_ascii_start().starts_with(b"{"))
    {
        return Err(Error::unreadable(file, *what, hint));
    }
    if start.starts_with(b"<") && kind(bytes).is_none() {
        let what = format!("XML (it begins with `{}`)", first_words(start));
        return Err(Error::unreadable(
            file,
            what,
            "the only supported XML is the log of KUKA's RSI; export others as CSV",
        ));
    }
    let looked_at = &bytes[..bytes.len().min(4096)];
    let zeros = looked_at.iter().filter(|&&byte| byte == 0).count();
    // UTF-16 has a zero in every second byte.
    let is_wide = zeros * 5 > looked_at.len() * 2
        || bytes.starts_with(&[0xff, 0xfe])
        || bytes.starts_with(&[0xfe, 0xff]);
    if zeros > 0
        && !is_wide
        && kind(bytes).is_none()
        && !bytes.starts_with(b"PAR1")
        && !bytes.starts_with(b"ply")
    {
        let hint = "export it as CSV from the program that wrote it";
        return Err(Error::unreadable(file, "binary data instead of text", hint));
    }
    Ok(())
}

/// The first word of a text, not longer than it is good to read.
fn first_words(start: &[u8]) -> String {
    String::from_utf8_lossy(&start[..start.len().min(40)])
        .split(['>', '\n'])
        .next()
        .unwrap_or_default()
        .to_owned()
}

/// By its first bytes: names lie.
fn kind(bytes: &[u8]) -> Option<Kind> {
    // ZIP (xlsx, xlsb, ods), and the compound file of older Excel.
    if bytes.starts_with(b"PK\x03\x04") || bytes.starts_with(&[0xd0, 0xcf, 0x11, 0xe0]) {
        return Some(Kind::Workbook);
    }
    // Loggers write a line of their own first, or a date before each element.
    if has_rsi(bytes) {
        return Some(Kind::Rsi);
    }
    if bytes.starts_with(b"MATLAB 7.3") {
        return Some(Kind::Matlab73);
    }
    bytes.starts_with(b"MATLAB 5.0").then_some(Kind::Matlab)
}

#[cfg(feature = "foreign-tables")]
fn has_rsi(bytes: &[u8]) -> bool {
    super::rsi_xml::is_rsi(bytes)
}

#[cfg(not(feature = "foreign-tables"))]
fn has_rsi(_: &[u8]) -> bool {
    false
}
