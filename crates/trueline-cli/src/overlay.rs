//! Pictures that show a person what was found in a frame.

use crate::failure::Failure;
use std::path::Path;
use trueline_dataset::{WholeFolder, gray_png};
use trueline_vision::overlay::Canvas;
use trueline_vision::scan::{ExaminedPicture, ScanError};

/// A new folder for such pictures.
pub(crate) struct OverlayFolder {
    whole: WholeFolder,
    /// Every how many pictures one is drawn.
    every: usize,
}

impl OverlayFolder {
    /// Begins the folder.
    pub(crate) fn create(folder: &Path, every: usize, replace: bool) -> Result<Self, Failure> {
        Ok(Self { whole: WholeFolder::begin(folder, replace)?, every })
    }

    /// Gives the folder its name.
    pub(crate) fn finish(self) -> Result<(), Failure> {
        Ok(self.whole.finish()?)
    }

    /// Draws a picture with its line segments and its seam, if it is one that is drawn; a picture without a seam says
    /// so in its name.
    pub(crate) fn draw(&self, picture: &ExaminedPicture<'_>) -> Result<(), ScanError> {
        if !picture.number.is_multiple_of(self.every) {
            return Ok(());
        }
        let seams = picture.found.iter().flat_map(|found| found.seams());
        let canvas = Canvas::of_examined(picture.image, picture.detector, seams);
        let found = if picture.found.is_ok() { "" } else { "-not-found" };
        let file = self.whole.path().join(format!("{:06}{found}.png", picture.number));
        Ok(gray_png::write_rgb(&file, canvas.size(), canvas.rgb())?)
    }
}
