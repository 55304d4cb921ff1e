//! The bias of the features, as more of them come.

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

/// The sums from which the bias is estimated, and what was taken out already.
pub(super) struct Bias {
    sums: SystematicSums,
    taken_px: SVector<f64, BIAS>,
    inflation: f64,
}

impl Bias {
    /// Of the samples of a calibration that took a bias out.
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
        // One that is plainly there is taken to be as large as it seems.
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

    /// Adds new features, freed of what was taken.
    pub(super) fn add(&mut self, problem: &LineProblem<'_>, at: &Parameters) {
        self.sums.add(problem, at);
    }

    /// How the other unknowns follow what is now known better of the bias: `step` is how far they moved, `covariance` theirs.
    pub(super) fn followed(
        &mut self,
        step: &DVector<f64>,
        covariance: &DMatrix<f64>,
    ) -> Option<DVector<f64>> {
        self.sums.bias_after(step, root(covariance)?, &self.taken_px, self.inflation)
    }
}
