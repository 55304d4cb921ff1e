//! Scale, shear and keystone of a profiler.

use super::super::drawn_errors::DrawnErrors;
use super::super::error_table::ShopError;

/// Shear (rad) and keystone that go with a scale that is off by 1: 0.04° and 0.06 % with 0.1 %.
const SHEAR: f64 = 0.04 / 0.001 * std::f64::consts::PI / 180.0;
const KEYSTONE: f64 = 0.6;
/// Distance from the middle at which the keystone is stated, m.
const KEYSTONE_AT_M: f64 = 0.030;

/// The shape: h1 to h5 of the sheet's projective map.
pub(crate) struct ProfileShape {
    h: [f64; 5],
}

impl ProfileShape {
    pub(crate) fn of(errors: &DrawnErrors) -> Option<Self> {
        let size = errors.size(ShopError::ProfileShape)?;
        let mut noise = errors.noise(ShopError::ProfileShape, 1);
        let keystone = size * KEYSTONE / KEYSTONE_AT_M;
        Some(Self { h: [size, size, size * SHEAR, keystone, keystone].map(|sigma| noise.normal(sigma)) })
    }

    /// Reading of a point along the stripe and in range from the middle of the field, m.
    pub(crate) fn read(&self, [a, b]: [f64; 2]) -> [f64; 2] {
        let [h1, h2, h3, h4, h5] = self.h;
        let w = 1.0 + h4 * a + h5 * b;
        [((1.0 + h1) * a + h3 * b) / w, (1.0 + h2) * b / w]
    }
}
