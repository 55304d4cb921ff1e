//! Waves in a profiler's depth.

use super::super::drawn_errors::DrawnErrors;
use super::super::error_table::ShopError;
use std::f64::consts::TAU;

/// Waves in the measuring range.
const WAVES: [f64; 2] = [1.0, 3.0];

/// The waves.
pub(crate) struct Linearity {
    amplitude_m: f64,
    /// Wave vector along the stripe and in range, rad/m.
    wave: [f64; 2],
    phase: f64,
}

impl Linearity {
    /// The waves of a profiler with a measuring range, m.
    pub(crate) fn of(errors: &DrawnErrors, range_m: f64) -> Option<Self> {
        let size = errors.size(ShopError::Linearity)?;
        let mut noise = errors.noise(ShopError::Linearity, 1);
        let mut wave = || TAU * noise.uniform(WAVES[0], WAVES[1]) / range_m;
        Some(Self {
            wave: [0.5 * wave(), wave()],
            amplitude_m: size * range_m,
            phase: noise.uniform(0.0, TAU),
        })
    }

    /// Reading of a point along the stripe and in range from the middle of the field, m.
    pub(crate) fn read(&self, [a, b]: [f64; 2]) -> [f64; 2] {
        [a, b + self.amplitude_m * (self.wave[0] * a + self.wave[1] * b + self.phase).sin()]
    }
}
