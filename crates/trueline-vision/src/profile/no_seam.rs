//! Why a profile has no seam.

/// Why a profile has no seam.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, thiserror::Error)]
pub enum NoSeam {
    /// Hardly any point came back.
    #[error("too few points")]
    TooFewPoints,
    /// One straight line, or two that are parallel.
    #[error("no two faces at an angle")]
    NoAngle,
    /// A face beside the seam is not straight.
    #[error("the faces are not straight")]
    NotStraight,
    /// The faces would meet far from both.
    #[error("the faces do not meet")]
    Apart,
    /// No two parallel faces, one behind the other.
    #[error("no step between two parallel faces")]
    NoStep,
    /// No hole between two faces in line.
    #[error("no gap between two faces in line")]
    NoGap,
    /// Two holes that are nearly as wide as each other.
    #[error("several gaps")]
    SeveralGaps,
    /// A gap with another width than in most of the profiles.
    #[error("the gap width differs from most profiles")]
    OddGap,
    /// A face that ends nowhere but where the view does.
    #[error("the face ends at the edge of the field of view")]
    EndOfView,
    /// A face with both ends in view.
    #[error("both ends of the face are in view, and one of them must be the edge")]
    BothEnds,
    /// An edge that is rounded over more than 1 mm.
    #[error("the face curves over more than 1 mm before its end")]
    RoundedEnd,
    /// A face that bends everywhere as much as at the expected corner: pipe, bead, ball, groove.
    #[error("a round face (radius about {0}) and no corner")]
    RoundFace(RadiusUm),
}

/// The radius of a round face, whole µm: reasons are counted, and so must be equal or not.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct RadiusUm(pub u32);

impl RadiusUm {
    /// The value of a radius in mm.
    #[must_use]
    pub fn of_mm(mm: f64) -> Self {
        Self((mm * UM_PER_MM).round() as u32)
    }

    /// In mm.
    #[must_use]
    pub fn mm(self) -> f64 {
        f64::from(self.0) / UM_PER_MM
    }
}

const UM_PER_MM: f64 = 1e3;

impl std::fmt::Display for RadiusUm {
    /// With two digits: a bend is not known better.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mm = self.mm();
        let digits = if mm < 10.0 { 1 } else { 0 };
        write!(f, "{mm:.digits$} mm")
    }
}
