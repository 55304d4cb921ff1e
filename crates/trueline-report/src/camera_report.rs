//! A camera's calibration with all that is reported of it.

use trueline_sensor::intrinsics::{CameraFit, CrossValidation, Field, NextPicture};
use trueline_sensor::verdict::Remark;

/// A camera's calibration with all that was found about it.
pub struct CameraReport<'a> {
    /// The fit.
    pub fit: &'a CameraFit,
    /// Uncertainty over the picture.
    pub uncertainty: &'a Field,
    /// Halves against each other.
    pub halves: Option<&'a CrossValidation>,
    /// The picture to take next.
    pub next: Option<&'a NextPicture>,
    /// Why it is not accepted.
    pub reasons: &'a [Remark],
    /// What to mind.
    pub warnings: &'a [Remark],
    /// Pictures: file, SHA-256, and why there is no board.
    pub files: Vec<(String, String, Option<String>)>,
}
