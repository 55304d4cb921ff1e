//! CSV files of any program, by naming which of their columns is which of ours.

use crate::error::{Error, Problem};
use std::fs;
use std::path::Path;

/// Which column of the foreign file holds one of ours, for example `x_mm` ← `pos_x`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ColumnMapping {
    /// Our column, with its unit.
    pub ours: String,
    /// Their column.
    pub theirs: String,
}

/// A foreign table with our names, and the columns that were not asked for.
#[derive(Clone, Debug)]
pub struct RenamedTable {
    /// CSV text with our header; rows keep their line numbers.
    pub csv: Vec<u8>,
    /// Columns of the foreign file that the mapping leaves out.
    pub left_out: Vec<String>,
}

/// Takes the mapped columns of a CSV file and renames them.
///
/// Lines keep their numbers, so later errors point into the foreign file.
///
/// # Errors
/// A missing file, a broken table, or a mapping that names a column the file does not have.
pub fn rename(file: &Path, delimiter: u8, mapping: &[ColumnMapping]) -> Result<RenamedTable, Error> {
    let bytes = fs::read(file).map_err(|error| {
        let missing = error.kind() == std::io::ErrorKind::NotFound;
        Error::in_file(file, if missing { Problem::Missing } else { Problem::Io(error) })
    })?;
    let broken = |error: csv::Error| Error::in_file(file, Problem::Csv(error.to_string()));
    let mut reader =
        csv::ReaderBuilder::new().delimiter(delimiter).trim(csv::Trim::All).from_reader(bytes.as_slice());
    let header = reader.headers().map_err(broken)?.clone();
    let mut indices = Vec::with_capacity(mapping.len());
    for item in mapping {
        let index = header.iter().position(|name| name == item.theirs).ok_or_else(|| {
            let found = header.iter().collect::<Vec<_>>().join(", ");
            Error::at_line(file, 1, Problem::MissingColumn { name: item.theirs.clone(), found })
        })?;
        indices.push(index);
    }
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(mapping.iter().map(|item| &item.ours)).map_err(broken)?;
    for record in reader.records() {
        let record = record.map_err(broken)?;
        writer.write_record(indices.iter().map(|&k| &record[k])).map_err(broken)?;
    }
    let left_out = header.iter().enumerate().filter(|(k, _)| !indices.contains(k));
    let left_out = left_out.map(|(_, name)| name.to_owned()).collect();
    let csv = writer.into_inner().map_err(|error| Error::in_file(file, Problem::Io(error.into_error())))?;
    Ok(RenamedTable { csv, left_out })
}
