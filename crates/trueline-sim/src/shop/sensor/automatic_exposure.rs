//! Exposure that follows the brightness of the stripe, which follows the work angle: the middle of the exposure moves against the stamp.

use super::super::drawn_errors::DrawnErrors;
use super::super::error_table::ShopError;

/// Work angle at which the exposure is doubled, rad; it is not changed by more.
const DOUBLED_AT_RAD: f64 = 10.0 * std::f64::consts::PI / 180.0;

/// The exposure.
pub(crate) struct AutomaticExposure {
    middle_s: f64,
}

impl AutomaticExposure {
    pub(crate) fn of(errors: &DrawnErrors) -> Option<Self> {
        Some(Self { middle_s: errors.size(ShopError::AutomaticExposure)? })
    }

    /// How much later than usual the middle of the exposure is, s.
    pub(crate) fn later_s(&self, work_angle_rad: f64) -> f64 {
        let exposure_s = self.middle_s * (work_angle_rad / DOUBLED_AT_RAD).clamp(-1.0, 1.0).exp2();
        0.5 * (exposure_s - self.middle_s)
    }
}
