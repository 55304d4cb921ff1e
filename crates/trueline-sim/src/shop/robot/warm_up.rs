//! Links that grow while the arm warms up.

use super::super::drawn_errors::DrawnErrors;
use super::super::error_table::ShopError;
use trueline_geometry::arm::six_axes::Arm;

/// The arm at a time since the start of the scan, s: each link longer by the same.
pub(crate) fn grown(mut arm: Arm, errors: &DrawnErrors, time_s: f64) -> Arm {
    let Some(rate_m_s) = errors.size(ShopError::WarmUp) else { return arm };
    for joint in &mut arm.joints {
        let link = joint.before.translation.vector;
        // Joints that meet in one point have no link between them.
        if let Some(along) = link.try_normalize(1e-6) {
            joint.before.translation.vector += along * (rate_m_s * time_s);
        }
    }
    arm
}
