//! Kind of data at a path.

use crate::open::error::OpenError;
use std::path::{Path, PathBuf};

/// The name of a recording in its folder.
const RECORDING: &str = "recording.mcap";

/// Kind of data at a path.
pub(crate) enum Place {
    /// A dataset folder.
    Folder,
    /// A recording in MCAP or rosbag2.
    Recording(PathBuf),
}

/// Finds the kind of data at a path.
///
/// # Errors
/// The two mistakes that are made most: a name that is mistyped, and a file instead of its folder.
pub(crate) fn of(path: &Path) -> Result<Place, OpenError> {
    if !path.exists() {
        return Err(OpenError::NoPlace(path.to_owned()));
    }
    if path.is_file() {
        let of_dataset = path.extension().is_some_and(|end| end == "csv" || end == "toml");
        return match of_dataset {
            true => Err(OpenError::PartOfDataset(path.to_owned())),
            false => Ok(Place::Recording(path.to_owned())),
        };
    }
    let is_dataset = path.join("robot.csv").exists();
    let inside = path.join(RECORDING);
    Ok(match () {
        () if is_dataset => Place::Folder,
        () if inside.exists() => Place::Recording(inside),
        () if path.join("metadata.yaml").exists() => Place::Recording(path.to_owned()),
        () => Place::Folder,
    })
}
