//! Undoes mistakes one at a time, the likeliest first, until one explains the scan or time is up.

use crate::calibrate::estimate;
use crate::config::Config;
use crate::diagnose::axis_mistakes::{self, AxisMend};
use crate::diagnose::estimated_mistakes::{Estimated, axis_scale, crop};
use crate::diagnose::euler_mistakes::{self, EulerMistake};
use crate::diagnose::mistakes::MISTAKES;
use crate::diagnose::outcome::Outcome;
use crate::diagnose::plausibility::turns_like_a_robot;
use crate::diagnose::pose_mistakes::POSE_MISTAKES;
use crate::diagnose::quick_fit::glance;
use crate::diagnose::sensor_mistakes::SENSOR_MISTAKES;
use crate::diagnose::stamp_rate::stamp_rate;
use crate::diagnose::steps::{Budget, Step, Steps};
use crate::parallel;
use trueline_dataset::Recording;

/// The correction of a mistake.
#[derive(Clone, Copy, Debug)]
pub enum Mend {
    /// From the list.
    Listed(fn(&Recording) -> Option<Recording>),
    /// By composing its angles in another sequence.
    Euler(EulerMistake),
    /// From an estimate.
    Estimated(Estimated),
    /// By changing the record of an external axis.
    Axis(AxisMend),
}

impl Mend {
    /// The recording without the mistake. `None` if it cannot have been made.
    #[must_use]
    pub fn of(&self, recording: &Recording) -> Option<Recording> {
        match self {
            Self::Listed(mend) => mend(recording),
            Self::Euler(mistake) => Some(mistake.mend(recording)),
            Self::Estimated(found) => found.mend(recording),
            Self::Axis(mend) => mend.of(recording),
        }
    }
}

/// The recording with one mistake undone.
#[derive(Clone, Debug)]
pub struct Trial {
    /// The mistake's name.
    pub name: String,
    /// The mistake and its remedy.
    pub says: String,
    /// Its correction.
    pub mend: Mend,
    /// Outcome for the recording without it.
    pub outcome: Outcome,
    /// Whether only a few features were fitted, because another mistake explains these better.
    pub is_screened: bool,
}

/// Number of Euler sequences tried before slow trials. The others come last.
const USUAL_SEQUENCES: usize = 60;
/// Two mistakes with residuals within this factor explain equally well.
const ALIKE: f64 = 1.1;
/// Number of features on which all mistakes are tried …
pub(super) const FEW: usize = 300;
/// … and number of mistakes that are then tried on all features …
const PROMISING: usize = 4;
/// … if their residuals are within this factor of the smallest.
const NEARLY_BEST: f64 = 2.0;
/// Factor by which residuals of a few features may exceed those of many.
const OF_FEW: f64 = 1.3;
/// Measured on a scan without an explanation, in quick fits of [`FEW`] features: a calibration, …
pub(super) const CALIBRATION_COSTS: usize = 20;
/// … the search for a crop, for the rate of the stamps, and for the scale of an axis.
const CROP_COSTS: usize = 50;
/// See [`CROP_COSTS`].
const RATE_COSTS: usize = 6;
/// See [`CROP_COSTS`].
const SCALE_COSTS: usize = 5;

/// A recording on which mistakes are tried.
pub(super) struct Trials<'a, W> {
    /// The features for calibrations.
    pub recording: &'a Recording,
    /// The features for quick fits.
    pub few: &'a Recording,
    pub config: &'a Config,
    pub as_recorded: &'a Outcome,
    pub steps: &'a mut Steps<W>,
    pub budget: Budget,
    /// Images per second according to their stamps.
    pub stamped_hz: f64,
    /// Whether a robot can turn as the recorded poses do.
    pub is_plausible: bool,
    /// Completed trials.
    pub done: Vec<Trial>,
    /// Mistakes that were not tried for lack of time.
    pub not_tried: Vec<String>,
}

