//! Rows that are exposed one after the other.

use super::super::drawn_errors::DrawnErrors;
use super::super::error_table::ShopError;
use trueline_dataset::Measured;
use trueline_model::Camera;

/// How much later than the middle row the row of a feature is exposed, s.
pub(crate) fn delay_s(errors: &DrawnErrors, camera: &Camera, seen: &Measured) -> f64 {
    let (Some(readout_s), Measured::Pixel([_, v])) = (errors.size(ShopError::RollingShutter), seen) else {
        return 0.0;
    };
    readout_s * ((v + 0.5) / f64::from(camera.size[1]) - 0.5)
}
