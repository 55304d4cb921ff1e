//! How a seam is followed, and why a point or a target is refused.

/// How a seam is followed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackSettings {
    /// Half the length of seam over which points are averaged, m. A seam with ten times that radius bends by
    /// a 20th of it.
    pub half_window_m: f64,
    /// Longest way beyond the last point that is extrapolated, m.
    pub longest_extrapolation_m: f64,
    /// Standard deviation of the seam's curvature beyond the points, 1/m.
    pub curvature_per_m: f64,
    /// A point further from where the seam was expected is not one of it, m.
    pub jump_m: f64,
    /// Points that are remembered.
    pub points_kept: usize,
}

impl Default for TrackSettings {
    fn default() -> Self {
        Self {
            half_window_m: 0.006,
            longest_extrapolation_m: 0.003,
            curvature_per_m: 5.0,
            jump_m: 0.005,
            points_kept: 4096,
        }
    }
}

/// Fewest points that are remembered.
const FEWEST_KEPT: usize = 64;
/// Most of them: 100 m at 0.1 mm.
const MOST_KEPT: usize = 1_000_000;
impl TrackSettings {
    #[must_use]
    pub(crate) fn problem(&self) -> Option<&'static str> {
        let is_positive = |number: f64| number.is_finite() && number > 0.0;
        [
            (is_positive(self.half_window_m), "half_window_m"),
            (
                self.longest_extrapolation_m.is_finite() && self.longest_extrapolation_m >= 0.0,
                "longest_extrapolation_m",
            ),
            (self.curvature_per_m.is_finite() && self.curvature_per_m >= 0.0, "curvature_per_m"),
            (is_positive(self.jump_m), "jump_m"),
            ((FEWEST_KEPT..=MOST_KEPT).contains(&self.points_kept), "points_kept"),
        ]
        .into_iter()
        .find_map(|(is_good, name)| (!is_good).then_some(name))
    }
}

/// Why a seam point is not taken.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SeamPointError {
    /// A number is not finite, or the ± is not above zero.
    #[error("the seam point or its ± is not a finite number")]
    NotFinite,
    /// It is not further along the seam than the last one.
    #[error("the seam point is {behind_m:.5} m behind the last one")]
    NotAhead {
        /// By how much, m.
        behind_m: f64,
    },
    /// It is too far from where the seam was expected.
    #[error("the seam point is {off_m:.5} m off the seam; {in_a_row} such in a row")]
    OffSeam {
        /// How far, m.
        off_m: f64,
        /// How many in a row.
        in_a_row: usize,
    },
    /// The last of several points that were off the seam: another seam begins with it.
    #[error("another seam begins here; the points before are forgotten")]
    AnotherSeam,
}

/// The reason of a missing target.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum AheadError {
    /// Torch pose, speed or delay is not finite, or negative.
    #[error("torch pose, speed or delay is not a finite number of zero or more")]
    NotFinite,
    /// There are too few points about the place.
    #[error("{points} of {needed} seam points about the place")]
    TooFewPoints {
        /// Points there.
        points: usize,
        /// Points that are needed.
        needed: usize,
    },
    /// The place is before the first point that is remembered.
    #[error("the torch is {by_m:.5} m before the first seam point")]
    BeforeSeam {
        /// By how much, m.
        by_m: f64,
    },
    /// The seam is not known that far.
    #[error("the place is {by_m:.5} m beyond the last seam point; at most {limit_m:.5} m are extrapolated")]
    BeyondSeam {
        /// By how much, m.
        by_m: f64,
        /// The limit, m.
        limit_m: f64,
    },
}
