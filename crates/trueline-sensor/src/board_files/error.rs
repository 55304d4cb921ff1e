//! Reasons why boards cannot be used.

use std::io;
use std::path::PathBuf;

/// Reasons why boards cannot be read, or nothing can be calibrated with them.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BoardError {
    /// A folder that cannot be listed.
    #[error("{}: cannot be read: {error}", folder.display())]
    Folder {
        /// The folder.
        folder: PathBuf,
        /// An error of the operating system.
        error: io::Error,
    },
    /// Nothing of that name.
    #[error("{}: there is no such folder or picture", .0.display())]
    Missing(PathBuf),
    /// A folder without pictures.
    #[error("{}: there are no pictures", .0.display())]
    NoPictures(PathBuf),
    /// A dataset without pictures.
    #[error("{}: there are no pictures: no images/index.csv, and no poses.csv with a column picture", .0.display())]
    NoIndex(PathBuf),
    /// A picture without pixels.
    #[error("{0}: the picture is empty")]
    Empty(String),
    /// Pictures of different sizes.
    #[error("{} has {} x {} pixels, {} has {} x {}", one.0.display(), one.1[0], one.1[1], other.0.display(), other.1[0], other.1[1])]
    Sizes {
        /// A picture and its size.
        one: (PathBuf, [u32; 2]),
        /// The next one.
        other: (PathBuf, [u32; 2]),
    },
    /// A picture that is not of the camera.
    #[error("{name}: {} x {} pixels, the camera's file has {} x {}", found[0], found[1], camera[0], camera[1])]
    OtherCamera {
        /// The picture.
        name: String,
        /// Its size, px.
        found: [u32; 2],
        /// The camera's, px.
        camera: [u32; 2],
    },
    /// The camera does not move.
    #[error("{}: the sensor stands beside the robot", .0.display())]
    Fixed(PathBuf),
    /// A file cannot be used.
    #[error(transparent)]
    File(#[from] trueline_dataset::Error),
    /// The robot's motion cannot be used.
    #[error(transparent)]
    Motion(#[from] trueline_method::Error),
    /// Nothing can be calibrated with the boards that were seen.
    #[error("{}: {error}{why}", dataset.display())]
    Calibration {
        /// The dataset.
        dataset: PathBuf,
        /// Why not.
        error: crate::Error,
        /// Why pictures show no board, one reason a line.
        why: String,
    },
}

impl BoardError {
    /// Hint for the user.
    #[must_use]
    pub fn hint(&self) -> String {
        match self {
            Self::Folder { .. } => "check the path".to_owned(),
            Self::Missing(_) => "name a folder of pictures, or the pictures".to_owned(),
            Self::NoPictures(_) => "pictures are .png, .jpg or .jpeg".to_owned(),
            Self::NoIndex(_) => {
                "record robot and camera while the sensor looks at the board, the laser off".to_owned()
            }
            Self::Empty(_) => "is the file cut off?".to_owned(),
            Self::Sizes { one, other } if one.1[0] == other.1[1] && one.1[1] == other.1[0] => {
                "one was turned on its side after it was taken: turn it back, or leave it out".to_owned()
            }
            Self::Sizes { .. } => "all pictures must be of one camera and one setting".to_owned(),
            Self::OtherCamera { .. } => {
                "check that the pictures come from the camera of the sensor's file, at the same setting"
                    .to_owned()
            }
            Self::Fixed(_) => "a board that stands still is for a camera on the robot".to_owned(),
            Self::File(error) => error.hint(),
            Self::Motion(error) => error.hint().to_owned(),
            Self::Calibration { error, .. } => error.hint().to_owned(),
        }
    }
}
