//! The file of a dataset folder that has whole profiles: `profiles.csv` or `profiles.parquet`.

use crate::error::{Error, Problem};
use crate::hash::sha256_of;
use crate::no_return::{self, NoReturns};
use crate::profile::Profile;
use crate::profile_stream::EachProfile;
use crate::stop_poses::Pairing;
use crate::{profile_text, profiles_csv, source_file};
use std::fs::File;
use std::io::Seek;
use std::ops::ControlFlow;
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

/// A file of profiles that is open.
#[derive(Debug)]
pub(crate) struct ProfileFile {
    pub(crate) form: ProfileForm,
    file: File,
    path: PathBuf,
}

/// What was found while profiles were handed over.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ProfilesRead {
    /// Remarks: another form of table, points that are no return.
    pub notes: Vec<String>,
    /// Points at (0, 0) were left out, but are measurements: the profiles have to be read again, with them.
    pub origins_are_measured: bool,
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
            let Some(file) = source_file::open_if_there(&path)? else { continue };
            if found.is_some() {
                let what = "a second file of profiles beside profiles.csv";
                return Err(Error::unreadable(&path, what, "leave one of the two files in the folder"));
            }
            found = Some(Self { form, file, path });
        }
        Ok(found)
    }

    /// SHA-256 of the file.
    ///
    /// # Errors
    /// Error of the operating system.
    pub(crate) fn sha256(&self) -> Result<String, Error> {
        self.rewound().and_then(sha256_of).map_err(|error| Error::in_file(&self.path, Problem::Io(error)))
    }

    fn rewound(&self) -> std::io::Result<&File> {
        (&self.file).rewind().map(|()| &self.file)
    }

    /// Its profiles; a remark notes a table that is not plain CSV.
    ///
    /// # Errors
    /// Unusable content.
    pub(crate) fn read(&self, notes: &mut Vec<String>, pairing: Pairing<'_>) -> Result<Vec<Profile>, Error> {
        let mut profiles = Vec::new();
        self.each_as_it_is(notes, pairing, &mut |profile| {
            profiles.push(profile);
            ControlFlow::Continue(())
        })?;
        // Stops come in any order.
        profiles.sort_by_key(|profile| profile.stamp_ns);
        let origins = no_return::take_out_origins(&mut profiles);
        notes.extend(origins.map(|said| format!("{}: {said}", self.path.display())));
        no_return::check(&profiles).map_err(|problem| Error::in_file(&self.path, problem))?;
        Ok(profiles)
    }

    /// Hands its profiles over in its order. Points at (0, 0) are left out unless they are to stay.
    ///
    /// # Errors
    /// Unusable content; what is wrong with all profiles together is found at the end.
    pub(crate) fn each(
        &self,
        pairing: Pairing<'_>,
        takes_out_origins: bool,
        each: &mut EachProfile<'_>,
    ) -> Result<ProfilesRead, Error> {
        let (mut notes, mut seen) = (Vec::new(), NoReturns::default());
        self.each_as_it_is(&mut notes, pairing, &mut |mut profile| {
            seen.look(&mut profile, takes_out_origins);
            each(profile)
        })?;
        let origins_are_measured = takes_out_origins && seen.origins_are_measured();
        if !origins_are_measured {
            seen.check().map_err(|problem| Error::in_file(&self.path, problem))?;
        }
        notes.extend(seen.origins().map(|said| format!("{}: {said}", self.path.display())));
        Ok(ProfilesRead { notes, origins_are_measured })
    }

    fn each_as_it_is(
        &self,
        notes: &mut Vec<String>,
        pairing: Pairing<'_>,
        each: &mut EachProfile<'_>,
    ) -> Result<(), Error> {
        let file = self.rewound().map_err(|error| Error::in_file(&self.path, Problem::Io(error)))?;
        match self.form {
            ProfileForm::Parquet if pairing.stops.is_some() => {
                let hint = "write profiles.csv in its place, with a column `stop`";
                Err(Error::unreadable(&self.path, "a Parquet file beside poses.csv", hint))
            }
            ProfileForm::Parquet => each_of_parquet(&self.path, file, each),
            ProfileForm::Csv => profile_text::each(&self.path, file, pairing, notes, each),
        }
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
fn each_of_parquet(path: &Path, file: &File, each: &mut EachProfile<'_>) -> Result<(), Error> {
    let again = || file.try_clone().map_err(|error| Error::in_file(path, Problem::Io(error)));
    crate::profiles_parquet::each(path, [again()?, again()?], each)
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
fn each_of_parquet(path: &Path, _: &File, _: &mut EachProfile<'_>) -> Result<(), Error> {
    Err(without_parquet(path))
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
