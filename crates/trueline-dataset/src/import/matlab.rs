//! Files of MATLAB, version 5 to 7: vectors of equal length are the columns of a table.

use super::mat_file::{self, MatArray};
use crate::error::Error;
use std::collections::BTreeMap;
use std::path::Path;

/// Columns of one length.
type Table = Vec<(String, Vec<f64>)>;

/// The table with the most columns of `wanted`, as CSV. A vector `x_mm` is a column `x_mm`; a matrix `robot` of eight
/// columns is `robot_1` to `robot_8`.
///
/// # Errors
/// A broken file, one without numbers, or one in which two tables could be meant.
pub(crate) fn as_csv(
    file: &Path,
    bytes: &[u8],
    wanted: &dyn Fn(&str) -> usize,
    notes: &mut Vec<String>,
) -> Result<Vec<u8>, Error> {
    const SAVE: &str = "save vectors of numbers: save('log.mat', 'time_s', 'x_mm', …, '-v7')";
    let arrays = mat_file::arrays(bytes)
        .map_err(|fault| Error::unreadable(file, format!("a MATLAB file: {fault}"), SAVE))?;
    let mut tables: BTreeMap<usize, Table> = BTreeMap::new();
    for array in arrays {
        let (rows, columns) = columns(array);
        tables.entry(rows).or_default().extend(columns);
    }
    let sum = |table: &Table| table.iter().map(|(name, _)| wanted(name)).sum::<usize>();
    let most = tables.values().map(sum).max().unwrap_or(0);
    let mut meant = tables.into_iter().filter(|(_, table)| sum(table) == most);
    let Some((rows, table)) = meant.next() else {
        return Err(Error::unreadable(file, "a MATLAB file: it has no vectors of numbers", SAVE));
    };
    if meant.next().is_some() {
        return Err(Error::unreadable(
            file,
            "a MATLAB file: vectors of several lengths could be meant",
            "name the columns: --robot-map time_s=t,x_mm=robot_1,…",
        ));
    }
    let names: Vec<&str> = table.iter().map(|(name, _)| name.as_str()).collect();
    notes.push(format!("{}: {rows} rows of {}", file.display(), names.join(", ")));
    let mut csv = names.join(",") + "\n";
    for row in 0..rows {
        let fields: Vec<String> = table.iter().map(|(_, column)| column[row].to_string()).collect();
        csv.push_str(&fields.join(","));
        csv.push('\n');
    }
    Ok(csv.into_bytes())
}

/// Rows, and columns with their names; a row vector is a column as well.
fn columns(array: MatArray) -> (usize, Table) {
    let (rows, count) = match array.rows {
        1 => (array.columns, 1),
        rows => (rows, array.columns),
    };
    let name = |k: usize| match count {
        1 => array.name.clone(),
        _ => format!("{}_{}", array.name, k + 1),
    };
    // MATLAB stores column by column.
    let columns = array.numbers.chunks_exact(rows.max(1)).enumerate();
    (rows, columns.map(|(k, column)| (name(k), column.to_vec())).collect())
}
