//! A reported change: with the names of welds, its size and the tolerance.

use crate::detect::{Alarm, Link, SeamError};

/// State after a weld.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// No change is seen.
    Good,
    /// A change that moves seam points by less than the tolerance.
    WithinTolerance,
    /// An alarm.
    Alarm,
}

impl State {
    /// The word in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::WithinTolerance => "changed-within-tolerance",
            Self::Alarm => "alarm",
        }
    }
}

/// A reported change.
#[derive(Clone, Debug)]
pub struct Told {
    /// The change.
    pub alarm: Alarm,
    /// The number of the first weld after the change.
    pub since_number: i64,
    /// Its name.
    pub since: String,
    /// Number and name of the weld from which on all welds contradict the calibration.
    pub out_since: (i64, String),
    /// Displacement of seam points.
    pub seam_error: SeamError,
    /// Allowed displacement, m.
    pub tolerance_m: Option<f64>,
    /// Whether it is within the tolerance.
    pub is_within: bool,
    /// Whether the user reported a repair just there.
    pub was_claimed: bool,
    /// Name of the axis that carries the part, or of several; `None` without one.
    pub axis: Option<String>,
}

/// A change is within the tolerance if it is by this number of standard deviations.
const SURELY: f64 = 2.0;

impl Told {
    /// A change with its words' numbers. `was_within`: whether the previous weld was reported as within the tolerance.
    #[must_use]
    pub fn of(
        alarm: Alarm,
        welds: [(i64, String); 2],
        seam_error: SeamError,
        tolerance: (Option<f64>, bool),
    ) -> Self {
        let [(since_number, since), out_since] = welds;
        let (tolerance_m, was_within) = tolerance;
        // A change is within the tolerance if it surely is, and stays so until its estimate exceeds the tolerance. A change
        // may be of any size along an axis that these welds do not show.
        let is_shown = seam_error.is_shown_whole();
        let whole = seam_error.total.filter(|_| is_shown);
        let is_within = tolerance_m.zip(whole).is_some_and(|(tolerance_m, [error_m, sigma_m])| {
            error_m + SURELY * sigma_m <= tolerance_m || was_within && error_m <= tolerance_m
        });
        Self {
            alarm,
            since_number,
            since,
            out_since,
            seam_error,
            tolerance_m,
            is_within,
            was_claimed: false,
            axis: None,
        }
    }

    /// The links of the cell that may have moved, by the names that a user knows.
    #[must_use]
    pub fn links(&self) -> Vec<String> {
        let name = |link: &Link| match (link, &self.axis) {
            (Link::Axis, Some(axis)) => format!("{} {axis}", link.name()),
            _ => link.name().to_owned(),
        };
        self.alarm.links.iter().map(name).collect()
    }

    /// Whether only the axis under the part has moved.
    pub(crate) fn is_of_axis(&self) -> bool {
        self.alarm.links == [Link::Axis]
    }

    /// Whether it is an alarm.
    #[must_use]
    pub fn state(&self) -> State {
        if self.is_within { State::WithinTolerance } else { State::Alarm }
    }
}
