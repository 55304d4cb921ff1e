//! Points of a laser's stripe on several boards: `board,x_mm,y_mm,z_mm`, in the camera frame.

use crate::error::{Error, Problem};
use crate::table::{ColumnSpec, Table, required};
use crate::unit::Quantity;
use nalgebra::Vector3;
use std::collections::BTreeMap;
use std::path::Path;

const COLUMNS: [ColumnSpec; 4] = [
    required("board", Quantity::Count),
    required("x", Quantity::Length),
    required("y", Quantity::Length),
    required("z", Quantity::Length),
];

/// Reads the points of each board, m, by rising number of the board.
///
/// # Errors
/// A table that is broken, empty, or has a board number that is not whole.
pub fn read(file: &Path, bytes: &[u8]) -> Result<BTreeMap<u64, Vec<Vector3<f64>>>, Error> {
    let mut table = Table::open(file, bytes, &COLUMNS)?;
    let mut boards: BTreeMap<u64, Vec<Vector3<f64>>> = BTreeMap::new();
    while table.next_row()? {
        let board = table.count(0)?.unwrap_or_default();
        let mut point = Vector3::zeros();
        for (column, value) in point.iter_mut().enumerate() {
            *value = table.required_number(column + 1)?;
        }
        boards.entry(board).or_default().push(point);
    }
    if boards.is_empty() {
        return Err(Error::in_file(file, Problem::NoRows));
    }
    Ok(boards)
}
