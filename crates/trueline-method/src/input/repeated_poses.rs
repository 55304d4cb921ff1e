//! Removes poses that are reported more often than they change.
//!
//! A stream of 4 ms whose controller has a new pose every 12 ms repeats each three times. As recorded, the robot would stand and jump, and its poses
//! would be late by half the difference. Only the first of each is new. It became new at some time since the previous poll: immediately if both run
//! in step, else half a poll earlier on average.

use crate::order_statistics::median;
use trueline_geometry::Pose;

/// The samples with new poses.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Updates {
    /// Indices of the samples to keep, rising.
    pub kept: Vec<usize>,
    /// Number of rows left out.
    pub repeated: usize,
    /// Mean delay of the first of each, s.
    pub late_s: f64,
    /// Standard deviation of that delay, s.
    pub late_sigma_s: f64,
}

/// A pose that stays the same for longer than this belongs to a standing robot, s.
const REST_S: f64 = 0.15;
/// Least fraction of repetitions among the samples in motion before any is removed. A robot that turns around also stands still for a sample or two.
const LEAST_REPEATED: f64 = 0.1;
/// Controller and poll run in step if this fraction of the poses is repeated equally often.
const IN_STEP: f64 = 0.98;

/// Finds the samples with new poses.
#[must_use]
pub(crate) fn updates(times_s: &[f64], poses: &[Pose]) -> Updates {
    let mut kept = Vec::with_capacity(poses.len());
    let (mut repeated, mut moving) = (0, 0);
    let mut lengths: Vec<usize> = Vec::new();
    let mut start = 0;
    for end in 1..=poses.len() {
        if end < poses.len() && poses[end] == poses[start] {
            continue;
        }
        if times_s[end - 1] - times_s[start] > REST_S {
            kept.extend(start..end);
        } else {
            kept.push(start);
            repeated += end - start - 1;
            moving += end - start;
            lengths.push(end - start);
        }
        start = end;
    }
    if (repeated as f64) < LEAST_REPEATED * moving as f64 {
        return Updates { kept: (0..poses.len()).collect(), repeated: 0, late_s: 0.0, late_sigma_s: 0.0 };
    }
    let poll_s = median(times_s.windows(2).map(|w| w[1] - w[0])).unwrap_or(0.0);
    let usual = median(lengths.iter().map(|n| *n as f64)).unwrap_or(1.0);
    let as_usual = lengths.iter().filter(|n| **n as f64 == usual).count();
    let in_step = as_usual as f64 >= IN_STEP * lengths.len() as f64;
    // In step the delay is constant and may be anything up to a poll. Otherwise it is spread over a poll, evenly or on a few values: two values, 0
    // and half a poll, have a mean of a quarter.
    let spread_s = poll_s / 12.0_f64.sqrt();
    let (late_s, late_sigma_s) = if in_step { (0.0, spread_s) } else { (0.5 * poll_s, 0.5 * spread_s) };
    Updates { kept, repeated, late_s, late_sigma_s }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{UnitQuaternion, Vector3};
    use trueline_geometry::se3;

    fn stream(x: impl Fn(usize) -> f64) -> (Vec<f64>, Vec<Pose>) {
        let at = |k| se3::from_parts(UnitQuaternion::identity(), Vector3::new(x(k), 0.0, 0.0));
        ((0..300).map(|k| f64::from(k) * 0.004).collect(), (0..300).map(at).collect())
    }

    #[test]
    fn the_first_of_each_three_is_news() {
        let (times, poses) = stream(|k| (k / 3) as f64);
        let found = updates(&times, &poses);
        assert_eq!(found.kept, (0..300).step_by(3).collect::<Vec<_>>());
        assert_eq!(found.repeated, 200);
        // In step the actual delay is unknown.
        assert_eq!(found.late_s, 0.0);
        assert!((found.late_sigma_s / (0.004 / 12.0_f64.sqrt()) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn out_of_step_the_first_is_half_a_poll_late() {
        let (times, poses) = stream(|k| (k as f64 / 2.5).floor());
        let found = updates(&times, &poses);
        assert_eq!(found.repeated, 180);
        assert!((found.late_s - 0.002).abs() < 1e-12);
    }

    #[test]
    fn a_moving_robot_and_one_that_rests_keep_all() {
        let (times, poses) = stream(|k| k as f64);
        assert_eq!(updates(&times, &poses).repeated, 0);
        let (times, poses) = stream(|k| k.clamp(100, 200) as f64);
        assert_eq!(updates(&times, &poses).kept.len(), 300);
        // At rest before and after, and slow in between.
        let (times, poses) = stream(|k| (k.clamp(100, 200) / 2) as f64);
        let found = updates(&times, &poses);
        assert!((45..=52).contains(&found.repeated), "{}", found.repeated);
    }
}
