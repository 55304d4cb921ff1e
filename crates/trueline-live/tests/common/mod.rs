//! What several tests need.

use nalgebra::{UnitVector3, Vector3};
use trueline_live::motion::MotionLimits;

/// Limits of a small cell.
pub fn limits() -> MotionLimits {
    MotionLimits {
        box_m: [Vector3::new(0.7, -0.2, 0.4), Vector3::new(1.3, 0.2, 0.8)],
        tool_axis: UnitVector3::new_normalize(-Vector3::z()),
        cone_rad: 0.6,
        speed_m_s: 0.12,
        acceleration_m_s2: 0.6,
        jerk_m_s3: 8.0,
        turn_rad_s: 0.6,
        turn_acceleration_rad_s2: 3.0,
        deviation_m: 0.03,
        deviation_rad: 0.2,
        start_m: 0.01,
        start_rad: 0.05,
    }
}
