//! Spatter: features anywhere in the field of view, one at a time.

use super::super::drawn_errors::DrawnErrors;
use super::super::error_table::ShopError;
use crate::noise::Noise;

/// The spatter of a scan.
pub(super) struct Spatter {
    share: f64,
    noise: Noise,
}

impl Spatter {
    pub(super) fn of(errors: &DrawnErrors) -> Self {
        Self { share: errors.size_or_zero(ShopError::Spatter), noise: errors.noise(ShopError::Spatter, 1) }
    }

    /// Whether the next image has it.
    pub(super) fn next(&mut self) -> bool {
        self.noise.happens(self.share)
    }
}
