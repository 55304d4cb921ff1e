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
    /// Warnings.
    pub warnings: &'a [Remark],
    /// Pictures: file, SHA-256, and the reason for a missing board.
    pub files: Vec<(String, String, Option<String>)>,
}

impl CameraReport<'_> {
    /// The rejected pictures, with the reason: those without a board, and those that do not fit the others.
    #[must_use]
    pub fn not_used(&self) -> Vec<(String, String)> {
        let mut views = self.fit.used.iter();
        let why = |(file, _, reason): &(String, String, Option<String>)| match reason {
            Some(reason) => Some((file.clone(), reason.clone())),
            None => {
                let counts = views.next().is_none_or(|corners| corners.contains(&true));
                (!counts).then(|| (file.clone(), "it is an outlier".to_owned()))
            }
        };
        self.files.iter().filter_map(why).collect()
    }
}
