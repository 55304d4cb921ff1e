//! A dataset folder that appears as a whole or not at all.

use crate::import_error::ImportError;
use crate::message::Picture;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use trueline_dataset::{Error, Problem, gray_png};

/// A folder in the making, beside where it is to be.
pub struct DatasetFolder {
    target: PathBuf,
    unfinished: PathBuf,
    finished: bool,
}

impl DatasetFolder {
    /// Begins; the target must not exist, or be empty.
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

    /// Where files are written to.
    pub fn path(&self) -> &Path {
        &self.unfinished
    }

    /// Writes a picture under a name.
    pub fn write_picture(&self, name: &str, picture: &Picture) -> Result<(), ImportError> {
        let images = self.unfinished.join("images");
        fs::create_dir_all(&images).map_err(|error| ImportError::io(&images, &error))?;
        let file = images.join(name);
        match picture {
            Picture::Png(bytes) => fs::write(&file, bytes).map_err(|error| ImportError::io(&file, &error)),
            Picture::Gray(image) => Ok(gray_png::write(&file, image)?),
        }
    }

    /// Gives the folder its name.
    pub fn finish(mut self) -> Result<(), ImportError> {
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
