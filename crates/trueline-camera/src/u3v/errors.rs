//! Errors of the wire, in our words.

use crate::error::CameraError;
use std::io;
use telegenic::CameraError as Driver;
use viva_u3v::U3vError;

/// An error of a device, and the action.
pub(super) fn of_device(device: &str, doing: &str, error: &U3vError) -> CameraError {
    CameraError::Usb { device: device.to_owned(), why: format!("{doing}: {error}") }
}

/// An error of a register, in the form for the driver of features.
pub(super) fn of_register(error: &U3vError) -> Driver {
    match error {
        U3vError::Disconnected => Driver::Disconnected,
        U3vError::Timeout => Driver::Timeout,
        error if is_silence(error) => Driver::Io(io::Error::other(error.to_string())),
        error => Driver::Protocol(error.to_string()),
    }
}

/// Whether an error may mean that the camera is gone: there was no answer.
pub(super) fn is_silence(error: &U3vError) -> bool {
    matches!(
        error,
        U3vError::Disconnected
            | U3vError::Timeout
            | U3vError::Usb(_)
            | U3vError::Cancelled
            | U3vError::Stalled { .. }
    )
}
