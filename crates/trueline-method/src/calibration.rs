//! The result: what was estimated, how well, what could not be, and whether it can be accepted.

use crate::Config;
use crate::assess::cross_validation::HeldOut;
use crate::assess::observability::Observability;
use crate::assess::outlier_segments::OutlierSegment;
use crate::assess::residuals::{FeatureResidual, ResidualSummary};
use crate::assess::seam_point_error::SeamPointError;
use crate::hypotheses::ambiguity::Ambiguity;
use crate::hypotheses::drift_and_step::{Drift, Step};
use crate::input::timestamps::StampReport;
use crate::problem::parameters::{Parameters, ROTATION, TRANSLATION};
use crate::solve::iteration_record::IterationRecord;
use nalgebra::DMatrix;
use std::collections::BTreeMap;
use trueline_lsq::Termination;

/// Whether the result can be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// Yes.
    Accepted,
    /// There is a result, but see the reasons.
    NotAccepted,
}

/// A finished calibration.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// Whether it can be accepted.
    pub status: Status,
    /// Why not, if not.
    pub reasons: Vec<String>,
    /// Usable, but look here.
    pub warnings: Vec<String>,
    /// The estimates. Components that are not seen hold a meaningless number: see
    /// [`Observability::observable_components`].
    pub parameters: Parameters,
    /// Covariance of the tangent, SI units.
    pub covariance: DMatrix<f64>,
    /// Whether a component of the tangent was estimated, not held.
    pub estimated: Vec<bool>,
    /// What can be seen.
    pub observability: Observability,
    /// Residual figures.
    pub residuals: ResidualSummary,
    /// Every feature's residual.
    pub features: Vec<FeatureResidual>,
    /// How much larger the residuals are than expected.
    pub noise_factor: f64,
    /// Part of the covariance that is the model's, 0 to 1.
    pub covariance_model_share: f64,
    /// Why the solver ended.
    pub termination: Termination,
    /// Every step of the solver on all features.
    pub iterations: Vec<IterationRecord>,
    /// Unseen directions were held at the initial guess, as the user allowed.
    pub held_at_guess: bool,
    /// What else explains the scan, and what decided.
    pub ambiguity: Ambiguity,
    /// The parts of the scan against each other.
    pub held_out: Option<HeldOut>,
    /// What it means at the torch; `None` if something of the hand-eye is not seen.
    pub at_torch: Option<SeamPointError>,
    /// Drift of the time offset, be it chance.
    pub drift: Option<Drift>,
    /// A drift that the image clock has; it has been taken out.
    pub drifted: Option<Drift>,
    /// The most likely step of a clock, be it chance.
    pub step: Option<Step>,
    /// A step that a clock has made.
    pub stepped: Option<Step>,
    /// Stretches of the scan that do not belong to the rest.
    pub disruptions: Vec<OutlierSegment>,
    /// Robot stamps.
    pub robot_stamps: StampReport,
    /// Image stamps.
    pub image_stamps: StampReport,
    /// Noise of a recorded robot position, per axis, as measured on the stream, m.
    pub robot_noise_m: f64,
    /// Robot samples that only repeat the pose before, and were left out.
    pub robot_poses_repeated: usize,
    /// Whether the robot's poses were replaced by a local fit.
    pub robot_smoothed: bool,
    /// RMS of the points about the sheet that was fitted to them, m.
    pub sheet_fit_rms_m: Option<f64>,
    /// Recorded stamp of each of `features`, ns.
    pub feature_stamps_ns: Vec<i64>,
    /// Recorded stamp of time 0 of all stamps in seconds: the first robot sample, ns.
    pub origin_ns: i64,
    /// SHA-256 of the inputs.
    pub inputs: BTreeMap<String, String>,
    /// The options it was made with.
    pub config: Config,
}

impl Calibration {
    /// Standard deviation of a component of the tangent, SI; `None` if it was held or is not seen.
    #[must_use]
    pub fn sigma(&self, component: usize) -> Option<f64> {
        let known = self.estimated[component] && self.observability.observable_components[component];
        known.then(|| self.covariance[(component, component)].max(0.0).sqrt())
    }

    /// Whether the value of a component means anything: it was held, or it is seen.
    #[must_use]
    pub fn is_known(&self, component: usize) -> bool {
        self.held_at_guess || self.observability.observable_components[component]
    }

    /// Whether the hand-eye rotation means anything; its components one by one are no quaternion.
    #[must_use]
    pub fn rotation_is_known(&self) -> bool {
        (ROTATION..TRANSLATION).all(|k| self.is_known(k))
    }
}
