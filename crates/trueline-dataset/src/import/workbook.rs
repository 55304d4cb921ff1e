//! Workbooks of Excel (xlsx, xlsb) and LibreOffice (ods): their first sheet as CSV.

use super::workbook_extent;
use crate::error::Error;
use calamine::{Data, Reader, open_workbook_auto_from_rs};
use std::io::Cursor;
use std::path::Path;

/// The first sheet as CSV; which one that is, is noted.
///
/// # Errors
/// A broken workbook, one without a sheet, or one that is far larger than its file.
pub(crate) fn as_csv(file: &Path, bytes: Vec<u8>, notes: &mut Vec<String>) -> Result<Vec<u8>, Error> {
    let broken = |error: String| {
        let hint = "open it and save it again, or export the sheet as CSV";
        Error::unreadable(file, format!("a workbook: {error}"), hint)
    };
    workbook_extent::expect_bounded(&bytes).map_err(|fault| broken(fault.to_string()))?;
    let mut workbook =
        open_workbook_auto_from_rs(Cursor::new(bytes)).map_err(|error| broken(error.to_string()))?;
    workbook_extent::expect_dense(&mut workbook).map_err(|fault| broken(fault.to_string()))?;
    let names = workbook.sheet_names();
    let sheet = workbook
        .worksheet_range_at(0)
        .ok_or_else(|| Error::unreadable(file, "a workbook: it has no sheet", "export the table as CSV"))?
        .map_err(|error| broken(error.to_string()))?;
    let others = match names.len() {
        0 | 1 => String::new(),
        count => format!(", the first of {count}"),
    };
    let name = names.first().map_or("", String::as_str);
    notes.push(format!("{}: sheet `{name}`{others}", file.display()));
    let mut csv = String::new();
    // Rows above the first that is filled keep the numbers of the lines as the program shows them.
    let above = sheet.start().map_or(0, |(row, _)| row as usize);
    csv.push_str(&"\n".repeat(above));
    for row in sheet.rows() {
        csv.push_str(&row.iter().map(cell).collect::<Vec<_>>().join(","));
        csv.push('\n');
    }
    Ok(csv.into_bytes())
}

/// A cell as a field of CSV. A date is not a number of seconds: it is written so that it is refused as a number.
fn cell(data: &Data) -> String {
    match data {
        Data::Empty => String::new(),
        Data::Int(number) => number.to_string(),
        Data::Float(number) => number.to_string(),
        Data::String(text) => format!("\"{}\"", text.replace('"', "\"\"")),
        Data::DateTime(_) | Data::DateTimeIso(_) | Data::DurationIso(_) => "a date".to_owned(),
        Data::Bool(value) => value.to_string(),
        Data::Error(error) => format!("\"{error}\""),
    }
}
