//! Finds the shift between two streams with unrelated clocks.
//!
//! While the sensor sees one straight line, the seam point's place in the sheet is a function of the tool's pose alone, linear to first order. At
//! the correct shift of the image stamps a linear regression of the seam's place on the robot's six coordinates leaves small residuals, for any
//! hand-eye transform and line. The best shifts are then calibrated, and the one that fits is the answer. If two fit, there is no answer.

use crate::calibrate::estimate;
use crate::calibration::Calibration;
use crate::config::Config;
use crate::diagnose::quick_fit::quick_fit;
use crate::diagnose::shift_regression::{ShiftRegression, places};
use crate::diagnose::steps::{Step, Steps};
use crate::thinning::stride;
use trueline_dataset::Recording;

/// The shift that was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClockAlignment {
    /// Amount subtracted from every image stamp to convert it to the robot's clock, ns. The remaining time offset is below a millisecond, or as
    /// uncertain as the scan leaves it.
    pub images_ahead_ns: i64,
    /// Fraction of the seam's motion in the image that the robot's motion explains at this shift.
    pub explained: f64,
    /// The second best distinct shift, ns, and the fraction that it explains.
    pub runner_up: Option<(i64, f64)>,
}

/// Reason that no shift was found.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum AlignmentError {
    /// A stream is too short, or never overlaps for long enough.
    #[error("the streams are too short to align: {seconds:.1} s of overlap are needed")]
    TooShort {
        /// Least overlap, s.
        seconds: f64,
    },
    /// No shift explains the scan.
    #[error("no clock shift fits the scan; the best one explains {percent:.0} % of the seam's motion")]
    NoneFits {
        /// Fraction explained by the best, %.
        percent: f64,
    },
    /// Two shifts explain the scan.
    #[error(
        "two clock shifts fit equally well: image stamps are {first_s:.3} s or {second_s:.3} s ahead of the \
        robot's"
    )]
    Ambiguous {
        /// One shift, s.
        first_s: f64,
        /// The other, s.
        second_s: f64,
    },
}

impl AlignmentError {
    /// Hint for the user.
    #[must_use]
    pub fn hint(&self) -> &'static str {
        match self {
            Self::TooShort { .. } => "record both streams for at least ten seconds of the same scan",
            Self::NoneFits { .. } => {
                "`trueline doctor` looks for other mistakes; are both files of one scan?"
            }
            Self::Ambiguous { .. } => {
                "the motion repeats itself: vary its frequency, or begin and end the scan with one quick move"
            }
        }
    }
}

/// Step between the shifts, s: a fraction of the range that a calibration searches.
const STEP_S: f64 = 0.02;
/// Least overlap, s.
const LEAST_OVERLAP_S: f64 = 3.0;
/// Least fraction of the images that overlaps.
const LEAST_OVERLAP: f64 = 0.5;
/// Maxima closer than this are one, s. A calibration searches further.
const APART_S: f64 = 0.4;
/// Maximum number of calibrated shifts.
const CANDIDATES: usize = 4;
/// Seam points used in a candidate's calibration.
const CALIBRATED: usize = 400;
/// Noise factor up to which a candidate fits, as in the doctor.
const FITS: f64 = 5.0;
/// Two candidates with residuals within this factor fit equally well.
const ALIKE: f64 = 1.3;
/// A candidate with a quick fit above this multiple of the best residuals is not calibrated.
const HOPELESS: f64 = 4.0;
/// Cost of a calibration in quick fits.
const CALIBRATION_COSTS: usize = 4;
/// Offsets within this are one answer, s.
const SAME_S: f64 = 0.005;

