//! Errors of the driver while the link is made, in our words.

use crate::error::CameraError;
use crate::genicam::{Refusal, driver};
use std::io;
use std::net::Ipv4Addr;
use telegenic::{CameraError as Driver, GenicamError};

/// An error while the link is made.
pub(super) fn connecting(error: GenicamError, address: Ipv4Addr) -> CameraError {
    let at = address.to_string();
    match error {
        GenicamError::Camera(Driver::ConnectTimeout | Driver::Timeout) => CameraError::NotFound { at },
        GenicamError::Camera(Driver::Io(e)) if e.kind() == io::ErrorKind::ConnectionRefused => {
            CameraError::NotFound { at }
        }
        GenicamError::Camera(Driver::ControlDenied) => CameraError::Busy { at },
        GenicamError::Camera(error) => driver("connection", &error),
        other => Refusal::of("device description", &other).into(),
    }
}
