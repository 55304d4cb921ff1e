//! Features that were found in pictures, kept outside of the dataset: a folder that is only read stays as it was.

use crate::error::{Error, Problem};
use crate::features_csv;
use crate::recording::{Feature, Sensor};
use crate::{images, picture_source::PictureFolder};
use sha2::{Digest, Sha256};
use std::fs;
use std::path::{Path, PathBuf};

/// A folder of features, each file named after everything that it was made from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FeatureCache {
    folder: PathBuf,
}

impl FeatureCache {
    /// In a folder that need not exist yet.
    #[must_use]
    pub fn at(folder: PathBuf) -> Self {
        Self { folder }
    }

    /// What features depend on, as one name: sensor, index and pictures of a dataset folder by content, and `how` they are
    /// found (options, version of the detector).
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn key(dataset: &Path, pictures: &PictureFolder, how: &str) -> Result<String, Error> {
        let mut digest = Sha256::new();
        let mut add = |file: &Path| {
            match fs::read(file) {
                Ok(bytes) => digest.update(Sha256::digest(&bytes)),
                // A picture that is not there is one without a seam.
                Err(error) if error.kind() == std::io::ErrorKind::NotFound => digest.update(b"missing"),
                Err(error) => return Err(Error::in_file(file, Problem::Io(error))),
            }
            Ok(())
        };
        add(&dataset.join("sensor.toml"))?;
        add(&images::index_of(dataset))?;
        pictures.frames().iter().try_for_each(|frame| add(&frame.path))?;
        digest.update(how.as_bytes());
        Ok(digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
    }

    /// The features of a key, if they are there and whole.
    #[must_use]
    pub fn get(&self, key: &str, sensor: &Sensor) -> Option<Vec<Feature>> {
        let file = self.file(key);
        let bytes = fs::read(&file).ok()?;
        features_csv::read(&file, bytes.as_slice(), sensor).ok()
    }

    /// Keeps features; the file appears whole or not at all.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn put(&self, key: &str, features: &[Feature]) -> std::io::Result<()> {
        fs::create_dir_all(&self.folder)?;
        let unfinished = self.folder.join(format!("{key}.{}.unfinished", std::process::id()));
        let mut bytes = Vec::new();
        features_csv::write(&mut bytes, features)?;
        let written = fs::write(&unfinished, bytes).and_then(|()| fs::rename(&unfinished, self.file(key)));
        if written.is_err() {
            // Why it cannot be written is returned; that its rest cannot be removed would say nothing more.
            drop(fs::remove_file(&unfinished));
        }
        written
    }

    fn file(&self, key: &str) -> PathBuf {
        self.folder.join(format!("{key}.csv"))
    }
}
