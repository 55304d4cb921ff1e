//! The bias of the features, updated with new ones.

use super::sums::root;
use crate::assess::correlated_noise::Structure;
use crate::assess::levels::SystematicLevels;
use crate::assess::systematic::SystematicSums;
use crate::assess::tilt_bias::BIAS;
use crate::calibration::Calibration;
use crate::config::Config;
use crate::problem::line_problem::LineProblem;
use crate::problem::parameters::Parameters;
use nalgebra::{DMatrix, DVector, SVector};

/// The sums for the estimate of the bias, and the bias already removed.
pub(super) struct Bias {
    sums: SystematicSums,
    taken_px: SVector<f64, BIAS>,
    inflation: f64,
}

impl Bias {
    /// From the samples of a calibration that removed a bias.
    pub(super) fn of(
        calibration: &Calibration,
        problem: &LineProblem<'_>,
        config: &Config,
        covariance: &DMatrix<f64>,
        inflation: f64,
    ) -> Option<Self> {
        let checks = &calibration.findings.checks;
        let bias = checks.feature_bias.as_ref()?;
        let taken_px: SVector<f64, BIAS> = SVector::from_fn(|k, _| bias.px[k / 2][k % 2]);
        // A clearly significant bias gets its estimated size as level.
        let stated_px = config.feature_bias_px;
        let feature_bias_px = if bias.is_found { stated_px.max(taken_px.amax()) } else { stated_px };
        let levels = SystematicLevels {
            robot_accuracy_m: 0.0,
            robot: checks.robot_taken,
            robot_is_stated: false,
            edge_radius_m: 0.0,
            edge_is_stated: false,
            feature_bias_px,
            bias_is_estimated: true,
            held_shape: None,
        };
        let sums = SystematicSums::of(problem, calibration.best_fit(), &root(covariance)?, &levels);
        let is_correlated = matches!(calibration.findings.fit.structure, Structure::Correlated(_));
        Some(Self { sums, taken_px, inflation: if is_correlated { inflation } else { 1.0 } })
    }

    /// Adds new features, with the bias removed.
    pub(super) fn add(&mut self, problem: &LineProblem<'_>, at: &Parameters) {
        self.sums.add(problem, at);
    }

    /// Change of the other unknowns from the improved bias. `step` is their own change, and `covariance` theirs.
    pub(super) fn followed(
        &mut self,
        step: &DVector<f64>,
        covariance: &DMatrix<f64>,
    ) -> Option<DVector<f64>> {
        self.sums.bias_after(step, root(covariance)?, &self.taken_px, self.inflation)
    }
}
