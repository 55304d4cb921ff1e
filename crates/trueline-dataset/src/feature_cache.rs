//! Features that were found in pictures, kept outside of the dataset: a folder that is only read stays as it was.

use crate::error::Error;
use crate::found_seams::FoundSeams;
use crate::recording::Sensor;
use crate::source_file;
use crate::whole_file;
use crate::{features_csv, images, picture_source::PictureFolder, stop_poses, stripes_csv};
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

    /// The inputs of features as one name: sensor, index and pictures of a dataset folder by content, and `how` they are
    /// found (options, version of the detector).
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn key(dataset: &Path, pictures: &PictureFolder, how: &str) -> Result<String, Error> {
        let mut digest = Sha256::new();
        let mut add = |file: &Path| {
            match source_file::bytes_if_there(file)? {
                Some(bytes) => digest.update(Sha256::digest(&bytes)),
                // A picture that is not there is one without a seam.
                None => digest.update(b"missing"),
            }
            Ok(())
        };
        add(&dataset.join("sensor.toml"))?;
        add(&images::index_of(dataset))?;
        add(&dataset.join(stop_poses::FILE))?;
        pictures.frames().iter().try_for_each(|frame| add(&frame.path))?;
        digest.update(how.as_bytes());
        Ok(digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
    }

    /// The features of a key, if they are there and whole.
    #[must_use]
    pub fn get(&self, key: &str, sensor: &Sensor) -> Option<FoundSeams> {
        let file = self.file(key);
        let bytes = fs::read(&file).ok()?;
        let features = features_csv::read(&file, bytes.as_slice(), sensor).ok()?;
        let file = self.stripes_file(key);
        let stripes = match fs::read(&file) {
            Ok(bytes) => stripes_csv::read(&file, bytes.as_slice(), sensor).ok()?,
            Err(_) => Vec::new(),
        };
        Some(FoundSeams { features, stripes })
    }

    /// Keeps the findings. Each file appears whole or not at all, that of the features last.
    ///
    /// # Errors
    /// Error of the operating system.
    pub fn put(&self, key: &str, found: &FoundSeams) -> std::io::Result<()> {
        fs::create_dir_all(&self.folder)?;
        let mut bytes = Vec::new();
        if !found.stripes.is_empty() {
            stripes_csv::write(&mut bytes, &found.stripes)?;
            whole_file::write(&self.stripes_file(key), &bytes)?;
            bytes.clear();
        }
        features_csv::write(&mut bytes, &found.features)?;
        whole_file::write(&self.file(key), &bytes)
    }

    fn file(&self, key: &str) -> PathBuf {
        self.folder.join(format!("{key}.csv"))
    }

    fn stripes_file(&self, key: &str) -> PathBuf {
        self.folder.join(format!("{key}.stripes.csv"))
    }
}
