//! Whether a calibration from pose sightings may be used, and warnings.

use crate::board_hand_eye::PoseFit;
use crate::board_hand_eye::joint::{HAND_EYE, SIZE, TIME_OFFSET};
use crate::board_hand_eye::poses::{ONE_OFFSET_S, OtherOffset};
use crate::verdict::{
    LEAST_BOARD_PICTURES, MOST_DISAGREEMENT, MOST_ROTATION_SIGMA_RAD, MOST_TIME_OFFSET_SIGMA_S,
    MOST_TRANSLATION_SIGMA_M, USUAL_DISAGREEMENT,
};
use nalgebra::{SMatrix, Vector3};
use std::fmt;

/// A calibration with more wrong sightings than this part is refused.
const MOST_WRONG: f64 = 0.5;
/// With more than this part of them something is wrong with the detector.
const MANY_WRONG: f64 = 0.1;
/// Lasting residuals that raise the variance by more than this are worth a word.
const LASTING: f64 = 2.0;
/// A component of a unit direction above this names it by its axis.
const MAIN: f64 = 0.9;

/// Reasons for a refusal of a calibration from sightings, and warnings.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum SightingRemark {
    /// The motion does not show something.
    Unobservable(Unshown),
    /// The robot stands at each sighting, but this was not stated.
    AtStops {
        /// Their number.
        stops: usize,
    },
    /// Another time offset explains the sightings as well.
    AmbiguousTimeOffset {
        /// The answer's and the other, s.
        time_offsets_s: [f64; 2],
        /// How clearly the answer is better, in standard deviations.
        z: f64,
    },
    /// Another hand-eye transform explains the readings as well.
    AmbiguousHandEye {
        /// Rotation from the answer, rad.
        turn_rad: f64,
        /// How clearly the answer is better, in standard deviations.
        z: f64,
    },
    /// Too few sightings belong together.
    FewSightings {
        /// Their number.
        count: usize,
        /// Total number.
        of: usize,
    },
    /// Some sightings are wrong.
    SightingsLeftOut {
        /// Number.
        count: usize,
        /// Total number.
        of: usize,
    },
    /// The sightings have another scale.
    OtherScale {
        /// Length over reported length.
        factor: f64,
        /// Its standard deviation.
        sigma: f64,
    },
    /// Residuals are larger than the stated noise makes them.
    LargerThanStated {
        /// By how many times.
        factor: f64,
    },
    /// Neighbouring residuals are alike.
    LastingResiduals {
        /// By how much that raises the variance.
        factor: f64,
    },
    /// The hand-eye transform is not known well enough.
    HandEyeUncertain {
        /// Largest standard deviation of the rotation, rad.
        rotation_rad: f64,
        /// And of the translation, m.
        translation_m: f64,
    },
    /// The time offset is not known well enough.
    TimeOffsetUncertain {
        /// Standard deviation, s.
        sigma_s: f64,
    },
}

/// Quantities that a motion does not determine.
#[derive(Clone, Debug, PartialEq)]
pub enum Unshown {
    /// The time offset.
    TimeOffset,
    /// The hand-eye rotation about these unit directions of the camera's carrier.
    Rotation(Vec<Vector3<f64>>),
    /// The hand-eye translation along these.
    Translation(Vec<Vector3<f64>>),
}

impl Unshown {
    /// The name in the result.
    #[must_use]
    pub fn parameter(&self) -> &'static str {
        match self {
            Self::TimeOffset => "time_offset",
            Self::Rotation(_) => "hand_eye_rotation",
            Self::Translation(_) => "hand_eye_translation",
        }
    }

    /// Its directions; none of the time offset.
    #[must_use]
    pub fn directions(&self) -> &[Vector3<f64>] {
        match self {
            Self::TimeOffset => &[],
            Self::Rotation(directions) | Self::Translation(directions) => directions,
        }
    }

    /// All undetermined quantities of a fit.
    #[must_use]
    pub fn of(fit: &PoseFit) -> Vec<Self> {
        let hidden = &fit.hidden;
        let mut all = Vec::new();
        if hidden.time_offset {
            all.push(Self::TimeOffset);
        }
        if !hidden.rotation.is_empty() {
            all.push(Self::Rotation(hidden.rotation.clone()));
        }
        if !hidden.translation.is_empty() {
            all.push(Self::Translation(hidden.translation.clone()));
        }
        all
    }
}

