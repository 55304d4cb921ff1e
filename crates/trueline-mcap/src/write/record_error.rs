//! Errors of a recording.

use std::path::PathBuf;

/// Why a recording cannot be made, or is not whole.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordError {
    /// There is a file already.
    #[error("{}: already exists and would be overwritten", file.display())]
    AlreadyExists {
        /// The file.
        file: PathBuf,
    },
    /// The file cannot be created.
    #[error("{}: cannot be written: {why}", file.display())]
    Create {
        /// The file.
        file: PathBuf,
        /// Error of the operating system.
        why: String,
    },
    /// Writing failed on the way.
    #[error("{}: writing stopped after {written} entries: {why}; {refused} entries are lost", file.display())]
    Stopped {
        /// The file.
        file: PathBuf,
        /// Entries in the file.
        written: u64,
        /// Entries that are not.
        refused: u64,
        /// Error of the operating system.
        why: String,
    },
}

impl RecordError {
    /// Remedy for the user.
    #[must_use]
    pub fn hint(&self) -> String {
        let text = match self {
            Self::AlreadyExists { .. } => "name a new file; recordings are never overwritten",
            Self::Create { .. } => "check the path, its permissions and the free space",
            Self::Stopped { .. } => {
                "the data written before can be read; is the disk full? then record to another one"
            }
        };
        text.to_owned()
    }
}
