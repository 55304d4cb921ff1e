//! Clouds of points in base, as files, written point by point.

#[cfg(feature = "e57")]
mod e57_file;
#[cfg(feature = "las")]
mod las_file;
#[cfg(feature = "parquet")]
mod parquet_file;
mod pcd_file;
mod ply_file;
mod point;
mod rows;

pub use point::{CloudColumns, CloudPoint, CloudSink};

use std::fs::File;
use std::io;
use std::path::Path;

/// A file of points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CloudForm {
    /// Binary PLY: coordinates and time in double precision.
    Ply,
    /// Binary PCD 0.7: coordinates in single precision, as PCL reads them.
    Pcd,
    /// LAS 1.4, point format 6: coordinates to 1 µm; intensity to whole numbers.
    Las,
    /// E57.
    E57,
    /// Parquet.
    Parquet,
}

impl CloudForm {
    /// All forms, with the endings of their files.
    pub const ALL: [(Self, &'static str); 5] = [
        (Self::Ply, "ply"),
        (Self::Pcd, "pcd"),
        (Self::Las, "las"),
        (Self::E57, "e57"),
        (Self::Parquet, "parquet"),
    ];

    /// The form of a file's name.
    #[must_use]
    pub fn of(file: &Path) -> Option<Self> {
        let ending = file.extension()?.to_str()?;
        Self::ALL.into_iter().find(|(_, known)| ending.eq_ignore_ascii_case(known)).map(|(form, _)| form)
    }

    /// Whether this program was built with it.
    #[must_use]
    pub fn is_built_in(self) -> bool {
        match self {
            Self::Ply | Self::Pcd => true,
            Self::Las => cfg!(feature = "las"),
            Self::E57 => cfg!(feature = "e57"),
            Self::Parquet => cfg!(feature = "parquet"),
        }
    }

    /// Columns that the format cannot hold.
    #[must_use]
    pub fn leaves_out(self, columns: CloudColumns) -> Vec<&'static str> {
        let no_place = matches!(self, Self::Las | Self::E57);
        let list = [(columns.sigma && no_place, "sigma"), (columns.frame && no_place, "frame")];
        list.into_iter().filter_map(|(is_left, name)| is_left.then_some(name)).collect()
    }
}

/// Writes a file of points; `fill` hands them over. The file must be empty, and open for reading as well.
///
/// # Errors
/// Error of `fill`, of the operating system or of the format's library; a form that is not built in.
pub fn write<E: From<io::Error>>(
    file: &File,
    form: CloudForm,
    columns: CloudColumns,
    fill: &mut dyn FnMut(&mut dyn CloudSink) -> Result<(), E>,
) -> Result<(), E> {
    match form {
        CloudForm::Ply => ply_file::write(file, columns, fill),
        CloudForm::Pcd => pcd_file::write(file, columns, fill),
        #[cfg(feature = "las")]
        CloudForm::Las => las_file::write(file, columns, fill),
        #[cfg(feature = "e57")]
        CloudForm::E57 => e57_file::write(file, columns, fill),
        #[cfg(feature = "parquet")]
        CloudForm::Parquet => parquet_file::write(file, columns, fill),
        #[cfg(not(all(feature = "las", feature = "e57", feature = "parquet")))]
        _ => Err(io::Error::from(io::ErrorKind::Unsupported).into()),
    }
}
