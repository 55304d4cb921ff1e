//! Diagnoses a recording that does not calibrate: messages of a calibration, implausible motions, and usual mistakes. Each mistake is undone in
//! turn, and the one without which the scan fits is reported.

use crate::calibrate::estimate;
use crate::config::{Config, Target};
use crate::diagnose::outcome::Outcome;
use crate::diagnose::plausibility::{implausible, turns_like_a_robot, wrong_guess, wrong_rate};
use crate::diagnose::stamp_rate::stamped_hz;
use crate::diagnose::steps::{Budget, Step, Steps};
use crate::diagnose::told;
use crate::diagnose::trials::{CALIBRATION_COSTS, FEW, Trial, Trials, explanations};
use crate::input::stops;
use crate::thinning::stride;
use crate::{Calibration, Error, Status};
use std::time::Duration;
use tracing::field;
use trueline_dataset::Recording;

/// The result of the diagnosis.
#[derive(Clone, Debug)]
pub struct Diagnosis {
    /// The outcome for the recording as it is.
    pub as_recorded: Outcome,
    /// Its calibration with noise alone and at most 1500 features, if there is one.
    pub calibration: Option<Calibration>,
    /// Trials without each mistake. Empty if the recording fits as it is.
    pub trials: Vec<Trial>,
    /// Names of mistakes that were not tried for lack of time.
    pub not_tried: Vec<String>,
    /// Names of the trials that explain a bad fit, the most likely first.
    pub explained_by: Vec<String>,
    /// Problems in a user's words, the likeliest first. Empty without problems.
    pub findings: Vec<String>,
}

impl Diagnosis {
    /// The recording without the mistake that explains its bad fit. `None` if no mistake does, or more than one.
    #[must_use]
    pub fn mended(&self, recording: &Recording) -> Option<Recording> {
        let [name] = &self.explained_by[..] else { return None };
        self.trials.iter().find(|trial| trial.name == *name).and_then(|trial| trial.mend.of(recording))
    }
}

/// Maximum number of features used.
const FEATURES: usize = 1500;

/// Examines a recording. `watch` is called before each trial. `longest` after the fit of the recording as it is
/// no further mistake is tried.
pub fn diagnose(
    recording: &Recording,
    config: &Config,
    longest: Option<Duration>,
    watch: impl FnMut(Step<'_>),
) -> Diagnosis {
    let span = tracing::info_span!("doctor", trials = field::Empty);
    let _stage = span.enter();
    let thin = thinned(recording, FEATURES);
    let mut steps = Steps::new(watch);
    steps.expect(CALIBRATION_COSTS);
    steps.begin("as recorded", CALIBRATION_COSTS);
    let by_noise = by_noise(config);
    let result = estimate(&thin, None, &by_noise);
    let as_recorded = Outcome::of(&result);
    // A fit of wrong data may take longer than all mistakes.
    let budget = Budget::of(longest);
    let certain = implausible(recording);
    let is_plausible = turns_like_a_robot(recording);
    // A few stops that fit cannot separate one mistake from another.
    let stands = recording.at_stops || stops::stand_at_readings(recording);
    let is_well = as_recorded.is_noise() && !as_recorded.sensor_is_off || stands && as_recorded.fits();
    let few = thinned(recording, FEW);
    let mut trials = Trials {
        recording: &thin,
        few: &few,
        config: &by_noise,
        as_recorded: &as_recorded,
        steps: &mut steps,
        budget,
        stamped_hz: stamped_hz(recording),
        is_plausible,
        done: Vec::new(),
        not_tried: Vec::new(),
    };
    if !is_well {
        trials.run();
    }
    let Trials { done, not_tried, .. } = trials;
    span.record("trials", done.len());
    let (explained_by, mut findings): (Vec<_>, Vec<_>) =
        explanations(&as_recorded, &done).into_iter().unzip();
    findings.extend(certain);
    // As `trueline calibrate`, with the thinned features.
    let is_asked = as_recorded.fits() || explained_by.is_empty() && is_plausible;
    let whole = is_asked.then(|| estimate(&thin, None, config)).and_then(Result::ok);
    if let Some(curve) = whole.as_ref().filter(|whole| is_curve(whole)) {
        findings.extend(told::of_data(curve));
        let as_recorded = Outcome::of(&Ok(curve.clone()));
        return Diagnosis {
            as_recorded,
            calibration: whole,
            trials: done,
            not_tried,
            explained_by,
            findings,
        };
    }
    findings.extend(told(recording, &result, whole.as_ref()));
    if findings.is_empty() && !as_recorded.fits() {
        findings.push(unexplained(&result, not_tried.len()));
    }
    Diagnosis { as_recorded, calibration: result.ok(), trials: done, not_tried, explained_by, findings }
}

/// Options for the search of mistakes. A shape of the sensor, or a curve, would absorb part of a mistake. Robot errors and bias only widen the
/// uncertainties.
fn by_noise(config: &Config) -> Config {
    let noise_only = Config::noise_only();
    Config {
        target: Target::Line,
        sensor: noise_only.sensor,
        robot_accuracy_m: noise_only.robot_accuracy_m,
        feature_bias_px: noise_only.feature_bias_px,
        ..config.clone()
    }
}

/// Whether the scan is a correct one over a curve.
fn is_curve(calibration: &Calibration) -> bool {
    calibration.findings.curve.is_some() && calibration.status() == Status::Accepted
}

/// Messages of calibrations about the data and the guess. If a mistake is known, its consequences are left out.
fn told(
    recording: &Recording,
    by_noise: &Result<Calibration, Error>,
    whole: Option<&Calibration>,
) -> Vec<String> {
    let Ok(by_noise) = by_noise else { return Vec::new() };
    let fits = Outcome::of(&Ok(by_noise.clone())).fits();
    let mut told: Vec<String> =
        wrong_rate(by_noise, stamped_hz(recording)).filter(|_| fits).into_iter().collect();
    told.extend(whole.into_iter().flat_map(told::of_data));
    told.extend(recording.initial.iter().filter(|_| fits).flat_map(|guess| wrong_guess(by_noise, guess)));
    told
}

/// Message if no mistake explains the bad fit.
fn unexplained(result: &Result<Calibration, Error>, not_tried: usize) -> String {
    match result {
        Err(error) => format!("{error}; {}", error.hint()),
        Ok(_) if not_tried > 0 => format!(
            "no mistake that was tried explains the bad fit; {not_tried} others were not tried for lack of time: `--longest-s 120` tries them"
        ),
        Ok(_) => "none of the usual mistakes explains the bad fit. Check that laser plane and camera belong \
             together, that the line is straight and did not move, and that robot.csv and features.csv come \
             from one scan"
            .to_owned(),
    }
}

/// Every n-th image, about `features` features in total.
fn thinned(recording: &Recording, features: usize) -> Recording {
    let every = stride(recording.features.len(), features);
    let mut index = 0;
    let mut last_stamp = None;
    let mut thin = recording.clone();
    // Whole images, so that the features of one stay together.
    thin.features.retain(|feature| {
        index += usize::from(last_stamp.is_some_and(|last| last != feature.stamp_ns));
        last_stamp = Some(feature.stamp_ns);
        index.is_multiple_of(every)
    });
    thin
}