/// Searches the shift of the image stamps over every overlap of the two streams. `watch` is called before each candidate.
///
/// # Errors
/// Streams that are too short, and scans that fit with no shift or with more than one.
pub fn align(
    recording: &Recording,
    config: &Config,
    watch: impl FnMut(Step<'_>),
) -> Result<ClockAlignment, AlignmentError> {
    let too_short = AlignmentError::TooShort { seconds: LEAST_OVERLAP_S };
    let (Some(robot), Some(images)) = (recording.robot.first(), recording.features.first()) else {
        return Err(too_short);
    };
    let between_ns = images.stamp_ns - robot.stamp_ns;
    let places = places(&recording.features);
    let regression =
        ShiftRegression::new(recording, places, LEAST_OVERLAP, LEAST_OVERLAP_S).ok_or(too_short)?;
    let mut peaks = peaks(&regression);
    peaks.truncate(CANDIDATES);
    if peaks.is_empty() {
        return Err(too_short);
    }
    let thin = thinned(recording);
    let mut found: Vec<Candidate> = promising(&peaks, between_ns, &thin, config, watch);
    found.sort_by(|a, b| a.residual.total_cmp(&b.residual));
    chosen(&found).ok_or(AlignmentError::NoneFits { percent: 100.0 * peaks[0].explained })?
}

/// The recording with its image stamps shifted by an alignment.
#[must_use]
pub fn aligned(recording: &Recording, images_ahead_ns: i64) -> Recording {
    let mut moved = recording.clone();
    for feature in &mut moved.features {
        feature.stamp_ns -= images_ahead_ns;
    }
    for stripe in &mut moved.stripes {
        stripe.stamp_ns -= images_ahead_ns;
    }
    moved.images_ahead_ns += images_ahead_ns;
    moved
}

/// Candidates that fit. All are fitted quickly, and those near the best are calibrated.
fn promising(
    peaks: &[Peak],
    between_ns: i64,
    recording: &Recording,
    config: &Config,
    watch: impl FnMut(Step<'_>),
) -> Vec<Candidate> {
    let mut steps = Steps::new(watch);
    steps.expect(peaks.len() + CALIBRATION_COSTS);
    let mut left = Vec::new();
    for peak in peaks {
        steps.begin(&name(peak, between_ns), 1);
        let fit = quick_fit(&aligned(recording, between_ns + nanoseconds(peak.shift_s)), config);
        left.push(fit.map_or(f64::INFINITY, |fit| fit.noise_factor / fit.explained));
    }
    let best = left.iter().copied().fold(f64::INFINITY, f64::min);
    let near: Vec<&Peak> =
        peaks.iter().zip(&left).filter(|(_, left)| **left <= HOPELESS * best).map(|(peak, _)| peak).collect();
    steps.expect(near.len().saturating_sub(1) * CALIBRATION_COSTS);
    let calibrated = near.into_iter().filter_map(|peak| {
        steps.begin(&name(peak, between_ns), CALIBRATION_COSTS);
        Candidate::of(peak, between_ns, recording, config)
    });
    calibrated.collect()
}

/// Description of a shift, for progress display.
fn name(peak: &Peak, between_ns: i64) -> String {
    format!("image stamps {:.1} s ahead", between_ns as f64 * 1e-9 + peak.shift_s)
}

/// A shift whose calibration fits.
struct Candidate {
    images_ahead_ns: i64,
    /// Sum of shift and time offset, s.
    whole_s: f64,
    explained: f64,
    residual: f64,
}

impl Candidate {
    fn of(peak: &Peak, between_ns: i64, recording: &Recording, config: &Config) -> Option<Self> {
        let images_ahead_ns = between_ns + nanoseconds(peak.shift_s);
        let calibration = estimate(&aligned(recording, images_ahead_ns), None, config).ok()?;
        let residual = residual(&calibration)?;
        let offset_s = calibration.best_fit().time_offset_s;
        let whole_s = images_ahead_ns as f64 * 1e-9 + offset_s;
        // Calibration has its own wide search. Its result becomes part of the shift, so that no image is lost at the ends.
        let images_ahead_ns = images_ahead_ns + nanoseconds(offset_s);
        Some(Self { images_ahead_ns, whole_s, explained: peak.explained, residual })
    }
}

/// Whole milliseconds, which are easy to write down.
fn nanoseconds(seconds: f64) -> i64 {
    (seconds * 1e3).round() as i64 * 1_000_000
}

/// Typical residual over expected noise, for a scan that fits.
fn residual(calibration: &Calibration) -> Option<f64> {
    let fit = &calibration.findings.fit;
    // In one pass a curve follows readings of any other motion as well.
    let follows_anything = calibration.findings.curve.as_ref().is_some_and(|curve| curve.is_one_pass);
    (fit.noise_factor < FITS && fit.residuals.inlier_share() > 0.5 && !follows_anything)
        .then(|| fit.noise_factor / fit.residuals.inlier_share())
}

/// The best candidate, or the error that there are two. `None` without any.
fn chosen(found: &[Candidate]) -> Option<Result<ClockAlignment, AlignmentError>> {
    let best = found.first()?;
    let other = found.iter().find(|candidate| (candidate.whole_s - best.whole_s).abs() > SAME_S);
    if let Some(other) = other
        && other.residual < ALIKE * best.residual
    {
        return Some(Err(AlignmentError::Ambiguous { first_s: best.whole_s, second_s: other.whole_s }));
    }
    Some(Ok(ClockAlignment {
        images_ahead_ns: best.images_ahead_ns,
        explained: best.explained,
        runner_up: other.map(|other| (other.images_ahead_ns, other.explained)),
    }))
}

/// A local maximum of the explained fraction, with its shift in seconds relative to a common start of both streams.
struct Peak {
    shift_s: f64,
    explained: f64,
    score: f64,
}

fn peaks(regression: &ShiftRegression) -> Vec<Peak> {
    let [first, last] = regression.range_s();
    let count = ((last - first) / STEP_S).floor().max(0.0) as usize;
    let scored = (0..=count).filter_map(|k| {
        let shift_s = first + k as f64 * STEP_S;
        let at = regression.at(shift_s)?;
        Some(Peak { shift_s, explained: at.explained, score: at.score })
    });
    let mut scored: Vec<Peak> = scored.collect();
    scored.sort_by(|a, b| b.score.total_cmp(&a.score));
    let mut peaks: Vec<Peak> = Vec::new();
    for peak in scored {
        if peaks.len() == CANDIDATES {
            break;
        }
        if peaks.iter().all(|known| (known.shift_s - peak.shift_s).abs() > APART_S) {
            peaks.push(peak);
        }
    }
    peaks
}

/// Every n-th image, complete.
fn thinned(recording: &Recording) -> Recording {
    let every = stride(recording.features.len(), CALIBRATED);
    let mut thin = recording.clone();
    let (mut index, mut last) = (0, None);
    thin.features.retain(|feature| {
        index += usize::from(last.is_some_and(|last| last != feature.stamp_ns));
        last = Some(feature.stamp_ns);
        index.is_multiple_of(every)
    });
    thin
}
