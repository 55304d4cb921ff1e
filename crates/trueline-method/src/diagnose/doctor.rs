//! What is wrong with a recording that does not calibrate: each usual mistake is undone in turn, and the one
//! without which the scan fits is named.

use crate::calibrate::calibrate;
use crate::config::Config;
use crate::diagnose::estimated_mistakes::{Estimated, axis_scale, crop};
use crate::diagnose::mistakes::MISTAKES;
use crate::diagnose::plausibility::{implausible, wrong_guess, wrong_rate};
use crate::diagnose::pose_mistakes::POSE_MISTAKES;
use crate::diagnose::quick_fit::quick_fit;
use crate::diagnose::sensor_mistakes::SENSOR_MISTAKES;
use crate::diagnose::stamp_rate::stamp_rate;
use crate::diagnose::steps::{Step, Steps};
use crate::{Calibration, Error, Reason};
use trueline_dataset::Recording;

/// How a recording calibrates.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// How much larger the residuals are than noise explains; `None` if there is no result at all.
    pub noise_factor: Option<f64>,
    /// Part of the features that is no outlier.
    pub explained: f64,
    /// Why it was not accepted, or why there is no result; empty if it was.
    pub said: Vec<String>,
    /// Whether the scan contradicts the sensor's own calibration.
    pub sensor_is_off: bool,
}

impl Outcome {
    /// Whether the geometry is right: residuals are noise and most features belong. What cannot be seen for
    /// want of motion is another matter.
    #[must_use]
    pub fn fits(&self) -> bool {
        self.noise_factor.is_some_and(|factor| factor < FITS) && self.explained > 0.5
    }

    /// What is left of the residuals, where those that are explained are fewer the more is left: in units of noise.
    fn left(&self) -> Option<f64> {
        Some(self.noise_factor? / self.explained.max(LEAST_EXPLAINED))
    }

    /// Whether nothing but noise is left, so that no mistake need be looked for.
    fn is_noise(&self) -> bool {
        self.fits() && self.noise_factor.is_some_and(|factor| factor < NOISE)
    }
}

/// How a mistake is undone.
#[derive(Clone, Copy, Debug)]
pub enum Mend {
    /// As it is listed.
    Listed(fn(&Recording) -> Option<Recording>),
    /// By what was estimated of it.
    Estimated(Estimated),
}

impl Mend {
    /// The recording without the mistake; `None` where it cannot have been made.
    #[must_use]
    pub fn of(&self, recording: &Recording) -> Option<Recording> {
        match self {
            Self::Listed(mend) => mend(recording),
            Self::Estimated(found) => found.mend(recording),
        }
    }
}

/// The recording with one mistake undone.
#[derive(Clone, Debug)]
pub struct Trial {
    /// The mistake's name.
    pub name: &'static str,
    /// What it means.
    pub says: String,
    /// How it is undone.
    pub mend: Mend,
    /// How the recording calibrates without it.
    pub outcome: Outcome,
    /// Whether only a few of its features were fitted, because another mistake explains these better.
    pub is_screened: bool,
}

/// Everything the doctor found.
#[derive(Clone, Debug)]
pub struct Diagnosis {
    /// The recording as it is.
    pub as_recorded: Outcome,
    /// Its calibration, by noise alone and of 1500 features at most, if there is one.
    pub calibration: Option<Calibration>,
    /// The recording without each mistake; empty if it fits as it is.
    pub trials: Vec<Trial>,
    /// Names of the trials that explain a bad fit, the most likely first.
    pub explained_by: Vec<&'static str>,
    /// What is wrong, in a user's words; the most likely first. Empty if nothing is.
    pub findings: Vec<String>,
}

impl Diagnosis {
    /// The recording without the mistake that explains its bad fit; `None` where none does, or more than one.
    #[must_use]
    pub fn mended(&self, recording: &Recording) -> Option<Recording> {
        let [name] = self.explained_by[..] else { return None };
        self.trials.iter().find(|trial| trial.name == name).and_then(|trial| trial.mend.of(recording))
    }
}

