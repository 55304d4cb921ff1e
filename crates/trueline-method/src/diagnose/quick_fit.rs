//! How well a recording fits, without all that a calibration asks beyond that.

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

/// How well a recording fits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct QuickFit {
    /// How much larger the residuals are than noise explains.
    pub noise_factor: f64,
    /// Share of inliers among the features.
    pub explained: f64,
}

impl QuickFit {
    /// What is left of the residuals in units of noise, the more the fewer features are explained.
    pub(super) fn left(&self) -> f64 {
        self.noise_factor / self.explained.max(LEAST_EXPLAINED)
    }
}

/// Fewer features explained than this are none.
pub(super) const LEAST_EXPLAINED: f64 = 0.01;

/// Fits a recording from nothing, its sensor held.
///
/// # Errors
/// As [`calibrate`](crate::calibrate()).
pub(super) fn quick_fit(recording: &Recording, config: &Config) -> Result<QuickFit, Error> {
    fitted(recording, config, search::likeliest)
}

/// The same at the time offset with which the robot's motion explains the seam's best: few starts are enough there. Where no offset
/// explains it, as [`quick_fit`].
///
/// # Errors
/// As [`quick_fit`].
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

/// Distance of the offsets that are tried, s: a fraction of what a solve finds by itself.
const OFFSET_STEP_S: f64 = 0.02;
/// How well the best of them is known, s.
const KNOWN_TO_S: f64 = 0.1;
/// An offset with which the robot's motion explains less of the seam's is none.
const LEAST_REGRESSED: f64 = 0.5;
/// Overlap of both streams, as a part of the images and in s.
const OVERLAP: (f64, f64) = (0.5, 2.0);

/// The time offset, within those that are searched, with which a linear regression of the seam's place on the robot's coordinates
/// leaves least: whatever is wrong with units and frames hardly changes it.
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
