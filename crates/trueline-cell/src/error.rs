//! Why a cell cannot be recorded.

use std::net::Ipv4Addr;
use std::path::PathBuf;
use trueline_camera::CameraError;
use trueline_mcap::RecordError;
use trueline_vision::Joint;

/// Why a cell cannot be recorded.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CellError {
    /// The camera cannot be used.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// The recording cannot be made.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// The folder of the recording cannot be made.
    #[error("{}: cannot be written: {why}", folder.display())]
    Folder {
        /// The folder.
        folder: PathBuf,
        /// Message of the operating system.
        why: std::io::Error,
    },
    /// The camera's pictures are not of the size that the sensor was calibrated for.
    #[error("{name} delivers {} x {} px, sensor.toml states {} x {}", found[0], found[1], expected[0], expected[1])]
    PictureSize {
        /// The camera.
        name: String,
        /// Columns and rows that it gives, px.
        found: [usize; 2],
        /// Columns and rows of the calibrated camera, px.
        expected: [usize; 2],
    },
    /// A joint that profiles are not searched for.
    #[error("profiles are not searched for a {}", joint.name())]
    NotInProfiles {
        /// The joint.
        joint: Joint,
    },
    /// The camera has no clock that can be read.
    #[error("{name} cannot report its time")]
    NoCameraClock {
        /// The camera.
        name: String,
    },
    /// Built without the feature `gige`.
    #[error("{address}: this program was built without GigE Vision")]
    NoGigE {
        /// The camera.
        address: Ipv4Addr,
    },
}

impl CellError {
    /// Hint for the user.
    #[must_use]
    pub fn hint(&self) -> String {
        match self {
            Self::Camera(error) => error.hint(),
            Self::Record(error) => error.hint(),
            Self::Folder { .. } => "check the path and its permissions".to_owned(),
            Self::PictureSize { .. } => {
                "a region of interest moves cx and cy; scaled pictures need scaled intrinsics".to_owned()
            }
            Self::NotInProfiles { .. } => {
                "profiles are searched for a fillet, v-groove, corner, lap, butt or edge; a step is a lap"
                    .to_owned()
            }
            Self::NoCameraClock { .. } => {
                "stamp pictures by the arrival of their first packet: that needs nothing of the camera"
                    .to_owned()
            }
            Self::NoGigE { .. } => "build it with the feature `gige`".to_owned(),
        }
    }
}
