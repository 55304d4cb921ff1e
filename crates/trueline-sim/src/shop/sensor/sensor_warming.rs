//! A sensor that moves along its view while it warms up.

use super::super::drawn_errors::DrawnErrors;
use super::super::error_table::ShopError;
use trueline_geometry::Pose;

/// The hand-eye transform so long after the middle of the scan, s.
pub(crate) fn warmed(mut tool_from_camera: Pose, errors: &DrawnErrors, after_middle_s: f64) -> Pose {
    let rate_m_s = errors.size_or_zero(ShopError::SensorWarming);
    tool_from_camera.translation.vector +=
        tool_from_camera.rotation * nalgebra::Vector3::z() * (rate_m_s * after_middle_s);
    tool_from_camera
}