impl fmt::Display for Unshown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TimeOffset => f.write_str(
                "the time offset cannot be determined from this motion: the robot stands still or moves \
                 evenly. Turn the tool to and fro while it moves, by ±15° about two axes, at 0.3 Hz or \
                 faster",
            ),
            Self::Rotation(directions) => write!(
                f,
                "the hand-eye rotation about {} cannot be determined from this motion. Turn the tool by ±15° \
                 or more about two different axes",
                names(directions)
            ),
            Self::Translation(directions) => write!(
                f,
                "the hand-eye translation along {} cannot be determined from this motion. Turn the tool by \
                ±15° or more about {}",
                names(directions),
                match directions.len() {
                    1 => "an axis perpendicular to it",
                    2 => "the axis perpendicular to both",
                    _ => "two different axes",
                }
            ),
        }
    }
}

/// "the x axis", "the x and y axes", "the direction (0.71, 0.71, 0.00)".
fn names(directions: &[Vector3<f64>]) -> String {
    let axis = |v: &Vector3<f64>| v.iter().position(|part| part.abs() > MAIN).map(|k| ["x", "y", "z"][k]);
    let all: Option<Vec<&str>> = directions.iter().map(axis).collect();
    match all.as_deref() {
        Some([one]) => format!("the {one} axis"),
        Some([first @ .., last]) => format!("the {} and {last} axes", first.join(", ")),
        _ => {
            let name = |v: &Vector3<f64>| format!("the direction ({:.2}, {:.2}, {:.2})", v.x, v.y, v.z);
            directions.iter().map(name).collect::<Vec<_>>().join(" and ")
        }
    }
}

impl SightingRemark {
    /// A stable word for programs.
    #[must_use]
    pub fn code(&self) -> &'static str {
        match self {
            Self::Unobservable(_) | Self::AtStops { .. } => "unobservable",
            Self::AmbiguousTimeOffset { .. } => "ambiguous-time-offset",
            Self::AmbiguousHandEye { .. } => "ambiguous-hand-eye",
            Self::FewSightings { .. } => "few-sightings",
            Self::SightingsLeftOut { .. } => "sightings-left-out",
            Self::OtherScale { .. } => "sighting-scale",
            Self::LargerThanStated { .. } => "noise-larger-than-stated",
            Self::LastingResiduals { .. } => "lasting-residuals",
            Self::HandEyeUncertain { .. } => "hand-eye-uncertain",
            Self::TimeOffsetUncertain { .. } => "time-offset-uncertain",
        }
    }
}

impl fmt::Display for SightingRemark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unobservable(what) => what.fmt(f),
            Self::AtStops { stops } => write!(
                f,
                "the time offset cannot be determined, because the robot stands still at each of the {stops} \
                 sightings. Use --at-stops to calibrate without it, or record while the robot moves"
            ),
            Self::AmbiguousTimeOffset { time_offsets_s: [one, other], z } => write!(
                f,
                "a time offset of {:.1} ms explains the sightings as well as {:.1} ms ({z:.1} σ apart): the motion repeats itself. State \
                 --offset-within, or move less regularly",
                other * 1e3,
                one * 1e3
            ),
            Self::AmbiguousHandEye { turn_rad, z } => write!(
                f,
                "a hand-eye transform that is turned by {:.0} degrees explains the readings as well ({z:.1} σ apart). \
                 Give a guess with --initial, or tilt the tool by 15 degrees about two axes",
                turn_rad.to_degrees()
            ),
            Self::FewSightings { count, of } => write!(
                f,
                "only {count} of {of} sightings fit one hand-eye transform; at least {LEAST_BOARD_PICTURES} \
                 and half of all are needed. Check that the rows are camera_from_target, of one target that \
                 stands still"
            ),
            Self::SightingsLeftOut { count, of } => {
                write!(f, "{count} of {of} sightings are outliers and were left out")
            }
            Self::OtherScale { factor, sigma } => write!(
                f,
                "the sightings' lengths are wrong: they must be multiplied by {factor:.4} ± {sigma:.4}. The answer is in the robot's lengths. \
                 Probable cause: another size of the marker, another unit, or a single camera that measures its own path"
            ),
            Self::LargerThanStated { factor } => write!(
                f,
                "residuals are {factor:.1} times larger than the stated noise; the uncertainties assume this \
                 larger error. Check that the target does not move and that its stated lengths are right"
            ),
            Self::LastingResiduals { factor } => write!(
                f,
                "neighbouring residuals are correlated, so the uncertainties are {:.1} times larger. The \
                 robot or the detector has a slowly changing error",
                factor.sqrt()
            ),
            Self::HandEyeUncertain { rotation_rad, translation_m } => write!(
                f,
                "the hand-eye transform has a large uncertainty: ± {:.3} degrees and ± {:.2} mm. Turn the \
                 tool further, about all axes, or take more sightings",
                rotation_rad.to_degrees(),
                translation_m * 1e3
            ),
            Self::TimeOffsetUncertain { sigma_s } => write!(
                f,
                "the time offset has a large uncertainty: ± {:.2} ms. Move faster, and change speed and \
                direction more often",
                sigma_s * 1e3
            ),
        }
    }
}

