//! Tables that are no text: workbooks of Excel and LibreOffice, and files of MATLAB, as CSV.

use crate::error::Error;
use std::path::Path;

/// A file's bytes as text: those of a workbook or of MATLAB as CSV, all others as they are. What was taken is noted. `wanted` weighs a
/// column: of several tables of MATLAB the one that weighs most is meant.
///
/// # Errors
/// A file that cannot be read as what it is, or a program that was built without `foreign-tables`.
pub fn as_text(
    file: &Path,
    bytes: Vec<u8>,
    wanted: &dyn Fn(&str) -> usize,
    notes: &mut Vec<String>,
) -> Result<Vec<u8>, Error> {
    match kind(&bytes) {
        None => Ok(bytes),
        Some(Kind::Matlab73) => Err(Error::unreadable(
            file,
            "a MATLAB file of version 7.3",
            "save it in version 7: save('log.mat', '-v7'), or write CSV: writetable",
        )),
        #[cfg(feature = "foreign-tables")]
        Some(Kind::Matlab) => super::matlab::as_csv(file, &bytes, wanted, notes),
        #[cfg(feature = "foreign-tables")]
        Some(Kind::Workbook) => super::workbook::as_csv(file, bytes, notes),
        #[cfg(not(feature = "foreign-tables"))]
        Some(_) => {
            let _ = (wanted, notes);
            let hint = "export the table as CSV; or build trueline with the feature foreign-tables";
            Err(Error::unreadable(file, "no text", hint))
        }
    }
}

/// What a file is if it is no text.
enum Kind {
    Workbook,
    Matlab,
    Matlab73,
}

/// By its first bytes: names lie.
fn kind(bytes: &[u8]) -> Option<Kind> {
    // ZIP (xlsx, xlsb, ods), and the compound file of older Excel.
    if bytes.starts_with(b"PK\x03\x04") || bytes.starts_with(&[0xd0, 0xcf, 0x11, 0xe0]) {
        return Some(Kind::Workbook);
    }
    if bytes.starts_with(b"MATLAB 7.3") {
        return Some(Kind::Matlab73);
    }
    bytes.starts_with(b"MATLAB 5.0").then_some(Kind::Matlab)
}
