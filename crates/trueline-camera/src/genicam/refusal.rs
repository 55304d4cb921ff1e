//! Why a feature could not be read or set.

use crate::error::CameraError;
use std::io;
use telegenic::{CameraError as Driver, GenicamError};

/// Why a feature could not be read or set.
#[derive(Debug)]
pub(crate) struct Refusal {
    /// In our words.
    pub error: Box<CameraError>,
    /// Its author.
    pub by: RefusedBy,
}

/// Author of a refusal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RefusedBy {
    /// The camera is not there any more: a command was repeated and never answered.
    Silence,
    /// The camera, or the wire to it.
    Camera,
    /// The camera's description: there is no such feature, or it does not accept this value.
    Description,
}

impl Refusal {
    /// Of a feature, in the driver's words.
    pub(crate) fn of(name: &str, error: &GenicamError) -> Self {
        let by = match error {
            error if is_silence(error) => RefusedBy::Silence,
            GenicamError::Camera(_) => RefusedBy::Camera,
            _ => RefusedBy::Description,
        };
        let error = match error {
            GenicamError::Camera(error) => driver(name, error),
            other => CameraError::Feature { name: name.to_owned(), why: other.to_string() },
        };
        Self { error: Box::new(error), by }
    }

    /// Whether the camera is not there any more.
    pub(crate) fn is_silence(&self) -> bool {
        self.by == RefusedBy::Silence
    }
}

impl From<Refusal> for CameraError {
    fn from(refusal: Refusal) -> Self {
        *refusal.error
    }
}

/// An error of the driver, and the action.
pub(crate) fn driver(doing: &str, error: &Driver) -> CameraError {
    match error {
        Driver::Io(e) => CameraError::Io(io::Error::new(e.kind(), format!("{doing}: {e}"))),
        other => CameraError::Feature { name: doing.to_owned(), why: other.to_string() },
    }
}

/// Whether an error means that the camera is not there any more: a command was repeated and never answered.
pub(crate) fn is_silence(error: &GenicamError) -> bool {
    matches!(
        error,
        GenicamError::Camera(Driver::Timeout | Driver::Disconnected | Driver::ControlLost | Driver::Io(_))
    )
}
