//! A seam that is bowed.

use super::super::drawn_errors::DrawnErrors;
use super::super::error_table::ShopError;
use std::f64::consts::TAU;

/// The length that a sagitta is stated for, m.
const STATED_ON_M: f64 = 0.3;

/// The bow.
pub(crate) struct Bow {
    /// Across and in height, 1/m: times the square of the place.
    by_square: [f64; 2],
}

impl Bow {
    pub(crate) fn of(errors: &DrawnErrors) -> Option<Self> {
        let sagitta_m = errors.size(ShopError::Bow)?;
        let direction = errors.noise(ShopError::Bow, 1).uniform(0.0, TAU);
        let half_m = 0.5 * STATED_ON_M;
        let by_square = sagitta_m / (half_m * half_m);
        Some(Self { by_square: [by_square * direction.cos(), by_square * direction.sin()] })
    }

    /// Displacement across and in height at a place along the seam, m.
    pub(crate) fn at(&self, along_m: f64) -> [f64; 2] {
        self.by_square.map(|by_square| by_square * along_m * along_m)
    }
}
