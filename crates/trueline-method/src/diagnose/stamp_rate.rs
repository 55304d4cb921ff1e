//! Image stamps counted with a wrong rate.
//!
//! At the correct rate a linear regression of the seam's place on the robot's coordinates has the smallest residuals (see
//! [`crate::diagnose::shift_regression`]). Fits refine its result.

use crate::config::Config;
use crate::diagnose::estimated_mistakes::{Estimated, least, left};
use crate::diagnose::shift_regression::{Place, ShiftRegression, places};
use crate::diagnose::steps::Budget;
use crate::order_statistics::median;
use trueline_dataset::Recording;

/// Range of the rates about the one at which both streams have equal duration, relative.
const RANGE: f64 = 0.03;
/// See [`RANGE`].
const STEP: f64 = 0.002;
/// Range of the shifts tried at each rate, s, on either side.
const SHIFT_S: f64 = 1.2;
/// Step of these shifts, s.
const SHIFT_STEP_S: f64 = 0.05;
/// Steps of a rate around the best.
const STEPS: [f64; 2] = [1e-3, 3e-4];
/// A rate closer to one than this is an ordinary clock drift.
const LEAST_RATE: f64 = 2e-3;
/// Overlap of both streams, as a fraction of the images and in s.
const OVERLAP: (f64, f64) = (0.5, 2.0);

/// The rate with the best fit. `None` if it is that of the stamps.
#[must_use]
pub(super) fn stamp_rate(
    recording: &Recording,
    config: &Config,
    budget: Budget,
    stamped_hz: f64,
) -> Option<Estimated> {
    let (first, last) = (recording.features.first()?, recording.features.last()?);
    let (robot_first, robot_last) = (recording.robot.first()?, recording.robot.last()?);
    let lasts_s = |from_ns: i64, to_ns: i64| (to_ns - from_ns) as f64 * 1e-9;
    let equal = lasts_s(robot_first.stamp_ns, robot_last.stamp_ns) / lasts_s(first.stamp_ns, last.stamp_ns);
    let ahead_s = lasts_s(robot_first.stamp_ns, first.stamp_ns);
    let places = places(&recording.features);
    let explained = |factor: f64| {
        let scaled = places.iter().map(|place| Place { time_s: place.time_s * factor, ..*place }).collect();
        let regression = ShiftRegression::new(recording, scaled, OVERLAP.0, OVERLAP.1)?;
        let shifts = (0..=(2.0 * SHIFT_S / SHIFT_STEP_S) as usize)
            .map(|k| k as f64 * SHIFT_STEP_S - SHIFT_S - ahead_s)
            .filter_map(|shift_s| regression.at(shift_s));
        shifts.map(|shift| shift.score).max_by(f64::total_cmp)
    };
    let steps = (RANGE / STEP).round() as i32;
    let tried = (-steps..=steps).map(|k| equal * (1.0 + f64::from(k) * STEP));
    let scored = tried.filter_map(|factor| Some((explained(factor)?, factor)));
    let mut factor = scored.max_by(|a, b| a.0.total_cmp(&b.0))?.1;
    for step in STEPS {
        factor = least(
            |factor| left(&Estimated::StampRate { factor, stamped_hz }.mend(recording)?, config, budget),
            factor,
            step,
        )?;
    }
    ((factor - 1.0).abs() > LEAST_RATE).then_some(Estimated::StampRate { factor, stamped_hz })
}

/// Images per second according to their stamps, without missing ones.
pub(super) fn stamped_hz(recording: &Recording) -> f64 {
    let steps = recording.features.windows(2).map(|pair| (pair[1].stamp_ns - pair[0].stamp_ns) as f64 * 1e-9);
    median(steps.filter(|step_s| *step_s > 0.0)).map_or(f64::NAN, |period_s| 1.0 / period_s)
}
