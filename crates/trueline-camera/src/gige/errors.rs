//! What the driver says, in our words.

use crate::error::CameraError;
use std::io;
use std::net::Ipv4Addr;
use telegenic::{CameraError as Driver, GenicamError};

/// An error while the link is made.
pub(crate) fn connecting(error: GenicamError, address: Ipv4Addr) -> CameraError {
    let at = address.to_string();
    match error {
        GenicamError::Camera(Driver::ConnectTimeout | Driver::Timeout) => CameraError::NotFound { at },
        GenicamError::Camera(Driver::Io(e)) if e.kind() == io::ErrorKind::ConnectionRefused => {
            CameraError::NotFound { at }
        }
        GenicamError::Camera(Driver::ControlDenied) => CameraError::Busy { at },
        GenicamError::Camera(error) => driver("connection", &error),
        other => feature("device description", &other),
    }
}

/// An error of a feature.
pub(super) fn feature(name: &str, error: &GenicamError) -> CameraError {
    match error {
        GenicamError::Camera(error) => driver(name, error),
        other => CameraError::Feature { name: name.to_owned(), why: other.to_string() },
    }
}

/// An error of the driver, and what it was doing.
pub(super) fn driver(doing: &str, error: &Driver) -> CameraError {
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
