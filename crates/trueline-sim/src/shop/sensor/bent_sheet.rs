//! A laser sheet that is bent along the stripe.

use super::super::drawn_errors::DrawnErrors;
use super::super::error_table::ShopError;

/// Distance from the middle of the stripe at which the sag is stated, m.
const STATED_AT_M: f64 = 0.020;

/// The sheet.
pub(crate) struct BentSheet {
    by_square: f64,
}

impl BentSheet {
    pub(crate) fn of(errors: &DrawnErrors) -> Option<Self> {
        let size_m = errors.size(ShopError::BentSheet)?;
        let sign = if errors.noise(ShopError::BentSheet, 1).happens(0.5) { 1.0 } else { -1.0 };
        Some(Self { by_square: sign * size_m / (STATED_AT_M * STATED_AT_M) })
    }

    /// How far the sheet is from its plane, along the normal, at a place along the stripe, m.
    pub(crate) fn off_plane_m(&self, stripe_m: f64) -> f64 {
        self.by_square * stripe_m * stripe_m
    }
}
