//! Whether a calibration belongs to the scan that it is used on.

use crate::calibrate::calibrate;
use crate::config::Config;
use crate::problem::parameters::{ROTATION, TIME_OFFSET, TRANSLATION};
use crate::{Calibration, Status};
use trueline_dataset::{Guess, Recording};
use trueline_geometry::se3;

/// How far a scan's own calibration is from one that does not belong to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OtherCell {
    /// Distance of the two sensors' places, m.
    pub shift_m: f64,
    /// Angle between their attitudes, rad.
    pub turn_rad: f64,
    /// Difference of the time offsets, s.
    pub offset_s: f64,
}

/// Nobody remounts a sensor or delays its images by less and calls it the same, m, rad and s …
const SHIFT_M: f64 = 5e-3;
const TURN_RAD: f64 = 0.02;
const OFFSET_S: f64 = 0.02;
/// … and the scan must know it that much better than that.
const SIGMAS: f64 = 10.0;

/// Calibrates the scan by itself and compares; `None` where both agree, or where the scan does not calibrate by itself (a curved seam,
/// too little motion), so that nothing is known.
#[must_use]
pub fn other_cell(recording: &Recording, by: &Guess, config: &Config) -> Option<OtherCell> {
    let own = calibrate(recording, None, config).ok()?;
    if own.status() != Status::Accepted {
        return None;
    }
    let best = own.best_fit();
    let (turn, shift) = se3::difference_decoupled(&best.tool_from_camera, &by.tool_from_camera);
    let offset_s = best.time_offset_s - by.time_offset_s;
    let [turn_sigma, shift_sigma, offset_sigma] = sigmas(&own)?;
    let beyond = |size: f64, least: f64, sigma: f64| size > least && size > SIGMAS * sigma;
    (beyond(shift.norm(), SHIFT_M, shift_sigma)
        || beyond(turn.norm(), TURN_RAD, turn_sigma)
        || beyond(offset_s.abs(), OFFSET_S, offset_sigma))
    .then(|| OtherCell { shift_m: shift.norm(), turn_rad: turn.norm(), offset_s })
}

/// Standard deviations of rotation (rad), translation (m) and time offset (s), all axes together.
fn sigmas(own: &Calibration) -> Option<[f64; 3]> {
    let three = |first: usize| {
        let squared =
            (first..first + 3).map(|k| own.sigma(k).map(|sigma| sigma * sigma)).sum::<Option<f64>>();
        squared.map(f64::sqrt)
    };
    Some([three(ROTATION)?, three(TRANSLATION)?, own.sigma(TIME_OFFSET)?])
}
