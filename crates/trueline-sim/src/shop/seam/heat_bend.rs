//! A seam that the heat of other welds has bent: cubic, with a kink.

use super::super::drawn_errors::DrawnErrors;
use super::super::error_table::ShopError;
use std::f64::consts::TAU;

/// The kink is within this part of half the scan.
const KINK_WITHIN: f64 = 0.5;

/// The bend.
pub(crate) struct HeatBend {
    half_length_m: f64,
    /// Across and in height, m at the ends of the scan.
    cubic_m: [f64; 2],
    kink_m: [f64; 2],
    kink_at: f64,
}

impl HeatBend {
    pub(crate) fn of(errors: &DrawnErrors, length_m: f64) -> Option<Self> {
        let size_m = errors.size(ShopError::HeatBend)?;
        let mut noise = errors.noise(ShopError::HeatBend, 1);
        let mut direction = || {
            let angle = noise.uniform(0.0, TAU);
            [size_m * angle.cos(), size_m * angle.sin()]
        };
        let (cubic_m, kink_m) = (direction(), direction());
        Some(Self {
            half_length_m: 0.5 * length_m,
            cubic_m,
            kink_m,
            kink_at: noise.uniform(-KINK_WITHIN, KINK_WITHIN),
        })
    }

    /// Displacement across and in height at a place along the seam, m.
    pub(crate) fn at(&self, along_m: f64) -> [f64; 2] {
        let place = along_m / self.half_length_m;
        let kink = (place - self.kink_at).max(0.0) / (1.0 - self.kink_at);
        [0, 1].map(|axis| self.cubic_m[axis] * place.powi(3) + self.kink_m[axis] * kink)
    }
}
