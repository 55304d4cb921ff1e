//! Helpers of several tests.

#![allow(dead_code, reason = "no test needs all of it")]

pub(crate) mod liar;

use nalgebra::{UnitVector3, Vector3};
use trueline_dataset::RobotSample;
use trueline_geometry::{Pose, so3};
use trueline_live::RobotFrame;
use trueline_live::egm::{Generation, MciState, MotorState, RapidState};
use trueline_live::motion::MotionLimits;

/// Time between frames.
pub(crate) const PERIOD_S: f64 = 0.004_032;
/// The same, ns.
pub(crate) const PERIOD_NS: i64 = 4_032_000;

/// Limits of a small cell.
pub(crate) fn limits() -> MotionLimits {
    MotionLimits {
        box_m: [Vector3::new(0.7, -0.2, 0.4), Vector3::new(1.3, 0.2, 0.8)],
        tool_axis: UnitVector3::new_normalize(-Vector3::z()),
        cone_rad: 0.6,
        reach_m: 0.3,
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

/// An S of 6 s that begins and ends in the midst of motion: the gate has to start and stop it.
pub(crate) fn s_path(scale: f64) -> Vec<RobotSample> {
    let down = so3::exp(&Vector3::new(std::f64::consts::PI, 0.0, 0.0));
    (0..=600)
        .map(|k| {
            let t = f64::from(k) * 0.01;
            let position =
                Vector3::new(0.85 + 0.05 * t, 0.02 * (2.5 * t).sin(), 0.6 + 0.01 * (1.3 * t).cos());
            let turn = Vector3::new(0.1 * (2.0 * t).sin(), 0.15 * (1.7 * t).sin(), 0.1 * (1.1 * t).cos());
            RobotSample {
                stamp_ns: (t * scale * 1e9) as i64,
                device_ns: None,
                base_from_tool: Pose::from_parts(position.into(), down * so3::exp(&turn)),
            }
        })
        .collect()
}

/// A good frame of a guided robot.
pub(crate) fn frame(k: i64, pose: Pose) -> RobotFrame {
    RobotFrame {
        sequence: k as u32,
        base_from_tool: pose,
        device_ns: 500_000_000_000 + k * PERIOD_NS,
        ptp_ns: None,
        motors: MotorState::On,
        mci: MciState::Running,
        rapid: RapidState::Running,
        utilization_percent: Some(20.0),
        converged: false,
        collided: false,
        generation: Generation::From7,
        attitudes_differ: false,
        digital: None,
    }
}
