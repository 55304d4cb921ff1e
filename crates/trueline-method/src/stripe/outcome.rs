//! Result of the whole-stripe estimate, and whether it or the seam points' result is reported.

use crate::assess::observability::Observability;
use crate::assess::seam_error::SeamError;
use crate::config::Measurements;
use crate::error::no_plates::NoPlates;
use crate::input::skip::Skip;
use crate::problem::parameters::Parameters;
use crate::stripe::outlier_counts::OutlierCounts;
use crate::stripe::planes::{JointAngle, JointStep, PlaneEstimate};
use nalgebra::DMatrix;
use std::collections::BTreeMap;

/// Share of the frames in which both plates must be seen for stripes to be used by default.
pub const LEAST_WITH_BOTH: f64 = 0.8;

/// Seam errors that differ by less than this factor are of the same kind: which errors an answer counts as estimated or assumed moves
/// them by as much.
const CLEARLY: f64 = 1.25;

/// Why it is the answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Because {
    /// The user asked for it.
    Asked,
    /// Both agree, and the stripes' seam error is not clearly larger.
    Agreement,
    /// Both agree, but the stripes' seam error is more than 1.25 times that of the seam points.
    KnowsLess,
    /// Most of the noise lasts from one frame to the next: the seam points are adjusted with that, and the stripes are not.
    NoiseLasts,
    /// The hand-eye transform is not fully observable from the stripes.
    ShowsLess,
    /// They do not agree.
    Disagreement,
    /// Too few frames show both plates.
    TooFewFrames,
    /// The plates make no joint.
    Plates(NoPlates),
    /// What the scan does not show is held at a guess, which the stripes are not.
    HeldAtGuess,
}

impl Because {
    /// The name in the result.
    #[must_use]
    pub fn code(self) -> &'static str {
        match self {
            Self::Asked => "asked",
            Self::Agreement => "agreement",
            Self::KnowsLess => "knows-less",
            Self::NoiseLasts => "noise-lasts",
            Self::ShowsLess => "shows-less",
            Self::Disagreement => "disagreement",
            Self::TooFewFrames => "too-few-frames",
            Self::Plates(NoPlates::Missing { .. }) => "plates-missing",
            Self::Plates(NoPlates::NoPlane) => "plates-without-plane",
            Self::Plates(NoPlates::Scattered { .. }) => "stripes-scattered",
            Self::Plates(NoPlates::NotConverged) => "plates-not-converged",
            Self::Plates(NoPlates::Parallel) => "parallel-plates",
            Self::Plates(NoPlates::EdgeElsewhere { .. }) => "edge-elsewhere",
            Self::HeldAtGuess => "held-at-guess",
        }
    }
}

/// One answer, in the unknowns of a seam.
#[derive(Clone, Debug)]
pub struct Answer {
    /// Where it is.
    pub parameters: Parameters,
    /// Covariance of everything that is accounted for.
    pub covariance: DMatrix<f64>,
    /// The part of it that is noise.
    pub noise_covariance: DMatrix<f64>,
    /// Visible parts.
    pub observability: Observability,
    /// Error of a seam point that is measured later; `None` if something of the hand-eye is not seen.
    pub seam_error: Option<SeamError>,
}

/// The plates' estimate, and both answers side by side.
#[derive(Clone, Debug)]
pub struct StripeEstimate {
    /// The plates.
    pub planes: Vec<PlaneEstimate>,
    /// The angles of the joints whose plates meet.
    pub angles: Vec<JointAngle>,
    /// The steps of those whose plates are parallel.
    pub steps: Vec<JointStep>,
    /// How far both answers are apart, in sigma; `None` if nothing of them can be compared.
    pub sigmas_apart: Option<f64>,
    /// Distance in the user's quantities.
    pub apart: Apart,
    /// Noise factor: noise divided by the expected noise.
    pub noise_factor: f64,
    /// Counts of used and rejected measurements.
    pub counts: OutlierCounts,
    /// Whether the plates' forms explain what seemed to be errors of the robot by the seam points.
    pub explains_robot: bool,
    /// Answer of the seam points.
    pub seam: Answer,
    /// Answer of the stripes.
    pub stripe: Answer,
}

/// Distance of two answers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Apart {
    /// Time offset of the stripes less that of the seam points, s.
    pub time_offset_s: f64,
    /// Where they place a point in the middle of what was seen, in the tool, m.
    pub point_m: f64,
}

/// Answers that differ by more standard deviations contradict each other: one of them is wrong by more than any ± allows for.
const CONTRADICTION_SIGMAS: f64 = 10.0;

impl StripeEstimate {
    /// How many standard deviations the two answers are apart, where that is too far and nobody has said which is to be used.
    #[must_use]
    pub(crate) fn contradicts(&self, because: Because) -> Option<f64> {
        let is_open = because == Because::Disagreement;
        self.sigmas_apart.filter(|apart| is_open && *apart >= CONTRADICTION_SIGMAS)
    }

    /// Whether the stripes' predicted seam error exceeds that of the seam points by more than a factor of 1.25, all error sources counted.
    #[must_use]
    pub(crate) fn is_clearly_less_accurate(&self) -> bool {
        match (&self.stripe.seam_error, &self.seam.seam_error) {
            (Some(by_stripe), Some(by_seam)) => by_stripe.rms_m > CLEARLY * by_seam.rms_m,
            (by_stripe, _) => by_stripe.is_none(),
        }
    }
}

/// Outcome for the stripes of a recording.
#[derive(Clone, Debug)]
pub struct StripeOutcome {
    /// Measurements that the answer was computed from.
    pub used: Measurements,
    /// Reason.
    pub because: Because,
    /// Frames with a seam point or a stripe.
    pub frames: usize,
    /// Frames with both plates; of a joint of one plate, with that and its edge.
    pub with_both: usize,
    /// Stripes that could not be used.
    pub skipped: BTreeMap<Skip, usize>,
    /// By how much stripes are stamped later than the seam point of the same picture, where that is most, s.
    pub stamped_later_s: f64,
    /// The estimate; `None` where there is none.
    pub estimate: Option<Box<StripeEstimate>>,
}
