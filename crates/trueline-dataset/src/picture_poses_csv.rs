//! Pictures that were taken where the robot stood still: `picture,x_mm,y_mm,z_mm,qw,qx,qy,qz`, with rotations in any form of
//! `rotation_columns`.

use crate::error::{Error, Problem};
use crate::rotation_columns::RotationColumns;
use crate::table::{ColumnSpec, Header, required};
use crate::unit::Quantity;
use nalgebra::Vector3;
use std::path::Path;
use trueline_geometry::{Pose, se3};

const PICTURE: usize = 0;
const POSITION: [usize; 3] = [1, 2, 3];
/// Where the columns of the rotation begin.
const ROTATION: usize = 4;

const COLUMNS: [ColumnSpec<'static>; 4] = [
    required("picture", Quantity::Text),
    required("x", Quantity::Length),
    required("y", Quantity::Length),
    required("z", Quantity::Length),
];

/// A picture and where the tool was.
#[derive(Clone, Debug, PartialEq)]
pub struct PicturePose {
    /// The picture's file, as the table names it.
    pub picture: String,
    /// The tool's pose.
    pub base_from_tool: Pose,
}

/// Reads pictures and poses.
///
/// # Errors
/// A table that is broken or empty, a picture without a name, and one that is named twice.
pub fn read(file: &Path, bytes: &[u8]) -> Result<Vec<PicturePose>, Error> {
    let header = Header::read(file, bytes)?;
    let rotation_columns = RotationColumns::find(header.names()).map_err(|problem| header.error(problem))?;
    let specs: Vec<ColumnSpec<'_>> = COLUMNS.into_iter().chain(rotation_columns.specs()).collect();
    let mut table = header.find(&specs)?;
    let mut poses: Vec<PicturePose> = Vec::new();
    while table.next_row()? {
        let picture = table.text(PICTURE).unwrap_or_default().to_owned();
        if picture.is_empty() || poses.iter().any(|other| other.picture == picture) {
            return Err(table.error_in(PICTURE, Problem::NotAFileName { text: picture }));
        }
        let mut position = Vector3::zeros();
        for (value, column) in position.iter_mut().zip(POSITION) {
            *value = table.required_number(column)?;
        }
        let rotation = rotation_columns.read(&table, ROTATION)?;
        poses.push(PicturePose { picture, base_from_tool: se3::from_parts(rotation, position) });
    }
    if poses.is_empty() {
        return Err(Error::in_file(file, Problem::NoRows));
    }
    Ok(poses)
}
