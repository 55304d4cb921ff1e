//! A dataset folder that appears as a whole or not at all.

use crate::import::recorded_pictures::RecordedPictures;
use crate::import::to_recording::Imported;
use crate::import_error::ImportError;
use crate::message::content::Picture;
use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};
use trueline_dataset::{
    FrameFile, FrameStamp, GrayImage, PictureSource, ProfileForm, WholeFolder, folder, gray_picture,
    gray_png, images,
};

/// A dataset folder in the making.
pub struct DatasetFolder(WholeFolder);

impl DatasetFolder {
    /// Begins; the target must not exist, or be empty, unless it may be replaced.
    ///
    /// # Errors
    /// As [`WholeFolder::begin`].
    pub fn begin(target: &Path, replace: bool) -> Result<Self, ImportError> {
        Ok(Self(WholeFolder::begin(target, replace)?))
    }

    /// Writes a recording and gives the folder its name. Returns where a former one is kept.
    ///
    /// # Errors
    /// Error of the operating system; then there is no folder.
    pub fn write(self, imported: &Imported) -> Result<Option<PathBuf>, ImportError> {
        folder::write(self.0.path(), &imported.recording)?;
        if let Some(text) = &imported.sensor_toml {
            // In its own words: written again, numbers would lose their last digit.
            let file = self.0.path().join("sensor.toml");
            fs::write(&file, text).map_err(|error| ImportError::io(&file, &error))?;
        }
        if !imported.profiles.is_empty() {
            folder::write_profiles(self.0.path(), &imported.profiles, ProfileForm::Csv)?;
        }
        if let Some(pictures) = &imported.pictures {
            self.write_pictures(pictures)?;
        }
        Ok(self.0.finish()?)
    }

    fn write_pictures(&self, pictures: &RecordedPictures) -> Result<(), ImportError> {
        let images = self.0.path().join("images");
        fs::create_dir_all(&images).map_err(|error| ImportError::io(&images, &error))?;
        let mut rows = Vec::new();
        for number in 0..pictures.count() {
            let name = PathBuf::from(format!("{number:06}.png"));
            let file = images.join(&name);
            match pictures.recorded(number)? {
                Picture::Png(bytes) => match stored_image(&file, &bytes) {
                    Some(image) => gray_png::write(&file, &image)?,
                    None => fs::write(&file, bytes).map_err(|error| ImportError::io(&file, &error))?,
                },
                Picture::Compressed(bytes) => {
                    gray_png::write(&file, &gray_picture::decode(&file, &bytes)?)?;
                }
                Picture::Gray(image) => gray_png::write(&file, &image)?,
            }
            let FrameStamp { stamp_ns, frame, device_ns } = pictures.stamp(number);
            rows.push(FrameFile { stamp_ns, frame, device_ns, path: name });
        }
        Ok(images::write_index(self.0.path(), &rows)?)
    }
}

/// A picture with pixels stored uncompressed, because its recording compresses them. A file of its own must be compressed.
/// One that cannot be decoded is passed on unchanged, and reported by its reader.
fn stored_image(file: &Path, png: &[u8]) -> Option<GrayImage> {
    gray_png::is_stored(png).then(|| gray_png::decode(file, Cursor::new(png), &mut Vec::new()).ok())?
}
