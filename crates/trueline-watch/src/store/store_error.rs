//! Why the state cannot be used.

use std::path::PathBuf;

/// Why the state cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// SQLite refused.
    #[error("{}: {source}", file.display())]
    Database {
        /// The state file.
        file: PathBuf,
        /// Reason.
        source: rusqlite::Error,
    },
    /// A folder, a pipe or a device, which may never end.
    #[error("{}: is not a regular file", file.display())]
    NoFile {
        /// The name.
        file: PathBuf,
    },
    /// There is no state to read.
    #[error("{}: this state file does not exist", file.display())]
    Missing {
        /// The file.
        file: PathBuf,
    },
    /// Written by a newer program.
    #[error("{}: has state version {found}; this program supports {known}", file.display())]
    Newer {
        /// The state file.
        file: PathBuf,
        /// Its version.
        found: i64,
        /// The newest known one.
        known: i64,
    },
    /// A database of something else.
    #[error("{}: is a database of another program", file.display())]
    Foreign {
        /// The file.
        file: PathBuf,
    },
    /// Numbers that were not written by this program.
    #[error("{}: {what} of row {row} is damaged", file.display())]
    Damaged {
        /// The state file.
        file: PathBuf,
        /// The damaged part.
        what: &'static str,
        /// Its row.
        row: i64,
    },
}

impl StoreError {
    /// Hint for the user.
    #[must_use]
    pub fn hint(&self) -> &'static str {
        match self {
            Self::Database { .. } => "can the file and its folder be written, and is there room on the disk?",
            Self::Missing { .. } => {
                "`trueline watch --state FILE --calibration RESULT WELD…` makes one with the first weld"
            }
            Self::Newer { .. } => "use the newer trueline, or name another --state file",
            Self::Foreign { .. } | Self::NoFile { .. } => {
                "name another --state file; a missing one is created"
            }
            Self::Damaged { .. } => "restore the file from a backup, or name another --state file",
        }
    }
}
