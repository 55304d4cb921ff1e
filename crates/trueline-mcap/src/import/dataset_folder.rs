//! A dataset folder that appears as a whole or not at all.

use crate::import::recorded_pictures::RecordedPictures;
use crate::import::to_recording::Imported;
use crate::import_error::ImportError;
use crate::message::content::Picture;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use trueline_dataset::{
    Error, FrameFile, FrameStamp, PictureSource, Problem, folder, gray_picture, gray_png, images,
};

/// A folder in the making, beside where it is to be.
pub struct DatasetFolder {
    target: PathBuf,
    unfinished: PathBuf,
    finished: bool,
}

impl DatasetFolder {
    /// Begins; the target must not exist, or be empty.
    ///
    /// # Errors
    /// A target that exists, or cannot be made.
    pub fn begin(target: &Path) -> Result<Self, ImportError> {
        let exists = |file: &Path| ImportError::Dataset(Error::in_file(file, Problem::AlreadyExists));
        let is_free = match fs::read_dir(target) {
            Ok(mut entries) => entries.next().is_none(),
            Err(error) => error.kind() == io::ErrorKind::NotFound,
        };
        if !is_free {
            return Err(exists(target));
        }
        let mut name = target.file_name().unwrap_or_default().to_owned();
        name.push(".unfinished");
        let unfinished = target.with_file_name(name);
        if let Some(parent) = target.parent() {
            fs::create_dir_all(parent).map_err(|error| ImportError::io(parent, &error))?;
        }
        fs::create_dir(&unfinished).map_err(|error| match error.kind() {
            io::ErrorKind::AlreadyExists => exists(&unfinished),
            _ => ImportError::io(&unfinished, &error),
        })?;
        Ok(Self { target: target.to_owned(), unfinished, finished: false })
    }

    /// Writes a recording and gives the folder its name.
    ///
    /// # Errors
    /// What the operating system says; then there is no folder.
    pub fn write(self, imported: &Imported) -> Result<(), ImportError> {
        folder::write(&self.unfinished, &imported.recording)?;
        if let Some(text) = &imported.sensor_toml {
            // In its own words: written again, numbers would lose their last digit.
            let file = self.unfinished.join("sensor.toml");
            fs::write(&file, text).map_err(|error| ImportError::io(&file, &error))?;
        }
        if !imported.profiles.is_empty() {
            folder::write_profiles(&self.unfinished, &imported.profiles)?;
        }
        if let Some(pictures) = &imported.pictures {
            self.write_pictures(pictures)?;
        }
        self.finish()
    }

    fn write_pictures(&self, pictures: &RecordedPictures) -> Result<(), ImportError> {
        let images = self.unfinished.join("images");
        fs::create_dir_all(&images).map_err(|error| ImportError::io(&images, &error))?;
        let mut rows = Vec::new();
        for number in 0..pictures.count() {
            let name = PathBuf::from(format!("{number:06}.png"));
            let file = images.join(&name);
            match pictures.recorded(number)? {
                Picture::Png(bytes) => {
                    fs::write(&file, bytes).map_err(|error| ImportError::io(&file, &error))?;
                }
                Picture::Compressed(bytes) => {
                    gray_png::write(&file, &gray_picture::decode(&file, &bytes)?)?;
                }
                Picture::Gray(image) => gray_png::write(&file, &image)?,
            }
            let FrameStamp { stamp_ns, frame, device_ns } = pictures.stamp(number);
            rows.push(FrameFile { stamp_ns, frame, device_ns, path: name });
        }
        Ok(images::write_index(&self.unfinished, &rows)?)
    }

    /// Gives the folder its name.
    fn finish(mut self) -> Result<(), ImportError> {
        // An empty folder may be in the way; where there is none, there is nothing to remove.
        drop(fs::remove_dir(&self.target));
        fs::rename(&self.unfinished, &self.target).map_err(|error| ImportError::io(&self.target, &error))?;
        self.finished = true;
        Ok(())
    }
}

impl Drop for DatasetFolder {
    fn drop(&mut self) {
        if !self.finished {
            // It is told already why there is no dataset.
            drop(fs::remove_dir_all(&self.unfinished));
        }
    }
}
