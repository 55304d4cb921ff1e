//! The file of a dataset folder that has whole profiles: `profiles.csv` or `profiles.parquet`.

use crate::dialect::plain_csv;
use crate::error::{Error, Problem};
use crate::profile::Profile;
use crate::stop_poses::Pairing;
use crate::{no_return, profiles_csv, source_file};
use std::path::{Path, PathBuf};

/// In which form profiles are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ProfileForm {
    /// A table of text.
    #[default]
    Csv,
    /// Parquet: a sixth of the size.
    Parquet,
}

impl ProfileForm {
    const ALL: [Self; 2] = [Self::Csv, Self::Parquet];

    /// Its file in a dataset folder.
    #[must_use]
    pub(crate) fn file_name(self) -> &'static str {
        match self {
            Self::Csv => "profiles.csv",
            Self::Parquet => "profiles.parquet",
        }
    }
}

/// The bytes of a file, not yet read.
pub(crate) struct ProfileFile {
    pub(crate) form: ProfileForm,
    pub(crate) bytes: Vec<u8>,
    path: PathBuf,
}

impl ProfileFile {
    /// The file of a folder that was written after another of its files.
    pub(crate) fn newer_than(folder: &Path, other: &str) -> Option<PathBuf> {
        let written = |path: &Path| path.metadata().and_then(|about| about.modified()).ok();
        let other = written(&folder.join(other))?;
        let mut files = ProfileForm::ALL.into_iter().map(|form| folder.join(form.file_name()));
        files.find(|file| written(file).is_some_and(|at| at > other))
    }

    /// Its path in a folder, if it exists.
    pub(crate) fn path_in(folder: &Path) -> Option<PathBuf> {
        ProfileForm::ALL.into_iter().map(|form| folder.join(form.file_name())).find(|file| file.exists())
    }

    /// The file of a folder; `None` if there is none.
    ///
    /// # Errors
    /// Two of them, and one that cannot be read.
    pub(crate) fn of(folder: &Path) -> Result<Option<Self>, Error> {
        let mut found = None;
        for form in ProfileForm::ALL {
            let path = folder.join(form.file_name());
            let Some(bytes) = source_file::bytes_if_there(&path)? else { continue };
            if found.is_some() {
                let what = "a second file of profiles beside profiles.csv";
                return Err(Error::unreadable(&path, what, "leave one of the two files in the folder"));
            }
            if form == ProfileForm::Csv {
                source_file::expect_lines(&path, &bytes)?;
            }
            found = Some(Self { form, bytes, path });
        }
        Ok(found)
    }

    /// Its profiles; a remark notes a table that is not plain CSV.
    ///
    /// # Errors
    /// Unusable content.
    pub(crate) fn read(self, notes: &mut Vec<String>, pairing: Pairing<'_>) -> Result<Vec<Profile>, Error> {
        let path = self.path.clone();
        let mut profiles = self.read_any(notes, pairing)?;
        let origins = no_return::take_out_origins(&mut profiles);
        notes.extend(origins.map(|said| format!("{}: {said}", path.display())));
        no_return::check(&profiles).map_err(|problem| Error::in_file(&path, problem))?;
        Ok(profiles)
    }

    fn read_any(self, notes: &mut Vec<String>, pairing: Pairing<'_>) -> Result<Vec<Profile>, Error> {
        if self.form == ProfileForm::Parquet && pairing.stops.is_some() {
            let hint = "write profiles.csv in its place, with a column `stop`";
            return Err(Error::unreadable(&self.path, "a Parquet file beside poses.csv", hint));
        }
        if self.form == ProfileForm::Parquet {
            return from_parquet(&self.path, self.bytes);
        }
        let (csv, dialect) = plain_csv(&self.path, self.bytes, None)?;
        if !dialect.is_plain() {
            notes.push(format!("{}: {dialect}", self.path.display()));
        }
        profiles_csv::read_at(&self.path, csv.as_slice(), pairing)
    }
}

/// The bytes of a file of profiles.
///
/// # Errors
/// A program that was built without Parquet.
pub(crate) fn bytes_of(file: &Path, profiles: &[Profile], form: ProfileForm) -> Result<Vec<u8>, Error> {
    match form {
        ProfileForm::Csv => {
            let mut bytes = Vec::new();
            let written = profiles_csv::write(&mut bytes, profiles);
            written.map(|()| bytes).map_err(|error| Error::in_file(file, Problem::Io(error)))
        }
        ProfileForm::Parquet => as_parquet(file, profiles),
    }
}

#[cfg(feature = "parquet")]
pub(crate) fn from_parquet(file: &Path, bytes: Vec<u8>) -> Result<Vec<Profile>, Error> {
    crate::profiles_parquet::read(file, bytes)
}

#[cfg(feature = "parquet")]
fn as_parquet(file: &Path, profiles: &[Profile]) -> Result<Vec<u8>, Error> {
    crate::profiles_parquet::bytes(profiles)
        .map_err(|error| Error::in_file(file, Problem::Io(std::io::Error::other(error))))
}

#[cfg(not(feature = "parquet"))]
pub(crate) fn from_parquet(file: &Path, _: Vec<u8>) -> Result<Vec<Profile>, Error> {
    Err(without_parquet(file))
}

#[cfg(not(feature = "parquet"))]
fn as_parquet(file: &Path, _: &[Profile]) -> Result<Vec<u8>, Error> {
    Err(without_parquet(file))
}

#[cfg(not(feature = "parquet"))]
fn without_parquet(file: &Path) -> Error {
    let hint = "write profiles.csv in its place; or build trueline with the feature parquet";
    Error::unreadable(file, "a Parquet file", hint)
}
