//! What is wrong with a recording that does not calibrate: each usual mistake is undone in turn, and the one
//! without which the scan fits is named.

use crate::calibrate::calibrate;
use crate::config::{Config, SensorMode};
use crate::diagnose::mistakes::{MISTAKES, reordered};
use crate::{Calibration, Error};
use trueline_dataset::{Guess, Recording};
use trueline_geometry::{se3, so3};

/// How a recording calibrates.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// How much larger the residuals are than noise explains; `None` if there is no result at all.
    pub noise_factor: Option<f64>,
    /// Part of the features that is no outlier.
    pub explained: f64,
    /// Why it was not accepted, or why there is no result; empty if it was.
    pub said: Vec<String>,
}

impl Outcome {
    /// Whether the geometry is right: residuals are noise and most features belong. What cannot be seen for
    /// want of motion is another matter.
    #[must_use]
    pub fn fits(&self) -> bool {
        self.noise_factor.is_some_and(|factor| factor < FITS) && self.explained > 0.5
    }

    /// Whether nothing but noise is left, so that no mistake need be looked for.
    fn is_noise(&self) -> bool {
        self.fits() && self.noise_factor.is_some_and(|factor| factor < NOISE)
    }
}

/// The recording with one mistake undone.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// The mistake's name.
    pub name: &'static str,
    /// What it means.
    pub says: &'static str,
    /// How the recording calibrates without it.
    pub outcome: Outcome,
}

/// Everything the doctor found.
#[derive(Clone, Debug, PartialEq)]
pub struct Diagnosis {
    /// The recording as it is.
    pub as_recorded: Outcome,
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
        MISTAKES.iter().find(|mistake| mistake.name == name).and_then(|mistake| (mistake.mend)(recording))
    }
}

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
/// Two mistakes that leave residuals within this factor explain equally well.
const ALIKE: f64 = 1.1;
/// Features that are looked at.
const FEATURES: usize = 1500;

