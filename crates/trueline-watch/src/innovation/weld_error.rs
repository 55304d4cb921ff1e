//! Why a weld cannot be used.

/// Fewest features of a seam: two numbers each, for six unknowns of its own and a check.
pub(crate) const LEAST_FEATURES: usize = 20;

/// Why a weld cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum WeldError {
    /// The recording cannot be used.
    #[error(transparent)]
    Recording(#[from] trueline_method::Error),
    /// A seam has too few features at places where the robot was recorded.
    #[error("seam {line} has only {usable} usable features; at least {needed} are needed")]
    TooFewFeatures {
        /// The seam.
        line: u32,
        /// Features that can be placed and agree with a straight seam.
        usable: usize,
        /// The required number.
        needed: usize,
    },
    /// The seam is not straight, and its pieces have too few points.
    #[error(
        "seam {line} is curved: a third of its points are more than {:.0} mm off a straight line; its pieces of 40 mm or half a radian have fewer \
         than {LEAST_FEATURES} points each",
        off_m * 1e3
    )]
    Curved {
        /// The seam.
        line: u32,
        /// A third of its points are farther than this from a straight line, m.
        off_m: f64,
    },
    /// The features of a seam lie on no line that crosses the laser plane.
    #[error("the features of seam {line} do not lie on a straight line across the laser plane")]
    NoLine {
        /// The seam.
        line: u32,
    },
}

impl WeldError {
    /// Hint for the user.
    #[must_use]
    pub fn hint(&self) -> &'static str {
        match self {
            Self::Recording(error) => error.hint(),
            Self::TooFewFeatures { .. } => "record the robot and the sensor over the whole weld",
            Self::Curved { .. } => "record more frames or weld slower; or watch a straight seam of the part",
            Self::NoLine { .. } => {
                "check that the calibration belongs to this sensor; `trueline evaluate WELD --calibration \
                RESULT` shows the points"
            }
        }
    }
}
