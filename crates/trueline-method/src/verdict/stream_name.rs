//! Names of the streams in sentences.

/// A stream of the recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StreamName {
    /// The robot's poses.
    Robot,
    /// The images.
    Images,
}

impl StreamName {
    /// Its name in a sentence.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Robot => "robot",
            Self::Images => "image",
        }
    }
}
