//! Joints that stay behind their encoder: by as much in one direction as in the other.

use super::super::drawn_errors::DrawnErrors;
use super::super::error_table::ShopError;
use trueline_geometry::arm::six_axes::AXES;

/// The speed at which a joint has changed sides, rad/s.
const FULL_AT_RAD_S: f64 = 0.01;

/// Difference of each link from its encoder at the joints' speeds (rad/s), rad. A joint at rest is in the middle.
pub(crate) fn behind(errors: &DrawnErrors, rates: &[f64; AXES]) -> [f64; AXES] {
    let half_width = errors.size_or_zero(ShopError::Hysteresis);
    rates.map(|rate| -half_width * (rate / FULL_AT_RAD_S).tanh())
}