/// A mistake whose size is known.
type Candidate = (String, String, Mend);

impl<W: FnMut(Step<'_>)> Trials<'_, W> {
    /// Tries all, until one explains the scan.
    pub(super) fn run(&mut self) {
        if self.recording.axes_that_move().contains(&true) {
            // Nothing else is tried, because quick fits need axes at known positions.
            self.try_axes();
            return;
        }
        let listed = MISTAKES.iter().chain(POSE_MISTAKES).chain(SENSOR_MISTAKES);
        let listed = listed.map(|m| (m.name.to_owned(), m.says.to_owned(), Mend::Listed(m.mend)));
        self.attempt(listed.collect());
        if self.is_explained() {
            return;
        }
        let mut euler = if self.as_recorded.fits() { Vec::new() } else { euler_mistakes::all() };
        if !self.is_plausible {
            // Only other attitudes can slow it down.
            self.try_sequences(euler);
            return;
        }
        let (few, config, budget, stamped_hz) = (self.few, self.config, self.budget, self.stamped_hz);
        self.estimate("rate of the image stamps", RATE_COSTS, || stamp_rate(few, config, budget, stamped_hz));
        for (axis, name) in ["scale of x", "scale of y", "scale of z"].into_iter().enumerate() {
            self.estimate(name, SCALE_COSTS, || axis_scale(few, config, budget, axis));
        }
        let rare = euler.split_off(euler.len().min(USUAL_SEQUENCES));
        self.try_sequences(euler);
        self.estimate("cropped images", CROP_COSTS, || crop(few, config, budget));
        self.try_sequences(rare);
    }

    /// Calibrates without each mistake about an axis, until one explains the scan.
    fn try_axes(&mut self) {
        let candidates = axis_mistakes::all(self.few);
        self.steps.expect(candidates.len() * CALIBRATION_COSTS);
        for axis_mistakes::Candidate { name, says, mend, is_twin } in candidates {
            if !is_twin && self.is_explained() {
                return;
            }
            if self.budget.is_spent() {
                self.not_tried.push(name);
                continue;
            }
            self.steps.begin(&name, CALIBRATION_COSTS);
            let Some(mended) = mend.of(self.few) else { continue };
            let outcome = Outcome::of(&estimate(&mended, None, self.config));
            self.done.push(Trial { name, says, mend: Mend::Axis(mend), outcome, is_screened: false });
        }
    }

    fn try_sequences(&mut self, euler: Vec<EulerMistake>) {
        if !self.is_explained() {
            self.attempt(euler.into_iter().map(|m| (m.name(), m.says(), Mend::Euler(m))).collect());
        }
    }

    fn is_explained(&self) -> bool {
        !explanations(self.as_recorded, &self.done).is_empty()
    }

    /// Estimates a mistake's size and tries it, unless the scan is already explained or time is up.
    fn estimate(&mut self, name: &str, costs: usize, find: impl FnOnce() -> Option<Estimated>) {
        if self.is_explained() {
            return;
        }
        if self.budget.is_spent() {
            self.not_tried.push(name.to_owned());
            return;
        }
        self.steps.expect(costs);
        self.steps.begin(name, costs);
        let found = find();
        if found.is_none() && self.budget.is_spent() {
            self.not_tried.push(name.to_owned());
        }
        self.attempt(
            found
                .map(|found| (found.name().to_owned(), found.says(), Mend::Estimated(found)))
                .into_iter()
                .collect(),
        );
    }

    /// Tries each on a few features, and the best of them on many.
    fn attempt(&mut self, candidates: Vec<Candidate>) {
        let mut screened = self.screen(candidates);
        screened.sort_by(|a, b| a.0.total_cmp(&b.0));
        let best = screened.first().map_or(f64::INFINITY, |(left, _)| *left);
        let most =
            OF_FEW * self.as_recorded.explained_below() * self.as_recorded.left().unwrap_or(f64::INFINITY);
        let is_promising = |k: usize, left: f64| k < PROMISING && left <= NEARLY_BEST * best && left < most;
        let promising = screened.iter().enumerate().filter(|(k, (left, _))| is_promising(*k, *left)).count();
        self.steps.expect(promising * CALIBRATION_COSTS);
        for (k, (left, trial)) in screened.into_iter().enumerate() {
            let confirmed = k == 0 || !self.budget.is_spent();
            let trial = if is_promising(k, left) && confirmed { self.calibrated(trial) } else { Some(trial) };
            self.done.extend(trial);
        }
    }

    /// Outcome without each mistake, on a few features. As many run at once as there are threads. A mistake without which the poses turn
    /// faster than any robot was not made.
    fn screen(&mut self, candidates: Vec<Candidate>) -> Vec<(f64, Trial)> {
        let without = |candidate: Candidate| candidate.2.of(self.few).map(|mended| (candidate, mended));
        let possible: Vec<(Candidate, Recording)> = candidates
            .into_iter()
            .filter_map(without)
            .filter(|(_, mended)| turns_like_a_robot(mended))
            .collect();
        self.steps.expect(possible.len());
        let (threads, config) = (self.config.threads.max(1), Config { threads: 1, ..self.config.clone() });
        let mut screened = Vec::new();
        for group in possible.chunks(2 * threads) {
            if self.budget.is_spent() || self.is_certain(&screened) {
                let names = group.iter().map(|((name, ..), _)| name.clone());
                if self.budget.is_spent() {
                    self.not_tried.extend(names);
                }
                continue;
            }
            self.steps.begin(&group[0].0.0, group.len());
            let fits = parallel::map(threads, group.len(), |k| Outcome::quick(glance(&group[k].1, &config)));
            for (((name, says, mend), _), outcome) in group.iter().zip(fits) {
                let left = outcome.left().unwrap_or(f64::INFINITY);
                let (name, says) = (name.clone(), says.clone());
                screened.push((left, Trial { name, says, mend: *mend, outcome, is_screened: true }));
            }
        }
        screened
    }

    /// Whether one of many ranked mistakes reduces residuals far above noise to noise. Less likely ones are then skipped. Short lists are tried
    /// completely.
    fn is_certain(&self, screened: &[(f64, Trial)]) -> bool {
        let is_ranked = screened.iter().any(|(_, trial)| matches!(trial.mend, Mend::Euler(_)));
        is_ranked && !self.as_recorded.fits() && screened.iter().any(|(_, trial)| trial.outcome.is_noise())
    }

    fn calibrated(&mut self, trial: Trial) -> Option<Trial> {
        self.steps.begin(&trial.name, CALIBRATION_COSTS);
        let _stage = tracing::debug_span!("trial", undone = trial.name).entered();
        let mut trial = trial;
        let mut result = estimate(&trial.mend.of(self.recording)?, None, self.config);
        if let (Mend::Estimated(found), Ok(calibration)) = (trial.mend, &result)
            && let Some(refined) = found.refined(calibration)
        {
            (trial.mend, trial.says) = (Mend::Estimated(refined), refined.says());
            result = estimate(&trial.mend.of(self.recording)?, None, self.config);
        }
        Some(Trial { outcome: Outcome::of(&result), is_screened: false, ..trial })
    }
}

/// The trials that explain a bad fit, by name and in words: far better than the recording, and as good as the best of them.
pub(super) fn explanations(as_recorded: &Outcome, trials: &[Trial]) -> Vec<(String, String)> {
    let is_geometry = as_recorded.fits();
    let limit = as_recorded.explained_below() * as_recorded.left().unwrap_or(f64::INFINITY);
    let mut good: Vec<(&Trial, f64)> = trials
        .iter()
        .filter(|trial| !trial.is_screened && trial.outcome.fits())
        // If the sensor seemed off, it must be correct without the mistake.
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
            (trial.name.clone(), words)
        })
        .collect()
}
