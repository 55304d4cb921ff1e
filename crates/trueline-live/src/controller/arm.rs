//! The robot follows a reference late, proportionally, filtered, and within its limits.
//!
//! `speed = k·(reference − position) + speed reference` through a first-order low pass. The dead time lies before it: a
//! reference takes so long to reach the loop.

use super::settings::Following;
use nalgebra::{UnitQuaternion, Vector3, Vector6};
use std::collections::VecDeque;
use trueline_geometry::{Pose, so3};

/// Commanded motion of the robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// Commanded pose.
    pub pose: Pose,
    /// How to move there: m/s and rad/s in base.
    pub velocity: Vector6<f64>,
}

/// The robot's set point and how it moves.
#[derive(Clone, Debug)]
pub struct Arm {
    following: Following,
    pose: Pose,
    velocity: Vector6<f64>,
    filtered: Vector6<f64>,
    on_its_way: VecDeque<Target>,
    late_cycles: usize,
    utilization: f64,
}

impl Arm {
    /// At rest.
    #[must_use]
    pub fn new(pose: Pose, following: Following, period_s: f64) -> Self {
        Self {
            following,
            pose,
            velocity: Vector6::zeros(),
            filtered: Vector6::zeros(),
            on_its_way: VecDeque::new(),
            late_cycles: (following.dead_time_s / period_s).round() as usize,
            utilization: 0.0,
        }
    }

    /// Its pose.
    #[must_use]
    pub fn pose(&self) -> Pose {
        self.pose
    }

    /// Used share of its limits; 1 is all.
    #[must_use]
    pub fn utilization(&self) -> f64 {
        self.utilization
    }

    /// Moves for a cycle after a target, with a share of the gain while guidance ramps in; without a target it brakes.
    pub fn follow(&mut self, target: Option<&Target>, ramp_in: f64, period_s: f64) {
        match target {
            Some(target) => self.on_its_way.push_back(*target),
            None => self.on_its_way.clear(),
        }
        let late = self.on_its_way.len() > self.late_cycles;
        let due = if late { self.on_its_way.pop_front() } else { None };
        let asked = due.map_or_else(Vector6::zeros, |target| {
            let away = target.pose.translation.vector - self.pose.translation.vector;
            let turned = so3::log(&(target.pose.rotation * self.pose.rotation.inverse()));
            let error = Vector6::new(away.x, away.y, away.z, turned.x, turned.y, turned.z);
            (error * self.following.gain_per_s + target.velocity) * ramp_in
        });
        let share = -(-std::f64::consts::TAU * self.following.low_pass_hz * period_s).exp_m1();
        self.filtered += (asked - self.filtered) * share;
        self.move_within_limits(self.filtered, period_s);
    }

    fn move_within_limits(&mut self, wanted: Vector6<f64>, period_s: f64) {
        let f = &self.following;
        let (linear, linear_use) = approach(
            self.velocity.fixed_rows::<3>(0).into(),
            wanted.fixed_rows::<3>(0).into(),
            f.speed_m_s,
            f.acceleration_m_s2 * period_s,
        );
        let (angular, angular_use) = approach(
            self.velocity.fixed_rows::<3>(3).into(),
            wanted.fixed_rows::<3>(3).into(),
            f.turn_rad_s,
            f.turn_acceleration_rad_s2 * period_s,
        );
        self.utilization = linear_use.max(angular_use);
        self.velocity.fixed_rows_mut::<3>(0).copy_from(&linear);
        self.velocity.fixed_rows_mut::<3>(3).copy_from(&angular);
        let rotation: UnitQuaternion<f64> = so3::exp(&(angular * period_s)) * self.pose.rotation;
        let position = self.pose.translation.vector + linear * period_s;
        self.pose = Pose::from_parts(position.into(), UnitQuaternion::new_normalize(rotation.into_inner()));
    }
}

/// A velocity nearer to the wanted one, and its use of the limits.
fn approach(
    now: Vector3<f64>,
    wanted: Vector3<f64>,
    fastest: f64,
    greatest_change: f64,
) -> (Vector3<f64>, f64) {
    let capped = wanted.cap_magnitude(fastest);
    let change = capped - now;
    let used = (wanted.norm() / fastest).max(change.norm() / greatest_change);
    (now + change.cap_magnitude(greatest_change), used)
}
