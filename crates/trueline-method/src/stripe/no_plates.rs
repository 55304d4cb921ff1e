//! Why no plates can be estimated from the stripes.

use std::fmt;

/// Why the stripes are not used though there are some.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoPlates {
    /// A joint has no stripes on one of its plates, or none at all.
    Missing {
        /// The seam of the joint.
        line: usize,
        /// Stripes that could not be used.
        unusable: usize,
    },
    /// Points of a plate that do not span a plane.
    NoPlane,
    /// Most stripes lie on no plate.
    Scattered {
        /// How many.
        rejected: usize,
        /// Of how many.
        stripes: usize,
    },
    /// The search for the best plates did not come to an end.
    NotConverged,
    /// Two plates that do not meet in a line, without the points of an edge.
    Parallel,
    /// Two parallel plates, or one alone, and seam points that lie on neither.
    EdgeElsewhere {
        /// The seam of the joint.
        line: usize,
    },
}

impl fmt::Display for NoPlates {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Missing { line, unusable: 0 } => {
                write!(f, "line {line} has no stripes, or too few, on its plates")
            }
            Self::Missing { line, unusable } => write!(
                f,
                "line {line} has no stripes, or too few, on its plates: {unusable} lie outside the image or do not meet the laser plane"
            ),
            Self::NoPlane => {
                f.write_str("no plane fits the support points of a plate: they lie on one line, or anywhere")
            }
            Self::Scattered { rejected, stripes } => {
                write!(
                    f,
                    "{rejected} of {stripes} stripes lie on none of the plates that fit the others best"
                )
            }
            Self::NotConverged => f.write_str("the fit of the plates did not converge"),
            Self::Parallel => f.write_str(
                "the two plates are parallel to within 6°, and there are no seam points of an edge",
            ),
            Self::EdgeElsewhere { line } => write!(
                f,
                "the plates of line {line} meet in no line, and its seam points lie a millimetre or more beside them"
            ),
        }
    }
}

impl NoPlates {
    /// The same, where so many stripes could not be used.
    #[must_use]
    pub(crate) fn with_unusable(self, unusable: usize) -> Self {
        match self {
            Self::Missing { line, .. } => Self::Missing { line, unusable },
            other => other,
        }
    }

    /// What the user can do about it.
    #[must_use]
    pub fn hint(&self) -> &'static str {
        match self {
            Self::Missing { unusable: 1.., .. } => {
                "see whether stripes.csv and sensor.toml are of one camera and one region of the picture, or take --use seam"
            }
            Self::Missing { .. } => {
                "number the plates 0 and 1 in stripes.csv, or take --use both: a line without plates then counts by its seam points"
            }
            Self::NoPlane => {
                "let the robot move along the seam or tilt while it scans, and see whether stripes.csv is of this scan and in its units; otherwise take --use seam"
            }
            Self::Scattered { .. } => {
                "see whether stripes.csv is of this scan and this sensor, in its units, and each plate has one number in all frames; otherwise take --use seam"
            }
            Self::NotConverged => {
                "see whether stripes.csv is of this scan and this sensor, and whether the seam points calibrate by themselves: --use seam"
            }
            Self::Parallel => "of a lap or a step the edge is the seam: give its points in features.csv",
            Self::EdgeElsewhere { .. } => {
                "a lap's seam is the edge of its upper plate or its foot on the lower one, and a plate has one number in all frames; otherwise take --use seam"
            }
        }
    }
}