/// Reasons for a refusal, and warnings. The covariance contains all included effects.
#[must_use]
pub fn of_poses(
    fit: &PoseFit,
    covariance: &SMatrix<f64, SIZE, SIZE>,
) -> (Vec<SightingRemark>, Vec<SightingRemark>) {
    let (mut reasons, mut warnings) = (Vec::new(), Vec::new());
    reasons.extend(Unshown::of(fit).into_iter().map(SightingRemark::Unobservable));
    judge_sightings(fit, &mut reasons, &mut warnings);
    reasons.extend(fit.runner_up.filter(|other| !other.is_decided()).and_then(|other| rival(fit, &other)));
    let sigma = |k: usize| covariance[(k, k)].max(0.0).sqrt();
    let largest = |first: usize| (first..first + 3).map(sigma).fold(0.0, f64::max);
    // Undetermined directions are reported above.
    let shown =
        |directions: &[Vector3<f64>], first: usize| if directions.is_empty() { largest(first) } else { 0.0 };
    let rotation_rad = shown(&fit.hidden.rotation, HAND_EYE);
    let translation_m = shown(&fit.hidden.translation, HAND_EYE + 3);
    if rotation_rad > MOST_ROTATION_SIGMA_RAD || translation_m > MOST_TRANSLATION_SIGMA_M {
        reasons.push(SightingRemark::HandEyeUncertain { rotation_rad, translation_m });
    }
    if !fit.hidden.time_offset && sigma(TIME_OFFSET) > MOST_TIME_OFFSET_SIGMA_S {
        reasons.push(SightingRemark::TimeOffsetUncertain { sigma_s: sigma(TIME_OFFSET) });
    }
    (reasons, warnings)
}

/// Another answer that is not decided against; one at another time offset says nothing where that is hidden anyway.
fn rival(fit: &PoseFit, other: &OtherOffset) -> Option<SightingRemark> {
    let time_offsets_s = [fit.unknowns.time_offset_s, other.time_offset_s];
    if (time_offsets_s[0] - time_offsets_s[1]).abs() < ONE_OFFSET_S {
        return Some(SightingRemark::AmbiguousHandEye { turn_rad: other.turn_rad, z: other.z });
    }
    (!fit.hidden.time_offset).then_some(SightingRemark::AmbiguousTimeOffset { time_offsets_s, z: other.z })
}

fn judge_sightings(fit: &PoseFit, reasons: &mut Vec<SightingRemark>, warnings: &mut Vec<SightingRemark>) {
    let placed = fit.used.len() - fit.unplaced;
    let count = fit.used.iter().filter(|used| **used).count();
    let wrong = placed.saturating_sub(count);
    let is_few = (count as f64) < (1.0 - MOST_WRONG) * placed as f64;
    if count < LEAST_BOARD_PICTURES || is_few {
        reasons.push(SightingRemark::FewSightings { count, of: placed });
    } else if wrong as f64 > MANY_WRONG * placed as f64 {
        warnings.push(SightingRemark::SightingsLeftOut { count: wrong, of: placed });
    }
    let factor = fit.squares_per_freedom.sqrt();
    if factor > MOST_DISAGREEMENT {
        reasons.push(SightingRemark::LargerThanStated { factor });
    } else if factor > USUAL_DISAGREEMENT {
        warnings.push(SightingRemark::LargerThanStated { factor });
    }
    if let Some(scale) = &fit.scale {
        warnings.push(SightingRemark::OtherScale { factor: scale.factor, sigma: scale.sigma });
    }
    if fit.lasting > LASTING {
        warnings.push(SightingRemark::LastingResiduals { factor: fit.lasting });
    }
}
