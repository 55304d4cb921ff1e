//! The clock of image stamps: it drifts, and is set during the scan.

use super::super::drawn_errors::DrawnErrors;
use super::super::error_table::ShopError;

/// Range of the scan in which a clock is set, as parts of it.
const STEP_WITHIN: [f64; 2] = [0.2, 0.8];

/// How much image stamps are ahead of the offset in the middle of the scan.
pub(crate) struct ImageClock {
    drift: f64,
    middle_s: f64,
    /// Time since the start, s, and by how much, s.
    step: Option<[f64; 2]>,
}

impl ImageClock {
    pub(crate) fn of(errors: &DrawnErrors, duration_s: f64) -> Self {
        let sign = |error| if errors.noise(error, 1).happens(0.5) { 1.0 } else { -1.0 };
        let step = errors.size(ShopError::ClockStep).map(|size_s| {
            let at = errors.noise(ShopError::ClockStep, 2).uniform(STEP_WITHIN[0], STEP_WITHIN[1]);
            [at * duration_s, sign(ShopError::ClockStep) * size_s]
        });
        let drift = sign(ShopError::ClockSkew) * errors.size_or_zero(ShopError::ClockSkew);
        Self { drift, middle_s: 0.5 * duration_s, step }
    }

    /// Addition to the offset at a time since the start, s.
    pub(crate) fn ahead_s(&self, time_s: f64) -> f64 {
        let stepped = self.step.map_or(0.0, |[at_s, by_s]| if time_s >= at_s { by_s } else { 0.0 });
        self.drift * (time_s - self.middle_s) + stepped
    }
}
