//! A calibration that can be read, saved and used.

use crate::error::Error;
use std::fmt;
use std::ops::Deref;
use std::path::Path;
use trueline_dataset::result_file::ResultFile;
use trueline_dataset::sensor_setup::Mounted;
use trueline_dataset::whole_file;
use trueline_report::{result, summary};

/// A finished calibration: everything of [`trueline_method::Calibration`], its summary as `Display`, and its file.
#[derive(Clone, Debug)]
pub struct Calibration {
    calibration: trueline_method::Calibration,
    mounted: Mounted,
    stamp_meaning: Option<String>,
}

impl Calibration {
    pub(crate) fn new(
        calibration: trueline_method::Calibration,
        mounted: Mounted,
        stamp_meaning: Option<String>,
    ) -> Self {
        Self { calibration, mounted, stamp_meaning }
    }

    /// The result in its file's form.
    #[must_use]
    pub fn to_file(&self) -> ResultFile {
        let mut file = result::of(&self.calibration);
        file.stamps.meaning.clone_from(&self.stamp_meaning);
        file.mounted = (self.mounted == Mounted::Fixed).then(|| "fixed".to_owned());
        file
    }

    /// Writes the result as JSON; the file appears whole or not at all.
    ///
    /// # Errors
    /// An error of the operating system.
    pub fn save(&self, file: impl AsRef<Path>) -> Result<(), Error> {
        let file = file.as_ref();
        let cannot = |source| Error::Write { file: file.to_owned(), source };
        let text = self.to_file().to_json().map_err(|error| cannot(error.into()))?;
        whole_file::write(file, (text + "\n").as_bytes()).map_err(cannot)
    }
}

/// Reads the result that [`Calibration::save`] or `trueline calibrate --json` wrote.
///
/// # Errors
/// A file that is missing, is not a result, or has a later schema.
pub fn load(file: impl AsRef<Path>) -> Result<ResultFile, Error> {
    Ok(ResultFile::read(file.as_ref())?)
}

impl Deref for Calibration {
    type Target = trueline_method::Calibration;

    fn deref(&self) -> &Self::Target {
        &self.calibration
    }
}

/// The summary: verdict, estimates with their ±, checks.
impl fmt::Display for Calibration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(summary::text(&self.calibration).trim_end())
    }
}
