//! Reasons that a feature or a stripe was not used.

use std::fmt;

/// Reason that a feature or a stripe was not used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Skip {
    /// The robot stream has a gap at its exposure.
    Gap,
    /// It was exposed before or after the robot recording.
    Outside,
    /// The line has no intersection with the laser plane.
    AlongPlane,
    /// Its pixel lies outside the image, or where the lens model cannot be inverted.
    NoRay,
    /// Its ray does not meet the laser plane.
    NoIntersection,
    /// Its row repeats another of the same image.
    Repeated,
    /// Hardly any frame shows its plate.
    RarePlate,
}

impl Skip {
    /// A stable code.
    #[must_use]
    pub fn code(self) -> &'static str {
        match self {
            Self::Gap => "robot-gap",
            Self::Outside => "outside-robot-recording",
            Self::AlongPlane => "line-along-laser-plane",
            Self::NoRay => "no-ray",
            Self::NoIntersection => "no-intersection",
            Self::Repeated => "repeated-row",
            Self::RarePlate => "plate-rarely-seen",
        }
    }
}

impl fmt::Display for Skip {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Gap => "exposed in a gap of the robot stream",
            Self::Outside => "exposed outside the robot recording",
            Self::AlongPlane => "line runs along the laser plane",
            Self::NoRay => "pixel outside the image or the lens model",
            Self::NoIntersection => "ray does not meet the laser plane",
            Self::Repeated => "row repeats another row of its image",
            Self::RarePlate => "on a plate that few frames show",
        })
    }
}
