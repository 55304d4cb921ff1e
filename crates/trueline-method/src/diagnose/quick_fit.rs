//! Fit quality of a recording, without the other parts of a calibration.

use crate::assess::residuals;
use crate::config::Config;
use crate::diagnose::mistake::with_image_stamps;
use crate::diagnose::shift_regression::{ShiftRegression, places};
use crate::error::Error;
use crate::hypotheses::search;
use crate::input::noise_levels::NoiseLevels;
use crate::input::observations::{observe_by, origin_ns};
use crate::input::timestamps::Sampling;
use crate::solve::fit::Fit;
use crate::solve::settings::FitSettings;
use crate::solve::solver::Solver;
use trueline_dataset::Recording;

/// Fit quality of a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct QuickFit {
    /// Noise factor.
    pub noise_factor: f64,
    /// Share of inliers among the features.
    pub explained: f64,
}

impl QuickFit {
    /// Residuals in units of noise, increased if fewer features are explained.
    pub(super) fn left(&self) -> f64 {
        self.noise_factor / self.explained.max(LEAST_EXPLAINED)
    }
}

/// Least fraction of explained features.
pub(super) const LEAST_EXPLAINED: f64 = 0.01;

/// Fits a recording without a guess, with its sensor held.
///
/// # Errors
/// Those of [`calibrate`](crate::calibrate()).
pub(super) fn quick_fit(recording: &Recording, config: &Config) -> Result<QuickFit, Error> {
    fitted(recording, config, search::likeliest)
}

/// The same at the time offset at which the robot's motion best explains the seam's. Few starts are sufficient there. If no offset explains it, the
/// result is that of [`quick_fit`].
///
/// # Errors
/// Those of [`quick_fit`].
pub(super) fn glance(recording: &Recording, config: &Config) -> Result<QuickFit, Error> {
    let Some(offset_s) = likeliest_offset_s(recording, config) else { return quick_fit(recording, config) };
    let offset_ns = (offset_s * 1e9).round() as i64;
    let there = with_image_stamps(recording, |stamp_ns| stamp_ns - offset_ns);
    fitted(&there, &Config { offset_search_s: KNOWN_TO_S, ..config.clone() }, search::glance)
}

fn fitted(
    recording: &Recording,
    config: &Config,
    search: impl Fn(&Solver<'_>) -> Result<Fit, Error>,
) -> Result<QuickFit, Error> {
    let sampling = Sampling::of(recording, origin_ns(recording));
    let dejittered = sampling.of_arrival(config);
    let observations = observe_by(dejittered, recording, &sampling, config)?;
    let noise = NoiseLevels {
        robot_sigma_m: config.robot_sigma_m.unwrap_or(observations.robot.noise_m),
        stamp_sigma_s: sampling.stamp_sigma_s(config, dejittered),
        factor: 1.0,
    };
    let settings = FitSettings { config, noise, fixed: &[], prior: None, shape_prior: None };
    let fit = search(&Solver { observations: &observations, settings })?;
    let (features, skipped) = residuals::evaluate(&fit.problem(&observations, config), fit.parameters());
    let explained = residuals::summarise(&features, skipped).inlier_share();
    Ok(QuickFit { noise_factor: fit.noise.factor, explained })
}

/// Step between the offsets that are tried, s: a fraction of a solve's basin of convergence.
const OFFSET_STEP_S: f64 = 0.02;
/// Uncertainty of the best of them, s.
const KNOWN_TO_S: f64 = 0.1;
/// Least fraction of the seam's motion that a plausible offset explains.
const LEAST_REGRESSED: f64 = 0.5;
/// Overlap of both streams, as a fraction of the images and in s.
const OVERLAP: (f64, f64) = (0.5, 2.0);

/// The searched time offset with the smallest residuals of a linear regression of the seam's place on the robot's coordinates. Mistakes in units and
/// frames hardly affect it.
fn likeliest_offset_s(recording: &Recording, config: &Config) -> Option<f64> {
    let between_ns = recording.features.first()?.stamp_ns - recording.robot.first()?.stamp_ns;
    let between_s = between_ns as f64 * 1e-9;
    let regression = ShiftRegression::new(recording, places(&recording.features), OVERLAP.0, OVERLAP.1)?;
    let steps = (config.offset_search_s / OFFSET_STEP_S).round() as i32;
    let offsets = (-steps..=steps).map(|k| f64::from(k) * OFFSET_STEP_S);
    let scored = offsets.filter_map(|offset_s| Some((regression.at(offset_s - between_s)?, offset_s)));
    let (best, offset_s) = scored.max_by(|a, b| a.0.score.total_cmp(&b.0.score))?;
    (best.explained > LEAST_REGRESSED).then_some(offset_s)
}
