//! A folder of pictures with the findings of a frame, for people.

use crate::overlay::Canvas;
use crate::scan::{ExaminedPicture, ScanError};
use std::path::{Path, PathBuf};
use trueline_dataset::{Error, WholeFolder, gray_png};

/// A new folder for such pictures; it appears whole or not at all.
#[derive(Debug)]
pub struct OverlayFolder {
    whole: WholeFolder,
    /// Every how many pictures one is drawn.
    every: usize,
}

impl OverlayFolder {
    /// Begins the folder.
    ///
    /// # Errors
    /// A folder that has something in it, unless it may be replaced, or that cannot be made.
    pub fn create(folder: &Path, every: usize, replace: bool) -> Result<Self, Error> {
        Ok(Self { whole: WholeFolder::begin(folder, replace)?, every })
    }

    /// Gives the folder its name. Returns where a former one is kept.
    ///
    /// # Errors
    /// As of [`WholeFolder::finish`].
    pub fn finish(self) -> Result<Option<PathBuf>, Error> {
        self.whole.finish()
    }

    /// Draws a picture with its line segments and its seam, if this picture is drawn; the name of a picture without a seam
    /// states this.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn draw(&self, picture: &ExaminedPicture<'_>) -> Result<(), ScanError> {
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
