//! How well a recording fits, without all that a calibration asks beyond that.

use crate::assess::residuals;
use crate::config::Config;
use crate::error::Error;
use crate::hypotheses::search;
use crate::input::noise_levels::NoiseLevels;
use crate::input::observations::{observe, origin_ns};
use crate::input::timestamps::{Dejittered, Sampling};
use crate::solve::settings::FitSettings;
use crate::solve::solver::Solver;
use trueline_dataset::Recording;

/// How well a recording fits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct QuickFit {
    /// How much larger the residuals are than noise explains.
    pub noise_factor: f64,
    /// Part of the features that is no outlier.
    pub explained: f64,
}

/// Fits a recording from nothing, its sensor held.
///
/// # Errors
/// As [`calibrate`](crate::calibrate()).
pub(super) fn quick_fit(recording: &Recording, config: &Config) -> Result<QuickFit, Error> {
    let sampling = Sampling::of(recording, origin_ns(recording));
    let observations = observe(recording, &sampling, config)?;
    let noise = NoiseLevels {
        robot_sigma_m: config.robot_sigma_m.unwrap_or(observations.robot.noise_m),
        stamp_sigma_s: sampling.stamp_sigma_s(config, Dejittered::default()),
        factor: 1.0,
    };
    let settings = FitSettings { config, noise, fixed: &[], prior: None, shape_prior: None };
    let fit = search::likeliest(&Solver { observations: &observations, settings })?;
    let (features, skipped) = residuals::evaluate(&fit.problem(&observations, config), fit.parameters());
    let explained = residuals::summarise(&features, skipped).inlier_share();
    Ok(QuickFit { noise_factor: fit.noise.factor, explained })
}
