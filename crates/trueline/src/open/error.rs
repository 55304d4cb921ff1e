//! Why a scan cannot be opened.

use crate::open::detector::DetectorError;
use crate::open::nearest::nearest_place;
use std::path::{Path, PathBuf};
use trueline_dataset::join::JoinError;
use trueline_mcap::ImportError;
use trueline_vision::Joint;
use trueline_vision::profile::NoSeam;
use trueline_vision::scan::ScanError;

/// Why a scan cannot be opened.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OpenError {
    /// The path leads nowhere.
    #[error("there is no file or folder `{}`", .0.display())]
    NoPlace(PathBuf),
    /// A file of a dataset in place of its folder.
    #[error("{}: is a file of a dataset", .0.display())]
    PartOfDataset(PathBuf),
    /// A joint is named, but the seam is known already.
    #[error("{}: has its seam points already, so a joint has no effect", .0.display())]
    SeamKnown(PathBuf),
    /// No picture shows a seam.
    #[error("there is no seam in any of {0} pictures")]
    NoSeamInPictures(usize),
    /// No profile shows a seam.
    #[error("there is no seam in any of {profiles} profiles{}", .most.map(|reason| format!(": {reason}")).unwrap_or_default())]
    NoSeamInProfiles {
        /// Number of profiles.
        profiles: usize,
        /// Why most of them have none.
        most: Option<NoSeam>,
    },
    /// A joint that profiles are not searched for.
    #[error("profiles are not searched for a {}", .0.name())]
    NotInProfiles(Joint),
    /// A recording of the robot alone.
    #[error("{}: there are neither pictures nor seam points in it", .0.display())]
    NothingSeen(PathBuf),
    /// A file cannot be used.
    #[error(transparent)]
    File(#[from] trueline_dataset::Error),
    /// A recording in MCAP or rosbag2 cannot be used.
    #[error(transparent)]
    Import(#[from] ImportError),
    /// Pictures cannot be examined.
    #[error(transparent)]
    Pictures(#[from] ScanError),
    /// The sensor's pictures cannot be examined at all.
    #[error("{}: {error}", file.display())]
    Detector {
        /// The sensor's file, or the recording that has it.
        file: PathBuf,
        /// Why.
        error: DetectorError,
    },
    /// Scans that cannot be taken together.
    #[error(transparent)]
    Join(#[from] JoinError),
}

impl OpenError {
    /// The remedy.
    #[must_use]
    pub fn hint(&self) -> String {
        let hint = match self {
            Self::NoPlace(place) => {
                let expected = "give a dataset folder, a recording.mcap or a rosbag2 folder";
                let near = nearest_place(place).map(|near| format!("; did you mean `{}`?", near.display()));
                return format!("{expected}{}", near.unwrap_or_default());
            }
            Self::PartOfDataset(file) => return format!("give its folder: `{}`", folder_of(file).display()),
            Self::SeamKnown(_) => "without a joint the existing seam points are used",
            Self::NoSeamInPictures(_) => "look at some pictures with the overlay of the detected stripes",
            Self::NoSeamInProfiles { most: Some(NoSeam::RoundFace(_)), .. } => {
                "scan two flat faces that meet: a pipe, a ball or a groove has no line for the calibration"
            }
            Self::NoSeamInProfiles { .. } => {
                "name the joint: two faces that meet (fillet, v-groove, corner), a lap, a butt or an edge, which must move in the view"
            }
            Self::NotInProfiles(_) => {
                "profiles are searched for a fillet, v-groove, corner, lap, butt or edge; a step is a lap"
            }
            Self::NothingSeen(_) => "record the camera as well",
            Self::File(error) => return error.hint(),
            Self::Import(error) => return error.hint(),
            Self::Pictures(error) => return hint_of_pictures(error),
            Self::Detector { error, .. } => error.hint(),
            Self::Join(JoinError::PicturesDisagree { pictures, .. }) => pictures.hint(),
            Self::Join(JoinError::TooLong { .. }) => {
                "look for a stamp in another unit, or a wrong one, at the beginning or the end of a recording"
            }
            Self::Join(JoinError::Again { .. }) => "name each scan once: a repeated scan adds no information",
            Self::Join(_) => "scans of different sensors, or set-ups, are calibrated one by one",
        };
        hint.to_owned()
    }
}

/// Remedy if pictures cannot be examined.
#[must_use]
pub fn hint_of_pictures(error: &ScanError) -> String {
    match error {
        ScanError::Read(error) => error.hint(),
        ScanError::NoCamera { .. } => {
            "profilers bring whole profiles along in profiles.csv or profiles.parquet, or features.csv as point sensors do".to_owned()
        }
        ScanError::WrongSize { .. } => {
            "a region of interest moves cx and cy; scaled pictures need scaled intrinsics".to_owned()
        }
        _ => "is the disk full, or the folder read-only?".to_owned(),
    }
}

/// The dataset that a file belongs to.
#[must_use]
pub fn folder_of(file: &Path) -> &Path {
    file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}
