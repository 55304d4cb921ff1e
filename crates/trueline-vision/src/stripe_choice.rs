//! Which of several stripes, or places, is meant.

use crate::lens::Lens;
use nalgebra::Vector2;

/// A place with this part of the best one's evidence can be the one that is meant.
const WORTHY: f64 = 0.3;

/// Criterion that selects one of several places.
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

    /// The one of several candidates that is meant; `evidence` is that for a candidate, `place` its ideal pixel.
    pub(crate) fn among<T>(
        self,
        candidates: impl Iterator<Item = T> + Clone,
        evidence: impl Fn(&T) -> f64,
        place: impl Fn(&T) -> Vector2<f64>,
        lens: &Lens,
    ) -> Option<T> {
        let best = candidates.clone().map(|one| evidence(&one)).max_by(f64::total_cmp)?;
        if self == Self::Strongest {
            return candidates.max_by(|a, b| evidence(a).total_cmp(&evidence(b)));
        }
        let rank = |one: &T| self.rank(&place(one), lens);
        let worthy = candidates.filter(|one| evidence(one) >= WORTHY * best);
        worthy.max_by(|a, b| rank(a).total_cmp(&rank(b)))
    }

    /// Quality of a stripe for the intended place; the largest counts.
    fn rank(self, at: &Vector2<f64>, lens: &Lens) -> f64 {
        let away = || lens.on_sheet(at).map_or(0.0, |(point, _)| point.dot(&lens.away()));
        match self {
            Self::Strongest => 0.0,
            Self::Nearest => -away(),
            Self::Farthest => away(),
            Self::Upper => -at.y,
            Self::Lower => at.y,
            Self::Left => -at.x,
            Self::Right => at.x,
        }
    }
}
