//! Reasons that a stated noise of the features does not apply to a scan.

/// Reason that a stated noise applies to no feature.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoiseUnused {
    /// It is in mm, and the features are pixels.
    FeaturesArePixels,
    /// It is in px, and the features are lengths.
    FeaturesAreLengths,
    /// Every feature has its own standard deviation.
    EachHasItsOwn,
}

impl std::fmt::Display for NoiseUnused {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::FeaturesArePixels => "the feature noise is stated in mm, but this camera reports pixels",
            Self::FeaturesAreLengths => "the feature noise is stated in px, but this sensor reports lengths",
            Self::EachHasItsOwn => {
                "a feature noise is stated, but every feature has its own standard deviation"
            }
        })
    }
}
