//! What can go wrong between a file and a seam.

use std::path::PathBuf;
use trueline_method::assess::observability::Unobservable;

/// Why there is no result.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file cannot be used.
    #[error(transparent)]
    File(#[from] trueline_dataset::Error),
    /// Nothing can be estimated from the recording.
    #[error(transparent)]
    Method(#[from] trueline_method::Error),
    /// A recording in MCAP or rosbag2 cannot be used.
    #[cfg(feature = "mcap")]
    #[error(transparent)]
    Import(#[from] trueline_mcap::ImportError),
    /// The pictures of a recording cannot be examined.
    #[cfg(feature = "images")]
    #[error(transparent)]
    Pictures(#[from] trueline_vision::scan::ScanError),
    /// What is to be used is not observable.
    #[error(transparent)]
    Unobservable(#[from] Unobservable),
    /// A recording without seam features.
    #[error("{}: there are no seam features in it", .0.display())]
    NoFeatures(PathBuf),
    /// A file cannot be written.
    #[error("{}: cannot be written: {source}", file.display())]
    Write {
        /// The file.
        file: PathBuf,
        /// What the operating system says.
        source: std::io::Error,
    },
}
