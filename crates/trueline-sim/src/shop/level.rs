//! How rough a shop is.

/// A shop, by its factor on the errors of an ordinary one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Level {
    /// Smaller errors, and fewer.
    Calm,
    /// As the table has them.
    #[default]
    Ordinary,
    /// Larger errors, and more.
    Rough,
}

impl Level {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Calm, Self::Ordinary, Self::Rough];

    /// The name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Calm => "calm",
            Self::Ordinary => "ordinary",
            Self::Rough => "rough",
        }
    }

    /// Factors on the size of every error, and on the share of cells that have it.
    #[must_use]
    pub fn factors(self) -> [f64; 2] {
        match self {
            Self::Calm => [0.6, 0.5],
            Self::Ordinary => [1.0, 1.0],
            Self::Rough => [1.7, 1.7],
        }
    }
}