/// Examines a recording; `watch` is told the name of each trial before it begins.
pub fn diagnose(recording: &Recording, config: &Config, mut watch: impl FnMut(&str)) -> Diagnosis {
    let thin = thinned(recording);
    // A shape of the sensor would take up part of what a mistake makes.
    watch("as recorded");
    let config = &Config { sensor: SensorMode::Fixed, ..config.clone() };
    let result = calibrate(&thin, None, config);
    let as_recorded = outcome(&result);
    let trials = if as_recorded.is_noise() { Vec::new() } else { try_all(&thin, config, &mut watch) };
    let explained = explanations(&as_recorded, &trials);
    let explained_by = explained.iter().map(|(name, _)| *name).collect();
    let mut findings: Vec<String> = explained.into_iter().map(|(_, words)| words).collect();
    if findings.is_empty() {
        findings = implausible(recording);
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
    Diagnosis { as_recorded, trials, explained_by, findings }
}

fn outcome(result: &Result<Calibration, Error>) -> Outcome {
    match result {
        Ok(c) => Outcome {
            noise_factor: Some(c.findings.fit.noise_factor),
            explained: c.findings.fit.residuals.inlier_share(),
            said: c.reasons().iter().map(ToString::to_string).collect(),
        },
        Err(error) => Outcome { noise_factor: None, explained: 0.0, said: vec![error.to_string()] },
    }
}

fn thinned(recording: &Recording) -> Recording {
    let every = recording.features.len().div_ceil(FEATURES).max(1);
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

fn try_all(recording: &Recording, config: &Config, watch: &mut impl FnMut(&str)) -> Vec<Trial> {
    let trial = |mistake: &crate::diagnose::mistakes::Mistake| {
        watch(mistake.name);
        let mended = (mistake.mend)(recording)?;
        let outcome = outcome(&calibrate(&mended, None, config));
        Some(Trial { name: mistake.name, says: mistake.says, outcome })
    };
    MISTAKES.iter().filter_map(trial).collect()
}

/// The trials that explain a bad fit, by name and in words: far better than as recorded, and as good as the best of them.
fn explanations(as_recorded: &Outcome, trials: &[Trial]) -> Vec<(&'static str, String)> {
    let share = if as_recorded.fits() { EXPLAINS_DOUBT } else { EXPLAINS };
    let limit = share * as_recorded.noise_factor.unwrap_or(f64::INFINITY);
    let mut good: Vec<(&Trial, f64)> = trials
        .iter()
        .filter(|trial| trial.outcome.fits())
        .filter_map(|trial| Some((trial, trial.outcome.noise_factor?)))
        .filter(|(_, factor)| *factor < limit)
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

/// No robot's wrist turns faster, rad/s.
const FASTEST_TURN_RAD_S: f64 = 8.0;
/// A tool does not jump further between two samples, m …
const JUMP_M: f64 = 0.005;
/// … nor turn further, rad, unless its frame was switched.
const JUMP_RAD: f64 = 0.03;

/// What can be seen on the poses alone.
fn implausible(recording: &Recording) -> Vec<String> {
    let mut findings = Vec::new();
    let mut turning = Vec::new();
    let mut jump = None;
    for pair in recording.robot.windows(2) {
        let seconds = (pair[1].stamp_ns - pair[0].stamp_ns) as f64 * 1e-9;
        let (turn, shift) = se3::difference_decoupled(&pair[1].base_from_tool, &pair[0].base_from_tool);
        if seconds > 0.0 {
            turning.push(turn.norm() / seconds);
            // Over a gap the tool may go anywhere; a tenth of a second is none.
            let jumped = shift.norm() > JUMP_M || turn.norm() > JUMP_RAD;
            if seconds < 0.1 && jumped && shift.norm() / seconds > 2.0 && jump.is_none() {
                jump = Some((pair[1].stamp_ns, shift.norm(), turn.norm()));
            }
        }
    }
    let typical = crate::order_statistics::median(turning.into_iter()).unwrap_or(0.0);
    if typical > FASTEST_TURN_RAD_S {
        findings.push(format!(
            "the attitude turns at {typical:.0} rad/s, which no robot does: angles in degrees were taken for radians \
             when the quaternions were made"
        ));
    }
    if let Some((stamp_ns, shift_m, turn_rad)) = jump {
        findings.push(format!(
            "the pose jumps by {:.1} mm and {:.1}° at {:.3} s: the active tool or work object was switched during the \
             recording",
            shift_m * 1e3,
            turn_rad.to_degrees(),
            stamp_ns as f64 * 1e-9
        ));
    }
    findings
}

/// A guess further off than this is of something else, m and rad.
const GUESS_OFF_M: f64 = 0.020;
const GUESS_OFF_RAD: f64 = 0.2;
/// Nearer than this it is the same.
const SAME_M: f64 = 0.005;
const SAME_RAD: f64 = 0.03;
/// The same for the offset, s.
const SAME_S: f64 = 0.002;

/// What is wrong with a guess, seen from a result that fits.
fn wrong_guess(c: &Calibration, guess: &Guess) -> Vec<String> {
    let mut findings = Vec::new();
    let found_s = c.best_fit().time_offset_s;
    let offset_seen = c.findings.unknowns.observability.observable_components[0];
    if offset_seen
        && (found_s - guess.time_offset_s).abs() > SAME_S
        && (found_s + guess.time_offset_s).abs() < SAME_S
    {
        findings.push(format!(
            "the initial time offset has the wrong sign: it is {:+.1} ms; positive means that images are stamped late",
            found_s * 1e3
        ));
    }
    if !c.findings.unknowns.observability.observable_components[1..7].iter().all(|seen| *seen) {
        return findings;
    }
    let found = c.best_fit().tool_from_camera;
    let off = |guess: &trueline_geometry::Pose| {
        let (turn, shift) = se3::difference_decoupled(&found, guess);
        (shift.norm(), turn.norm())
    };
    let is = |pose: &trueline_geometry::Pose| off(pose).0 < SAME_M && off(pose).1 < SAME_RAD;
    let given = guess.tool_from_camera;
    let (shift_m, turn_rad) = off(&given);
    if shift_m < GUESS_OFF_M && turn_rad < GUESS_OFF_RAD {
        return findings;
    }
    let with_translation = |scale: f64| se3::from_parts(given.rotation, given.translation.vector * scale);
    let with_rotation = |rotation| se3::from_parts(rotation, given.translation.vector);
    let explained = if is(&given.inverse()) {
        "the initial hand-eye transform is camera_from_tool; it must be tool_from_camera".to_owned()
    } else if is(&with_translation(1000.0)) || is(&with_translation(1e-3)) {
        "the initial translation has the wrong unit: it must be millimetres".to_owned()
    } else if is(&with_rotation(reordered(&given.rotation))) {
        "the initial quaternion is x, y, z, w; it must be w, x, y, z".to_owned()
    } else if is(&with_rotation(so3::exp(&(so3::log(&given.rotation) * 1f64.to_degrees())))) {
        "the initial rotation was made of radians taken for degrees".to_owned()
    } else {
        format!(
            "the scan fits, but the hand-eye transform is {:.0} mm and {:.1}° from the initial one: the robot stream \
             reports another tool frame than the guess was made for, or the sensor has moved",
            shift_m * 1e3,
            turn_rad.to_degrees()
        )
    };
    findings.push(explained);
    findings
}
