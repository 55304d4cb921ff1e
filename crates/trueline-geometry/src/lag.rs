//! A path that follows a recorded one with a first-order lag: an arm behind its commanded poses.
//!
//! Position: ẏ = (x − y)/τ. Along a straight piece x = x₀ + v t the lag settles at v τ, so that y(t) = x(t) − v τ + (y₀ −
//! x₀ + v τ) e^(−t/τ). The attitude lags by the same law in the axes of the tool. This is exact while a piece turns about
//! one axis, and right to the square of the lag's angle otherwise.

use crate::trajectory::TrajectoryError;
use crate::{Pose, Trajectory, se3, so3};
use nalgebra::Vector3;

/// Lag of the follower behind a path: in base (m) and in the tool (rad).
#[derive(Clone, Copy)]
struct Behind {
    shift: Vector3<f64>,
    turn: Vector3<f64>,
}

impl Behind {
    const NOTHING: Self = Self { shift: Vector3::new(0.0, 0.0, 0.0), turn: Vector3::new(0.0, 0.0, 0.0) };
}

/// The path with a lag behind this one, s. At its beginning, and after each gap, the follower has settled.
///
/// # Errors
/// Those of [`Trajectory::new`].
pub fn first_order(path: &Trajectory, lag_s: f64) -> Result<Trajectory, TrajectoryError> {
    let mut poses: Vec<Pose> = Vec::with_capacity(path.times().len());
    let mut behind: Option<Behind> = None;
    for (index, segment) in path.segments().iter().enumerate() {
        let Some(segment) = path.segment(index) else {
            // A gap, or two samples with one time.
            poses.push(moved(&segment.base_from_tool, &behind.unwrap_or(Behind::NOTHING)));
            behind = behind.filter(|_| segment.duration <= 0.0);
            continue;
        };
        let settled = Behind { shift: segment.velocity * -lag_s, turn: segment.body_rate * -lag_s };
        let before = behind.unwrap_or(settled);
        poses.push(moved(&segment.base_from_tool, &before));
        let kept = (-segment.duration / lag_s).exp();
        let now = Behind {
            shift: settled.shift + (before.shift - settled.shift) * kept,
            turn: settled.turn + (before.turn - settled.turn) * kept,
        };
        behind = Some(now);
    }
    if let Some(last) = path.segments().last() {
        let end = last.pose_at(last.start + last.duration);
        poses.push(moved(&end, &behind.unwrap_or(Behind::NOTHING)));
    }
    Trajectory::new(path.times().to_vec(), &poses)
}

/// The path that leads by the same law, with time reversed. It is as smooth as the lagging path, and no real
/// motion resembles it.
///
/// # Errors
/// Those of [`Trajectory::new`].
pub fn first_order_ahead(path: &Trajectory, lag_s: f64) -> Result<Trajectory, TrajectoryError> {
    turned_round(&first_order(&turned_round(path)?, lag_s)?)
}

fn turned_round(path: &Trajectory) -> Result<Trajectory, TrajectoryError> {
    let mut poses: Vec<Pose> = path.segments().iter().map(|segment| segment.base_from_tool).collect();
    poses.extend(path.segments().last().map(|last| last.pose_at(last.start + last.duration)));
    poses.reverse();
    Trajectory::new(path.times().iter().rev().map(|time| -time).collect(), &poses)
}

fn moved(pose: &Pose, by: &Behind) -> Pose {
    se3::from_parts(pose.rotation * so3::exp(&by.turn), pose.translation.vector + by.shift)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::{first_order, first_order_ahead};
    use crate::{Trajectory, se3, so3};
    use nalgebra::Vector3;

    /// Against gain and phase of a first-order lag for a sine, in position and in attitude about one axis.
    #[test]
    fn a_sine_lags_as_the_transfer_function_says() {
        let (lag_s, rate) = (0.025, 2.0 * std::f64::consts::PI * 1.5);
        let gain = (1.0 + (rate * lag_s).powi(2)).sqrt().recip();
        let phase = (rate * lag_s).atan();
        let pose = |gain: f64, at: f64| {
            se3::from_parts(
                so3::exp(&(Vector3::new(0.6, 0.0, 0.8) * (0.2 * gain * at.sin()))),
                Vector3::new(0.05, -0.02, 0.01) * (gain * at.sin()),
            )
        };
        let times: Vec<f64> = (0..4_000).map(|k| 0.001 * f64::from(k)).collect();
        let poses: Vec<_> = times.iter().map(|t| pose(1.0, rate * t)).collect();
        let path = Trajectory::new(times, &poses).unwrap();
        let lagged = first_order(&path, lag_s).unwrap();
        let ahead = first_order_ahead(&path, lag_s).unwrap();
        for time in [0.5, 1.234, 3.9] {
            let (is, wanted) = (lagged.pose_at(time).unwrap(), pose(gain, rate * time - phase));
            // Pieces of 1 ms bend by a (1 ms)² / 8 = 1e-7 of the amplitude of 0.05 m and ω² = 89 /s².
            assert!((is.translation.vector - wanted.translation.vector).norm() < 1e-6);
            assert!(is.rotation.angle_to(&wanted.rotation) < 5e-6);
        }
        // Four seconds are six turns: at their end the leading path has settled long ago.
        for time in [0.5, 1.234, 3.5] {
            let (is, wanted) = (ahead.pose_at(time).unwrap(), pose(gain, rate * time + phase));
            assert!((is.translation.vector - wanted.translation.vector).norm() < 1e-6);
        }
    }
}
