//! Noise of a detected point: Student's t, scaled to its standard deviation.

use super::super::drawn_errors::DrawnErrors;
use super::super::error_table::ShopError;
use crate::noise::Noise;

/// Degrees of freedom.
const FREEDOM: usize = 6;
/// Size of a pixel for sensors that measure lengths, m.
const M_PER_PX: f64 = 40e-6;

/// Standard deviation of a feature, px, or m for a length.
pub(crate) fn sigma(errors: &DrawnErrors, is_length: bool) -> f64 {
    errors.size_or_zero(ShopError::FeatureNoise) * if is_length { M_PER_PX } else { 1.0 }
}

/// A number of a standard deviation.
pub(super) fn drawn(noise: &mut Noise, sigma: f64) -> f64 {
    let squares: f64 = (0..FREEDOM).map(|_| noise.normal(1.0).powi(2)).sum();
    let freedom = FREEDOM as f64;
    // t has the variance n / (n − 2).
    noise.normal(sigma) / (squares / freedom).sqrt() * ((freedom - 2.0) / freedom).sqrt()
}
