//! Stretches in which nothing is found.

use super::super::drawn_errors::DrawnErrors;
use super::super::error_table::ShopError;
use super::stretches;

/// Duration of one, s.
const LASTS_S: [f64; 2] = [0.2, 1.0];

/// The gaps of a scan, s.
pub(super) fn of(errors: &DrawnErrors, duration_s: f64) -> Vec<[f64; 2]> {
    errors.size(ShopError::Gaps).map_or_else(Vec::new, |share| {
        stretches::drawn(&mut errors.noise(ShopError::Gaps, 1), share.min(0.5), duration_s, LASTS_S)
    })
}
