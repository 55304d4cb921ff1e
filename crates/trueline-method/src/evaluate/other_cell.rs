//! Tests whether a calibration belongs to the scan on which it is used.

use crate::calibrate::calibrate;
use crate::config::Config;
use crate::problem::parameters::{ROTATION, TIME_OFFSET, TRANSLATION};
use crate::{Calibration, Status};
use trueline_dataset::{Guess, Recording};
use trueline_geometry::se3;

/// Distance between a scan's own calibration and another one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OtherCell {
    /// Distance of the two sensors' places, m.
    pub shift_m: f64,
    /// Angle between their attitudes, rad.
    pub turn_rad: f64,
    /// Difference of the time offsets, s.
    pub offset_s: f64,
    /// Whether it is too large for one cell. Else something has moved, or the calibration is wrong.
    pub is_other_cell: bool,
}

/// Largest tolerated distance of two calibrations.
struct Limits {
    shift_m: f64,
    turn_rad: f64,
    offset_s: f64,
    /// The difference must be this multiple of its standard deviation.
    sigmas: f64,
}

/// Limits within which a sensor may have been remounted in one cell.
const OTHER_CELL: Limits = Limits { shift_m: 5e-3, turn_rad: 0.02, offset_s: 0.02, sigmas: 10.0 };

/// Limits of a reported difference. The drift of cameras and robots in one cell is smaller.
const NOTABLE: Limits = Limits { shift_m: 1e-3, turn_rad: 3.5e-3, offset_s: 1e-3, sigmas: 5.0 };

/// Median distance of the points, as a multiple of the RMS residual of the scan's own calibration …
const NOTABLE_RATIO: f64 = 2.0;
/// … and in addition to it, m, above which the calibration is worse than possible.
const NOTABLE_MEDIAN_M: f64 = 0.05e-3;

/// Calibrates the scan by itself and compares. `None` if both agree, or if the scan does not calibrate by itself (a curved seam, too little motion).
/// `median_m` is the median distance of the points from the fitted line, if one was fitted.
#[must_use]
pub fn other_cell(
    recording: &Recording,
    by: &Guess,
    median_m: Option<f64>,
    config: &Config,
) -> Option<OtherCell> {
    let own = calibrate(recording, None, config).ok()?;
    if own.status() != Status::Accepted {
        return None;
    }
    let best = own.best_fit();
    let (turn, shift) = se3::difference_decoupled(&best.tool_from_camera, &by.tool_from_camera);
    let offset_s = best.time_offset_s - by.time_offset_s;
    let sigmas = sigmas(&own)?;
    let apart = [turn.norm(), shift.norm(), offset_s.abs()];
    let left_m = own.findings.fit.residuals.rms_m;
    let is_far = |median_m: f64| median_m > NOTABLE_RATIO * left_m && median_m > left_m + NOTABLE_MEDIAN_M;
    (NOTABLE.exceeded(apart, sigmas) || median_m.is_some_and(is_far)).then(|| OtherCell {
        shift_m: shift.norm(),
        turn_rad: turn.norm(),
        offset_s,
        is_other_cell: OTHER_CELL.exceeded(apart, sigmas),
    })
}

impl Limits {
    /// Whether one of rotation, shift and time offset exceeds its limit.
    fn exceeded(&self, apart: [f64; 3], own_sigmas: [f64; 3]) -> bool {
        let least = [self.turn_rad, self.shift_m, self.offset_s];
        (0..3).any(|k| apart[k] > least[k] && apart[k] > self.sigmas * own_sigmas[k])
    }
}

/// Standard deviations of rotation (rad), translation (m) and time offset (s), over all axes.
fn sigmas(own: &Calibration) -> Option<[f64; 3]> {
    let three = |first: usize| {
        let squared =
            (first..first + 3).map(|k| own.sigma(k).map(|sigma| sigma * sigma)).sum::<Option<f64>>();
        squared.map(f64::sqrt)
    };
    Some([three(ROTATION)?, three(TRANSLATION)?, own.sigma(TIME_OFFSET)?])
}
