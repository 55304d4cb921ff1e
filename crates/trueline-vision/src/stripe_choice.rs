//! Which of several stripes, or places, is meant.

use crate::joint::arm_pair::ArmPair;
use crate::lens::Lens;

/// What tells one of several corners from the others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum StripeChoice {
    /// The one with the most light, if no other has almost as much.
    #[default]
    Strongest,
    /// Nearest to the camera.
    Nearest,
    /// Farthest from the camera.
    Farthest,
    /// Highest in the picture.
    Upper,
    /// Lowest in the picture.
    Lower,
    /// Leftmost in the picture.
    Left,
    /// Rightmost in the picture.
    Right,
}

impl StripeChoice {
    /// Every choice.
    pub const ALL: [Self; 7] =
        [Self::Strongest, Self::Nearest, Self::Farthest, Self::Upper, Self::Lower, Self::Left, Self::Right];

    /// The name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Strongest => "strongest",
            Self::Nearest => "nearest",
            Self::Farthest => "farthest",
            Self::Upper => "upper",
            Self::Lower => "lower",
            Self::Left => "left",
            Self::Right => "right",
        }
    }

    /// What is largest for the corner that is meant.
    pub(crate) fn rank(self, pair: &ArmPair, lens: &Lens) -> f64 {
        let corner = pair.corner();
        let away = || lens.on_sheet(&corner).map_or(0.0, |(point, _)| point.dot(&lens.away()));
        match self {
            Self::Strongest => pair.score(),
            Self::Nearest => -away(),
            Self::Farthest => away(),
            Self::Upper => -corner.y,
            Self::Lower => corner.y,
            Self::Left => -corner.x,
            Self::Right => corner.x,
        }
    }
}
