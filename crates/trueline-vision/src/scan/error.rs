//! Why the pictures of a scan cannot be examined.

/// Error that stops a scan's examination. A picture without a seam does not: that is a [`crate::NotFound`] of its
/// own.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ScanError {
    /// A picture, or the index of them, that cannot be read.
    #[error(transparent)]
    Read(#[from] trueline_dataset::Error),
    /// Seams are found in pictures, and this sensor takes none.
    #[error("features can be detected only in pictures of a camera_laser; this sensor is of kind {kind}")]
    NoCamera {
        /// The sensor's kind, as in `sensor.toml`.
        kind: &'static str,
    },
    /// A picture of another size than the sensor's.
    #[error("{name}: the picture has {} x {} px, sensor.toml states {} x {}", found[0], found[1], expected[0], expected[1])]
    WrongSize {
        /// The picture.
        name: String,
        /// Its width and height, px.
        found: [usize; 2],
        /// The camera's, px.
        expected: [usize; 2],
    },
    /// There is nothing to examine.
    #[error("there are no pictures")]
    NoPictures,
    /// The observer failed.
    #[error("{0}")]
    Observer(Box<dyn std::error::Error + Send + Sync>),
}
