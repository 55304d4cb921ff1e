//! Inputs of `conclude`.

use crate::adjustment::settings::Settings;
use crate::assess::correlated_noise::Structure;
use crate::assess::levels::SystematicLevels;
use crate::assess::misfit_cause::MisfitCause;
use crate::assess::robot_field::RobotSigmas;
use crate::calibration::Calibration;
use crate::config::{ASSUMED_WAVINESS_M, Config, HeldSigma, ResidualKind};
use crate::hypotheses::ambiguity::Ambiguity;
use crate::hypotheses::clock_drift::DriftFree;
use crate::hypotheses::feature_bias::TakenBias;
use crate::hypotheses::search::{BetterMinimum, Mirrored};
use crate::hypotheses::unbiased::{Assessed, inflation};
use crate::input::shape_knowledge::ShapeKnowledge;
use crate::input::timestamps::{Dejittered, Sampling};
use crate::problem::parameters::{LINES, ROTATION, TIME_OFFSET, TRANSLATION};
use crate::solve::drawn_lines;
use crate::solve::settings::FitSettings;
use nalgebra::DMatrix;
use trueline_dataset::Recording;

/// Inputs of `conclude`.
pub(crate) struct Concluded<'a> {
    pub(crate) recording: &'a Recording,
    pub(crate) sampling: &'a Sampling,
    pub(crate) dejittered: Dejittered,
    pub(crate) settings: &'a FitSettings<'a>,
    pub(crate) knowledge: &'a ShapeKnowledge,
    pub(crate) mirrored: Mirrored,
    pub(crate) ambiguity: Ambiguity,
    pub(crate) better: Option<BetterMinimum>,
    pub(crate) assessed: &'a Assessed,
    pub(crate) levels: SystematicLevels,
    /// The assumed robot errors.
    pub(crate) robot_taken: RobotSigmas,
    /// Robot errors from the residuals, where clearly larger.
    pub(crate) robot_seems: Option<RobotSigmas>,
    /// The bias that was removed from the features.
    pub(crate) bias: Option<TakenBias>,
    pub(crate) structure: Structure,
    pub(crate) cause: Option<MisfitCause>,
    pub(crate) time_offset_share: f64,
    /// The same scan with the sensor and the lines released, where they are held.
    pub(crate) released: Option<&'a Calibration>,
}

impl Concluded<'_> {
    /// Whether the sensor's file states an uncertainty that the residual ignores.
    pub(crate) fn ignores_uncertainty(&self) -> bool {
        self.recording.setup.uncertainty.is_some()
            && self.settings.config.residual == ResidualKind::PointToLine
    }

    /// Ratio of the covariance from noise to that from white noise.
    pub(crate) fn inflation(&self) -> f64 {
        inflation(&self.structure, &self.assessed.information)
    }

    /// What an adjustment takes beside noise: the stated errors, of a part at rest, of a robot without lag.
    pub(crate) fn adjustment<'b>(
        &'b self,
        held_sigmas: &'b [(usize, f64)],
        axis_sigmas: &'b [f64],
    ) -> Settings<'b> {
        let DriftFree { fit, stepped, .. } = &self.assessed.drift_free;
        Settings {
            fixed: self.settings.fixed,
            held_sigmas,
            levels: self.levels,
            waviness_m: waviness_m(self.recording, self.settings.config),
            noise_factor: fit.noise.factor,
            step: stepped.as_ref().map(|step| (step.at_s, step.step_s.abs())),
            lag_s: 0.0,
            joint_lags_s: 0.0,
            part: None,
            axis_sigmas,
            field: None,
            noise: None,
            threads: self.settings.config.threads,
        }
    }

    /// The held components that are not known exactly, each with its standard deviation, SI.
    pub(crate) fn held_sigmas(&self) -> Vec<(usize, f64)> {
        let HeldSigma { time_s, rotation_rad, translation_m } = self.settings.config.held_sigma;
        let stated = |component: &usize| match *component {
            TIME_OFFSET => time_s,
            ROTATION..TRANSLATION => rotation_rad,
            TRANSLATION..LINES => translation_m,
            _ => None,
        };
        let of_groups =
            self.settings.fixed.iter().filter_map(|component| Some((*component, stated(component)?)));
        of_groups.chain(drawn_lines::sigmas(&self.settings.config.drawn_lines)).collect()
    }

    /// Uncertainty of the time offset that the residuals do not show: noise in its column, and coarse stamps.
    pub(crate) fn with_time_offset_widened(&self, mut covariance: DMatrix<f64>) -> DMatrix<f64> {
        if self.settings.fixed.contains(&TIME_OFFSET) {
            return covariance;
        }
        // Noise in the Jacobian column makes the time offset, and everything correlated with it, look better known than it is. With motion share s,
        // the gradient's variance is 1 and the curvature from motion is s: the variance of the optimum is 1 / s².
        let variance = covariance[(TIME_OFFSET, TIME_OFFSET)];
        if self.time_offset_share < 1.0 && variance > 0.0 {
            let along = covariance.column(TIME_OFFSET).into_owned();
            covariance.ger((self.time_offset_share.powi(-2) - 1.0) / variance, &along, &along, 1.0);
        }
        let late_sigma_s = self.assessed.drift_free.observations.robot.late_sigma_s;
        let stamps_sigma_s = self.sampling.phase_sigma_s(self.dejittered).hypot(late_sigma_s);
        covariance[(TIME_OFFSET, TIME_OFFSET)] += stamps_sigma_s.powi(2);
        covariance
    }
}

/// Stated waviness of the seam, m.
pub(crate) fn waviness_m(recording: &Recording, config: &Config) -> f64 {
    config.waviness_m.or(recording.setup.waviness_m).unwrap_or(ASSUMED_WAVINESS_M)
}
