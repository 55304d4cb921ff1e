//! Errors on the way from a file to a seam.

use std::path::PathBuf;
use trueline_method::assess::observability::Unobservable;

/// The reason of a missing result.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file cannot be used.
    #[error(transparent)]
    File(#[from] trueline_dataset::Error),
    /// Nothing can be estimated from the recording.
    #[error(transparent)]
    Method(#[from] trueline_method::Error),
    /// A scan cannot be opened.
    #[cfg(feature = "open")]
    #[error(transparent)]
    Open(Box<crate::open::OpenError>),
    /// A result cannot place points while it runs.
    #[error(transparent)]
    RunTime(#[from] crate::run_time_error::RunTimeError),
    /// A quantity to be used is not observable.
    #[error(transparent)]
    Unobservable(#[from] Unobservable),
    /// A file cannot be written.
    #[error("{}: cannot be written: {source}", file.display())]
    Write {
        /// The file.
        file: PathBuf,
        /// An error of the operating system.
        source: std::io::Error,
    },
}

impl Error {
    /// Hint for the user; empty if the error is sufficient.
    #[must_use]
    pub fn hint(&self) -> String {
        match self {
            Self::File(error) => error.hint(),
            Self::Method(error) => error.hint().to_owned(),
            Self::RunTime(error) => error.hint().to_owned(),
            #[cfg(feature = "open")]
            Self::Open(error) => error.hint(),
            Self::Unobservable(_) | Self::Write { .. } => String::new(),
        }
    }
}

#[cfg(feature = "open")]
impl From<crate::open::OpenError> for Error {
    fn from(error: crate::open::OpenError) -> Self {
        Self::Open(Box::new(error))
    }
}
