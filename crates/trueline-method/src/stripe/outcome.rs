//! Result of the whole-stripe estimate, and whether it or the seam points' result is reported.

use crate::adjustment::answer::FramesUsed;
use crate::adjustment::error_sizes::Amplitudes;
use crate::assess::observability::Observability;
use crate::assess::outliers::Outliers;
use crate::assess::robot_field::OfRobot;
use crate::assess::seam_error::SeamError;
use crate::config::Measurements;
use crate::error::no_plates::NoPlates;
use crate::input::skip::Skip;
use crate::models::Block;
use crate::problem::parameters::Parameters;
use crate::stripe::outlier_counts::OutlierCounts;
use crate::stripe::planes::{JointAngle, JointStep, PlaneEstimate};
use nalgebra::{DMatrix, Point3, Vector3};
use std::collections::BTreeMap;
use trueline_geometry::Pose;

/// Answers that differ by more standard deviations than this disagree.
pub(crate) const AGREEMENT_SIGMAS: f64 = 3.0;

/// Minimum fraction of frames with both plates visible for stripes to be used by default.
pub const LEAST_WITH_BOTH: f64 = 0.8;

/// Seam errors within this factor count as equal. The split into estimated and assumed errors changes them by as much.
const CLEARLY: f64 = 1.25;

/// Reason for the selected answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Because {
    /// The user asked for it.
    Asked,
    /// Both agree, and the stripes' seam error is not clearly larger.
    Agreement,
    /// Both agree, but the stripes' seam error is more than 1.25 times that of the seam points.
    KnowsLess,
    /// The hand-eye transform is not fully observable from the stripes.
    ShowsLess,
    /// They do not agree.
    Disagreement,
    /// Too few frames show both plates.
    TooFewFrames,
    /// The plates form no joint.
    Plates(NoPlates),
    /// Unobservable directions are held at a guess, which stripes do not support.
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
    /// The unknowns.
    pub parameters: Parameters,
    /// Total covariance.
    pub covariance: DMatrix<f64>,
    /// Its random part.
    pub noise_covariance: DMatrix<f64>,
    /// Its observability.
    pub observability: Observability,
    /// Predicted error of a later seam point. `None` if part of the hand-eye transform is unobservable.
    pub seam_error: Option<SeamError>,
}

/// The plates' estimate with both answers.
#[derive(Clone, Debug)]
pub struct StripeEstimate {
    /// The plates.
    pub planes: Vec<PlaneEstimate>,
    /// The angles of joints whose plates meet.
    pub angles: Vec<JointAngle>,
    /// The steps of joints whose plates are parallel.
    pub steps: Vec<JointStep>,
    /// Distance of both answers, σ. `None` if nothing can be compared.
    pub sigmas_apart: Option<f64>,
    /// Distance in the user's quantities.
    pub apart: Apart,
    /// Noise factor: noise divided by the expected noise.
    pub noise_factor: f64,
    /// Counts of used and rejected measurements.
    pub counts: OutlierCounts,
    /// Their adjustment with all errors; `None` beside a curve.
    pub adjustment: Option<StripeAdjustment>,
    /// Whether the plates' forms explain the robot errors that the seam points seem to show.
    pub explains_robot: bool,
    /// Answer of the seam points.
    pub seam: Answer,
    /// Answer of the stripes.
    pub stripe: Answer,
    /// The part of the robot's errors in it; `None` of an ideal robot.
    pub of_robot: Option<OfRobot>,
}

/// The adjustment of stripes with all errors.
#[derive(Clone, Debug)]
pub struct StripeAdjustment {
    /// Estimated errors.
    pub amplitudes: Amplitudes,
    /// The blocks that were estimated beside the unknowns.
    pub(crate) blocks: Vec<Block>,
    /// Log likelihood.
    pub(crate) log_evidence: f64,
    /// Noise factor of the fit that it started at.
    pub(crate) noise_factor: f64,
    /// Outliers of each joint.
    pub(crate) of_joints: Vec<Outliers>,
    /// Its frames. One with a rejected stripe or edge point counts as left out.
    pub(crate) frames: FramesUsed,
}

/// Distance of two answers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Apart {
    /// Time offset of the stripes minus that of the seam points, s.
    pub time_offset_s: f64,
    /// Distance of the middle of the visible part, placed by both, in the tool, m.
    pub point_m: f64,
}

impl Apart {
    /// Of two answers, each a time offset, s, and a hand-eye transform, at the middle of points in the camera, m.
    #[must_use]
    pub(crate) fn at(points: impl Iterator<Item = Vector3<f64>>, [one, other]: [(f64, Pose); 2]) -> Self {
        let mut middle = Vector3::zeros();
        let mut count = 0.0;
        points.for_each(|point| (middle, count) = (middle + point, count + 1.0));
        let middle = Point3::from(middle / f64::max(count, 1.0));
        Self {
            time_offset_s: other.0 - one.0,
            point_m: (other.1.transform_point(&middle) - one.1.transform_point(&middle)).norm(),
        }
    }
}

/// Answers that differ by more standard deviations contradict each other: one is wrong by more than any stated uncertainty allows.
const CONTRADICTION_SIGMAS: f64 = 10.0;

impl StripeEstimate {
    /// Distance of the two answers in standard deviations, if it is too large and the user has not selected one.
    #[must_use]
    pub(crate) fn contradicts(&self, because: Because) -> Option<f64> {
        let is_open = because == Because::Disagreement;
        self.sigmas_apart.filter(|apart| is_open && *apart >= CONTRADICTION_SIGMAS)
    }

    /// Whether the stripes' predicted seam error exceeds that of the seam points by more than a factor of 1.25, with all error sources.
    #[must_use]
    pub(crate) fn is_clearly_less_accurate(&self) -> bool {
        match (&self.stripe.seam_error, &self.seam.seam_error) {
            (Some(by_stripe), Some(by_seam)) => by_stripe.rms_m > CLEARLY * by_seam.rms_m,
            (by_stripe, _) => by_stripe.is_none(),
        }
    }
}

/// By default the stripe estimate is used if it agrees with the seam points and is not clearly less certain.
pub(crate) fn decided(estimate: &StripeEstimate) -> Because {
    match estimate.sigmas_apart {
        Some(apart) if apart >= AGREEMENT_SIGMAS => Because::Disagreement,
        _ if estimate.stripe.seam_error.is_none() => Because::ShowsLess,
        Some(_) if !estimate.is_clearly_less_accurate() => Because::Agreement,
        _ => Because::KnowsLess,
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
    /// Frames with both plates. For a joint of one plate, frames with that plate and its edge.
    pub with_both: usize,
    /// Stripes that could not be used.
    pub skipped: BTreeMap<Skip, usize>,
    /// Largest delay of the stripes' stamps relative to the seam point of the same image, s.
    pub stamped_later_s: f64,
    /// The estimate; `None` where there is none.
    pub estimate: Option<Box<StripeEstimate>>,
}
