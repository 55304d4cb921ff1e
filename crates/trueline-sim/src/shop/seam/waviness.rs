//! A seam that is wavy.

use super::super::drawn_errors::DrawnErrors;
use super::super::error_table::ShopError;
use crate::faults::Wobble;

/// Correlation lengths, m.
const LENGTHS_M: [f64; 2] = [0.003, 0.030];
/// The sweep of the sensor reaches beyond the length of the scan by less than this, m.
const BEYOND_M: f64 = 0.1;

/// The waves of a seam of a length, m.
pub(crate) fn waves(errors: &DrawnErrors, length_m: f64) -> Option<Wobble> {
    let rms_m = errors.size(ShopError::Waviness)?;
    let mut noise = errors.noise(ShopError::Waviness, 1);
    let length = noise.uniform(LENGTHS_M[0].ln(), LENGTHS_M[1].ln()).exp();
    Some(Wobble::new(noise, [rms_m, rms_m], length, 0.5 * length_m + BEYOND_M))
}
