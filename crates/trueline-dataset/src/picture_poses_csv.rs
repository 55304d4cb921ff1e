//! Poses of a standing robot: `picture,x_mm,y_mm,z_mm,qw,qx,qy,qz` with pictures, else `stop,x_mm,…`; rotations in any
//! form of `rotation_columns`.

use crate::error::{Error, Problem};
use crate::rotation_columns::RotationColumns;
use crate::table::{ColumnSpec, Header, required};
use crate::unit::Quantity;
use nalgebra::Vector3;
use std::path::Path;
use trueline_geometry::{Pose, se3};

const PICTURE: usize = 0;
const POSITION: [usize; 3] = [1, 2, 3];
/// First column of the rotation.
const ROTATION: usize = 4;

/// The column that names the picture of a stop.
pub const PICTURE_COLUMN: &str = "picture";
/// Columns that name stops.
pub(crate) const COLUMNS_OF_NAMES: [&str; 2] = ["stop", PICTURE_COLUMN];

const PLACE: [ColumnSpec<'static>; 3] =
    [required("x", Quantity::Length), required("y", Quantity::Length), required("z", Quantity::Length)];

/// The column of a header that names stops.
pub(crate) fn column(names: &[String]) -> &'static str {
    let is_stop = names.iter().any(|name| name == COLUMNS_OF_NAMES[0]);
    COLUMNS_OF_NAMES[usize::from(!is_stop)]
}

/// A stop, by its picture or its number, and where the tool was.
#[derive(Clone, Debug, PartialEq)]
pub struct PicturePose {
    /// The picture's file, or the stop, as the table names it.
    pub picture: String,
    /// Line of the table, from 1.
    pub line: u64,
    /// The tool's pose.
    pub base_from_tool: Pose,
}

/// Reads pictures and poses.
///
/// # Errors
/// A table that is broken or empty, a stop without a name, and one that is named twice.
pub fn read(file: &Path, bytes: &[u8]) -> Result<Vec<PicturePose>, Error> {
    let header = Header::read(file, bytes)?;
    let rotation_columns = RotationColumns::find(header.names()).map_err(|problem| header.error(problem))?;
    let column = column(header.names());
    let name = required(column, Quantity::Text);
    let specs: Vec<ColumnSpec<'_>> =
        [name].into_iter().chain(PLACE).chain(rotation_columns.specs()).collect();
    let mut table = header.find(&specs)?;
    let mut poses: Vec<PicturePose> = Vec::new();
    while table.next_row()? {
        let picture = table.text(PICTURE).unwrap_or_default().to_owned();
        if picture.is_empty() {
            return Err(table.error_in(PICTURE, Problem::NotAFileName { text: picture }));
        }
        if poses.iter().any(|other| is_same(&other.picture, &picture)) {
            let problem = Problem::Value { key: column, expected: "each of them once", found: picture };
            return Err(table.error_in(PICTURE, problem));
        }
        let mut position = Vector3::zeros();
        for (value, column) in position.iter_mut().zip(POSITION) {
            *value = table.required_number(column)?;
        }
        let rotation = rotation_columns.read(&table, ROTATION)?;
        poses.push(PicturePose {
            picture,
            line: table.line(),
            base_from_tool: se3::from_parts(rotation, position),
        });
    }
    if poses.is_empty() {
        return Err(Error::in_file(file, Problem::NoRows));
    }
    Ok(poses)
}

/// Whether two names are of one stop: `3`, `03` and `3.0` are, for programs write numbers in their own way.
pub(crate) fn is_same(one: &str, other: &str) -> bool {
    let bare = |name: &str| name.trim().trim_start_matches("images/").to_owned();
    let number = |name: &str| name.trim().parse::<f64>().ok();
    bare(one) == bare(other) || number(one).is_some_and(|one| Some(one) == number(other))
}

#[cfg(test)]
mod tests {
    use super::is_same;

    #[test]
    fn programs_write_the_number_of_a_stop_in_their_own_way() {
        for (one, other, same) in [
            ("3", "3.0", true),
            ("03", "3", true),
            ("3", "4", false),
            ("a", "a ", true),
            ("images/a.png", "a.png", true),
            ("a.png", "b.png", false),
        ] {
            assert_eq!(is_same(one, other), same, "{one} {other}");
        }
    }
}
