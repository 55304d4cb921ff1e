//! Limits that just hold a path: a start, to be read and narrowed by the person responsible for the robot.

use super::checked_path::{BRISKEST_PER_S, CheckedPath, LAG_S, PathError};
use super::limits::{FASTEST_M_S, MotionLimits};
use nalgebra::{UnitVector3, Vector3};
use trueline_dataset::RobotSample;

/// Room on every side of the path beside where the scan may begin, m.
const ROOM_M: f64 = 0.02;
/// Room of the cone, rad.
const ROOM_RAD: f64 = 0.05;
/// Margin between the path and its limits.
const SLACK: f64 = 1.1;

/// A path at rest has limits as well, m/s.
const LEAST_M_S: f64 = 1e-3;

/// Assumed reach of the tool's load if none is stated, m: a sensor or a torch on a bracket.
pub const REACH_M: f64 = 0.5;

/// Limits for a path at a share of its own pace, of a tool that carries something as far as `reach_m` from its origin.
///
/// # Errors
/// A path that no limits can allow: it moves the tool's load faster than the cap that no limits file can raise.
pub fn limits_for(poses: &[RobotSample], pace: f64, reach_m: f64) -> Result<MotionLimits, PathError> {
    let axis = poses.iter().map(|p| p.base_from_tool.rotation * Vector3::z()).sum::<Vector3<f64>>();
    let tool_axis = UnitVector3::try_new(axis, 1e-3).ok_or(PathError::Attitude { at_s: 0.0 })?;
    let anything = MotionLimits { reach_m, ..anything(tool_axis) };
    let path = CheckedPath::new(poses, pace, &anything)?;
    let most = path.extremes();
    let start_m = 0.005;
    let start_rad = 2.0_f64.to_radians();
    let [low, high] = path.extent_m();
    let room = Vector3::repeat(start_m + ROOM_M);
    let lean = poses.iter().map(|p| anything.cone_angle_rad(&p.base_from_tool)).fold(0.0, f64::max);
    let speeding = BRISKEST_PER_S;
    Ok(MotionLimits {
        box_m: [low - room, high + room],
        tool_axis,
        cone_rad: lean + start_rad + ROOM_RAD,
        reach_m,
        speed_m_s: (most.speed_m_s * SLACK).clamp(LEAST_M_S, FASTEST_M_S),
        acceleration_m_s2: ((most.acceleration_m_s2 + most.speed_m_s * speeding) * SLACK)
            .max(10.0 * LEAST_M_S),
        jerk_m_s3: ((most.jerk_m_s3
            + speeding * (3.0 * most.acceleration_m_s2 + 2.0 * most.speed_m_s / LAG_S))
            * SLACK)
            .max(100.0 * LEAST_M_S),
        turn_rad_s: (most.turn_rad_s * SLACK).max(0.01).min(FASTEST_M_S / reach_m),
        turn_acceleration_rad_s2: (most.turn_acceleration_rad_s2 + most.turn_rad_s * speeding).max(0.01)
            * SLACK,
        deviation_m: 0.015,
        deviation_rad: 5.0_f64.to_radians(),
        start_m,
        start_rad,
    })
}

fn anything(tool_axis: UnitVector3<f64>) -> MotionLimits {
    MotionLimits {
        box_m: [Vector3::repeat(-1e3), Vector3::repeat(1e3)],
        tool_axis,
        cone_rad: 10.0,
        reach_m: 0.0,
        speed_m_s: 1e3,
        acceleration_m_s2: 1e6,
        jerk_m_s3: 1e9,
        turn_rad_s: 1e3,
        turn_acceleration_rad_s2: 1e6,
        deviation_m: 1.0,
        deviation_rad: 1.0,
        start_m: 0.0,
        start_rad: 0.0,
    }
}
