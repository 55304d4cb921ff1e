//! Reasons that no plates can be estimated from the stripes.

use std::fmt;

/// Reason that existing stripes are not used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoPlates {
    /// A joint has no stripes on one of its plates, or none at all.
    Missing {
        /// The seam of the joint.
        line: usize,
        /// Number of stripes that were not used.
        unusable: usize,
    },
    /// Points of a plate that do not span a plane.
    NoPlane,
    /// Most stripes lie on no plate.
    Scattered {
        /// Number.
        rejected: usize,
        /// Total number.
        stripes: usize,
    },
    /// The fit of the plates did not converge.
    NotConverged,
    /// Two plates that do not meet in a line, without the points of an edge.
    Parallel,
    /// Two parallel plates, or a single one, with seam points on neither.
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
            Self::NoPlane => f.write_str(
                "no plane fits the support points of a plate: they lie on one line, or are \
                    scattered",
            ),
            Self::Scattered { rejected, stripes } => {
                write!(
                    f,
                    "{rejected} of {stripes} stripes are outliers: they lie on none of the fitted plates"
                )
            }
            Self::NotConverged => f.write_str("the fit of the plates did not converge"),
            Self::Parallel => f.write_str(
                "the two plates are parallel to within 6°, and there are no seam points of an edge",
            ),
            Self::EdgeElsewhere { line } => write!(
                f,
                "the plates of line {line} do not meet in a line, and its seam points lie 1 mm or more \
                beside them"
            ),
        }
    }
}

impl NoPlates {
    /// The same with a number of unused stripes.
    #[must_use]
    pub(crate) fn with_unusable(self, unusable: usize) -> Self {
        match self {
            Self::Missing { line, .. } => Self::Missing { line, unusable },
            other => other,
        }
    }

    /// Hint for the user.
    #[must_use]
    pub fn hint(&self) -> &'static str {
        match self {
            Self::Missing { unusable: 1.., .. } => {
                "check that stripes.csv and sensor.toml belong to one camera and one region of the picture, \
                or use --use seam"
            }
            Self::Missing { .. } => {
                "number the plates 0 and 1 in stripes.csv, or use --use both: a line without plates is then \
                measured by its seam points"
            }
            Self::NoPlane => {
                "move along the seam or tilt during the scan, and check that stripes.csv belongs to this \
                scan and has its units; otherwise use --use seam"
            }
            Self::Scattered { .. } => {
                "check that stripes.csv belongs to this scan and sensor, has its units, and numbers each \
                plate alike in all frames; otherwise use --use seam"
            }
            Self::NotConverged => {
                "check that stripes.csv belongs to this scan and sensor, and try the seam points alone: \
                --use seam"
            }
            Self::Parallel => "for a lap or a step the edge is the seam: give its points in features.csv",
            Self::EdgeElsewhere { .. } => {
                "a lap's seam is the edge of its upper plate or its foot on the lower one, and each plate \
                has the same number in all frames; otherwise use --use seam"
            }
        }
    }
}