/// Fewer features explained than this are none.
const LEAST_EXPLAINED: f64 = 0.01;
/// Residuals up to this many times the expected noise are of the right geometry.
const FITS: f64 = 5.0;
/// Residuals up to this many times the expected noise are noise: sensors differ more than this from what was
/// expected of them only if somebody stated another noise.
const NOISE: f64 = 1.2;
/// A mistake explains a bad fit if undoing it makes residuals so much smaller …
const EXPLAINS: f64 = 0.2;
/// … or a doubtful one, of residuals that are merely large, if it makes them so much smaller. Of 1500 features,
/// a fifth less is a likelihood e³³⁵ times larger: no accident.
const EXPLAINS_DOUBT: f64 = 0.8;
/// … or, of residuals that are noise while the sensor's own calibration seems off, if they are no larger: it must then leave
/// a sensor that is right.
const EXPLAINS_SENSOR: f64 = 1.0;
/// Two mistakes that leave residuals within this factor explain equally well.
const ALIKE: f64 = 1.1;
/// Features that are looked at.
const FEATURES: usize = 1500;
/// Features on which all mistakes are tried …
const FEW: usize = 400;
/// … and how many of them are then looked at with all …
const PROMISING: usize = 5;
/// … if their residuals are within this factor of the smallest.
const NEARLY_BEST: f64 = 2.0;
/// Measured on a scan that nothing explains, in quick fits of [`FEW`] features: a calibration of [`FEATURES`], …
const CALIBRATION_COSTS: usize = 20;
/// … the search for a crop, for the rate of the stamps, and for the scale of an axis.
const CROP_COSTS: usize = 50;
/// See [`CROP_COSTS`].
const RATE_COSTS: usize = 6;
/// See [`CROP_COSTS`].
const SCALE_COSTS: usize = 5;

