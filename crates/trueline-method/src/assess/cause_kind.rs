//! The usual causes of residuals that are not noise.

use crate::assess::tilt_bias::BIAS;
use std::ops::Range;

/// A usual cause.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CauseKind {
    /// The arm bends: the tool lags in proportion to the acceleration (m for each m/s² = s²).
    Flex,
    /// Play in the robot: the tool follows only after the motion has taken it up (m).
    Backlash,
    /// The attitude is reported later than the position (s).
    AttitudeLag,
    /// The rows of an image are exposed one after the other (s from the first to the last).
    RollingShutter,
    /// The detector has opposite errors on the two halves of the image (px).
    SideBias,
    /// The commanded pose is reported, and the arm follows it with a first-order lag (the square of its time constant, s²).
    CommandedPose,
    /// The camera's distortion differs from its file: k1, and k2 if observable (true minus stated).
    Lens,
    /// The detector's point moves with the tilt (px per 10°). Robot errors look similar, so this cause is reported only if it was estimated beside
    /// them.
    TiltBias,
}

impl CauseKind {
    pub(crate) const ALL: [Self; 8] = [
        Self::Flex,
        Self::Backlash,
        Self::AttitudeLag,
        Self::RollingShutter,
        Self::SideBias,
        Self::CommandedPose,
        Self::Lens,
        Self::TiltBias,
    ];

    /// Whether only a positive size is possible: an arm does not bend towards its load, play has no sign, and no arm runs ahead of its command.
    pub(crate) fn is_one_sided(self) -> bool {
        matches!(self, Self::Flex | Self::Backlash | Self::CommandedPose)
    }

    /// Its code among the warnings.
    #[must_use]
    pub fn code(self) -> &'static str {
        match self {
            Self::Flex => "robot-flex",
            Self::Backlash => "robot-backlash",
            Self::AttitudeLag => "attitude-lag",
            Self::RollingShutter => "rolling-shutter",
            Self::SideBias => "side-bias",
            Self::CommandedPose => "commanded-pose",
            Self::Lens => "lens-off",
            Self::TiltBias => "feature-bias",
        }
    }

    /// Its indices among the [`COLUMNS`].
    pub(crate) fn columns(self) -> Range<usize> {
        match self {
            Self::Flex => 0..1,
            Self::Backlash => 1..4,
            Self::AttitudeLag => 4..5,
            Self::RollingShutter => 5..6,
            Self::SideBias => 6..8,
            Self::CommandedPose => 8..9,
            Self::Lens => LENS..LENS + 2,
            Self::TiltBias => LENS + 2..COLUMNS,
        }
    }
}

/// Number of columns of all causes.
pub(crate) const COLUMNS: usize = LENS + 2 + BIAS;
/// First column of the lens.
pub(crate) const LENS: usize = 9;
