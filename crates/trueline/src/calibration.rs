//! The result: what was estimated, how well, what could not be, and whether it can be accepted.

use crate::observability::Observability;
use crate::parameters::Parameters;
use crate::residuals::{FeatureResidual, ResidualSummary};
use crate::{Config, Observations};
use nalgebra::DMatrix;
use std::collections::BTreeMap;
use trueline_geometry::Trajectory;
use trueline_lsq::Termination;

/// Whether the result can be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// Yes.
    Accepted,
    /// There is a result, but see the reasons.
    NotAccepted,
}

/// One step of the solver, as the paper's Figs. 6 to 8 draw it.
#[derive(Clone, Debug)]
pub struct IterationRecord {
    /// Cost ½ Σ ρ at this stage's loss.
    pub cost: f64,
    /// Root mean square distance from the line of all usable features, m.
    pub rms_m: f64,
    /// Unknowns before the step.
    pub parameters: Parameters,
    /// Whether the step was taken.
    pub accepted: bool,
}

/// What is known of a stream's stamps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StampSummary {
    /// Number of stamps.
    pub count: usize,
    /// Median time between stamps, s.
    pub median_period_s: f64,
    /// Longest time between stamps, s.
    pub longest_gap_s: f64,
}

impl StampSummary {
    /// Sums up rising stamps, s.
    #[must_use]
    pub fn of(stamps: &[f64]) -> Self {
        let mut steps: Vec<f64> = stamps.windows(2).map(|w| w[1] - w[0]).collect();
        let longest_gap_s = steps.iter().copied().fold(0.0, f64::max);
        let middle = steps.len() / 2;
        let median_period_s =
            if steps.is_empty() { 0.0 } else { *steps.select_nth_unstable_by(middle, f64::total_cmp).1 };
        Self { count: stamps.len(), median_period_s, longest_gap_s }
    }

    /// Of a trajectory.
    #[must_use]
    pub fn of_trajectory(trajectory: &Trajectory) -> Self {
        Self::of(trajectory.times())
    }

    /// Of the images: features of one image count once.
    #[must_use]
    pub fn of_images(observations: &Observations) -> Self {
        let mut stamps: Vec<f64> = observations.list.iter().map(|o| o.stamp_s).collect();
        stamps.dedup();
        Self::of(&stamps)
    }
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
    /// [`Observability::seen_components`].
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
    /// Robot stamps.
    pub robot_stamps: StampSummary,
    /// Image stamps.
    pub image_stamps: StampSummary,
    /// Noise of a recorded robot position, per axis, as measured on the stream, m.
    pub robot_noise_m: f64,
    /// Whether the robot's poses were replaced by a local fit.
    pub robot_smoothed: bool,
    /// RMS of the points about the sheet that was fitted to them, m.
    pub sheet_fit_rms_m: Option<f64>,
    /// Time 0 of the residuals' stamps, ns.
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
        let known = self.estimated[component] && self.observability.seen_components[component];
        known.then(|| self.covariance[(component, component)].max(0.0).sqrt())
    }

    /// Whether the value of a component means anything: it was held, or it is seen.
    #[must_use]
    pub fn is_known(&self, component: usize) -> bool {
        self.observability.seen_components[component]
    }
}