/// Examines a recording; `watch` is told of each trial before it begins.
pub fn diagnose(recording: &Recording, config: &Config, watch: impl FnMut(Step<'_>)) -> Diagnosis {
    let thin = thinned(recording, FEATURES);
    // A shape of the sensor would take up part of what a mistake makes; robot and bias only widen what is said.
    let mut steps = Steps::new(watch);
    steps.expect(CALIBRATION_COSTS);
    steps.begin("as recorded", CALIBRATION_COSTS);
    let noise_only = Config::noise_only();
    let config = &Config {
        sensor: noise_only.sensor,
        robot_accuracy_m: noise_only.robot_accuracy_m,
        feature_bias_px: noise_only.feature_bias_px,
        ..config.clone()
    };
    let result = calibrate(&thin, None, config);
    let as_recorded = outcome(&result);
    let is_well = as_recorded.is_noise() && !as_recorded.sensor_is_off;
    let trials = if is_well { Vec::new() } else { try_all(&as_recorded, &thin, config, &mut steps) };
    let explained = explanations(&as_recorded, &trials);
    let explained_by = explained.iter().map(|(name, _)| *name).collect();
    let mut findings: Vec<String> = explained.into_iter().map(|(_, words)| words).collect();
    if findings.is_empty() {
        findings = implausible(recording);
    }
    if let Ok(calibration) = &result
        && as_recorded.fits()
    {
        findings.extend(wrong_rate(calibration));
    }
    if let (Ok(calibration), Some(guess)) = (&result, &recording.initial)
        && as_recorded.fits()
    {
        findings.extend(wrong_guess(calibration, guess));
    }
    if findings.is_empty() && !as_recorded.fits() {
        findings.push(
            "none of the usual mistakes explains it: check that laser plane and camera belong together, that the \
             line is straight and did not move, and that robot.csv and features.csv are of the same scan"
                .to_owned(),
        );
    }
    Diagnosis { as_recorded, calibration: result.ok(), trials, explained_by, findings }
}

fn outcome(result: &Result<Calibration, Error>) -> Outcome {
    match result {
        Ok(c) => Outcome {
            noise_factor: Some(c.findings.fit.noise_factor),
            explained: c.findings.fit.residuals.inlier_share(),
            said: c.reasons().iter().map(ToString::to_string).collect(),
            sensor_is_off: c.reasons().iter().any(|reason| matches!(reason, Reason::SensorOff { .. })),
        },
        Err(error) => Outcome {
            noise_factor: None,
            explained: 0.0,
            said: vec![error.to_string()],
            sensor_is_off: false,
        },
    }
}

/// Every so-many-th image, so that about `features` are left.
fn thinned(recording: &Recording, features: usize) -> Recording {
    let every = recording.features.len().div_ceil(features).max(1);
    let mut index = 0;
    let mut last_stamp = None;
    let mut thin = recording.clone();
    // Whole images, so that several features of one stay together.
    thin.features.retain(|feature| {
        index += usize::from(last_stamp.is_some_and(|last| last != feature.stamp_ns));
        last_stamp = Some(feature.stamp_ns);
        index.is_multiple_of(every)
    });
    thin
}

/// A mistake whose size is known.
type Candidate = (&'static str, String, Mend);

/// Tries what is listed, and, where that explains nothing, what has a number of its own.
fn try_all(
    as_recorded: &Outcome,
    recording: &Recording,
    config: &Config,
    steps: &mut Steps<impl FnMut(Step<'_>)>,
) -> Vec<Trial> {
    let listed = MISTAKES.iter().chain(&POSE_MISTAKES).chain(&SENSOR_MISTAKES);
    let listed =
        listed.map(|mistake| (mistake.name, mistake.says.to_owned(), Mend::Listed(mistake.mend))).collect();
    let few = thinned(recording, FEW);
    let mut trials = tried(recording, &few, listed, config, steps);
    if explanations(as_recorded, &trials).is_empty() {
        steps.expect(CROP_COSTS + RATE_COSTS + 3 * SCALE_COSTS);
        steps.begin("cropped images", CROP_COSTS);
        let mut estimated: Vec<Estimated> = crop(&few, config).into_iter().collect();
        steps.begin("rate of the image stamps", RATE_COSTS);
        estimated.extend(stamp_rate(&few, config));
        for axis in 0..3 {
            steps.begin("scale of an axis", SCALE_COSTS);
            estimated.extend(axis_scale(&few, config, axis));
        }
        let estimated = estimated.into_iter();
        let estimated = estimated.map(|found| (found.name(), found.says(), Mend::Estimated(found))).collect();
        trials.extend(tried(recording, &few, estimated, config, steps));
    }
    trials
}

/// Tries each on a few features, and the best of them on many.
fn tried(
    recording: &Recording,
    few: &Recording,
    candidates: Vec<Candidate>,
    config: &Config,
    steps: &mut Steps<impl FnMut(Step<'_>)>,
) -> Vec<Trial> {
    let mut screened: Vec<(f64, Trial)> = Vec::new();
    let possible =
        candidates.into_iter().filter_map(|(name, says, mend)| Some((name, says, mend.of(few)?, mend)));
    let possible: Vec<_> = possible.collect();
    steps.expect(possible.len());
    for (name, says, mended, mend) in possible {
        steps.begin(name, 1);
        let fit = quick_fit(&mended, config);
        let outcome = match &fit {
            Ok(fit) => Outcome {
                noise_factor: Some(fit.noise_factor),
                explained: fit.explained,
                said: Vec::new(),
                sensor_is_off: false,
            },
            Err(error) => outcome(&Err(error.clone())),
        };
        let left = outcome.left().unwrap_or(f64::INFINITY);
        screened.push((left, Trial { name, says, mend, outcome, is_screened: true }));
    }
    screened.sort_by(|a, b| a.0.total_cmp(&b.0));
    let best = screened.first().map_or(f64::INFINITY, |(left, _)| *left);
    let is_promising = |k: usize, left: f64| k < PROMISING && left <= NEARLY_BEST * best;
    let count = screened.iter().enumerate().filter(|(k, (left, _))| is_promising(*k, *left)).count();
    steps.expect(count * CALIBRATION_COSTS);
    let again = |(k, (left, trial)): (usize, (f64, Trial))| {
        if !is_promising(k, left) {
            return Some(trial);
        }
        steps.begin(trial.name, CALIBRATION_COSTS);
        let outcome = outcome(&calibrate(&trial.mend.of(recording)?, None, config));
        Some(Trial { outcome, is_screened: false, ..trial })
    };
    screened.into_iter().enumerate().filter_map(again).collect()
}

/// The trials that explain a bad fit, by name and in words: far better than as recorded, and as good as the best of them.
fn explanations(as_recorded: &Outcome, trials: &[Trial]) -> Vec<(&'static str, String)> {
    let is_geometry = as_recorded.fits();
    let share = match (is_geometry, as_recorded.is_noise()) {
        (false, _) => EXPLAINS,
        (true, false) => EXPLAINS_DOUBT,
        (true, true) => EXPLAINS_SENSOR,
    };
    let limit = share * as_recorded.left().unwrap_or(f64::INFINITY);
    let mut good: Vec<(&Trial, f64)> = trials
        .iter()
        .filter(|trial| !trial.is_screened && trial.outcome.fits())
        // Where the sensor seemed off, a mistake must leave it right.
        .filter(|trial| !(is_geometry && trial.outcome.sensor_is_off))
        .filter(|trial| trial.outcome.left().is_some_and(|left| left < limit))
        .filter_map(|trial| Some((trial, trial.outcome.noise_factor?)))
        .collect();
    good.sort_by(|a, b| a.1.total_cmp(&b.1));
    let best = good.first().map_or(f64::INFINITY, |(_, factor)| *factor);
    good.retain(|(_, factor)| *factor <= ALIKE * best);
    let before =
        as_recorded.noise_factor.map_or_else(|| "no result".to_owned(), |factor| format!("{factor:.1}"));
    good.iter()
        .map(|(trial, factor)| {
            let words =
                format!("{} (residuals in units of the expected noise: {before} → {factor:.1})", trial.says);
            (trial.name, words)
        })
        .collect()
}
