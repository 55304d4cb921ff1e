//! Velocity of the tool at a time, from many samples.
//!
//! The slope between two neighbouring poses of a path is mostly noise: 10.6 mm/s for 0.03 mm an axis and 4
//! ms. It is 1.8 mm/s if each pose is that of a quadratic through ±20 ms
//! ([`crate::smooth::local_quadratic`]). In the derivative of a residual with respect to the time offset such
//! a velocity looks like information: a weld that runs straight along its seam would seem to show its time
//! offset. The slope of a cubic through the samples of ±60 ms has 0.4 mm/s of it. It is right to 0.4 % for a
//! weave of 2 Hz and to 14 % for one of 5 Hz, by which a change of the time offset then seems larger.

use crate::local_polynomial::coefficients;
use crate::{Trajectory, so3};
use nalgebra::{Vector3, Vector6};

/// Half the width of the window for a sufficiently fast stream, s.
const HALF_WINDOW_S: f64 = 0.06;
/// Samples on each side for a slower one.
const LEAST_SAMPLES: f64 = 5.0;

/// Velocity of the tool's origin (m/s) and angular velocity (rad/s), base frame.
#[derive(Clone, Copy, Debug)]
pub struct SmoothedVelocity {
    /// Velocity of the tool's origin, m/s.
    pub velocity: Vector3<f64>,
    /// Angular velocity, rad/s about the axes of the base.
    pub angular_velocity: Vector3<f64>,
}

fn half_window_s(trajectory: &Trajectory) -> f64 {
    HALF_WINDOW_S.max(LEAST_SAMPLES * trajectory.median_period())
}

/// The velocities at a time (s); `None` if the window reaches beyond the recording or into a gap. The slope
/// at the end of a cubic with samples on one side only would have up to twelve times the noise.
#[must_use]
pub fn smoothed_velocity(trajectory: &Trajectory, time_s: f64) -> Option<SmoothedVelocity> {
    let half_s = half_window_s(trajectory);
    let (first_s, last_s) = trajectory.span();
    if time_s - half_s < first_s || time_s + half_s > last_s {
        return None;
    }
    let here = trajectory.pose_at(time_s)?;
    let times = &trajectory.times()[..trajectory.segments().len()];
    let window =
        times.partition_point(|t| *t < time_s - half_s)..times.partition_point(|t| *t <= time_s + half_s);
    // Includes the segment in which the window begins.
    let touched = trajectory.segments().get(window.start.saturating_sub(1)..window.end)?;
    if touched.iter().any(|segment| segment.duration > trajectory.gap_limit()) {
        return None;
    }
    let samples = trajectory.segments().get(window)?.iter().map(|segment| {
        let moved = segment.base_from_tool.translation.vector - here.translation.vector;
        let turned = so3::log(&(segment.base_from_tool.rotation * here.rotation.inverse()));
        let both = Vector6::new(moved.x, moved.y, moved.z, turned.x, turned.y, turned.z);
        (segment.start - time_s, both)
    });
    let slope = coefficients::<4, 6>(samples, half_s)?.row(1) / half_s;
    Some(SmoothedVelocity {
        velocity: Vector3::new(slope[0], slope[1], slope[2]),
        angular_velocity: Vector3::new(slope[3], slope[4], slope[5]),
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::{Pose, se3, smooth};
    use nalgebra::UnitQuaternion;
    use std::f64::consts::TAU;

    const PERIOD_S: f64 = 0.004;

    fn path(at: impl Fn(f64) -> (Vector3<f64>, UnitQuaternion<f64>)) -> Trajectory {
        let times: Vec<f64> = (0..500).map(|k| f64::from(k) * PERIOD_S).collect();
        let pose = |t: &f64| {
            let (place, turn) = at(*t);
            se3::from_parts(turn, place)
        };
        let poses: Vec<_> = times.iter().map(pose).collect();
        Trajectory::new(times, &poses).unwrap()
    }

    /// The fit is a cubic. Between samples the pose is interpolated, which moves the middle and no slope.
    #[test]
    fn a_cubic_is_followed_exactly_and_a_turn_about_one_axis_too() {
        let axis = Vector3::new(0.6, 0.0, 0.8);
        // The tool has another attitude than the base, so its rate about its own axes is another vector.
        let held = so3::exp(&Vector3::new(0.9, -1.2, 0.4));
        let trajectory =
            path(|t| (Vector3::new(t * t * t, -2.0 * t, 0.5 * t * t), so3::exp(&(axis * (0.3 * t))) * held));
        let found = smoothed_velocity(&trajectory, 1.0013).unwrap();
        let t: f64 = 1.0013;
        assert!((found.velocity - Vector3::new(3.0 * t * t, -2.0, t)).norm() < 1e-9, "{:?}", found.velocity);
        assert!((found.angular_velocity - axis * 0.3).norm() < 1e-9, "{:?}", found.angular_velocity);
        assert!((held.inverse() * axis - axis).norm() > 0.5);
    }

    /// ω of Exp(a f) Exp(b g) is a f′ + Exp(a f) b g′ in base. The cubic's error is that of a fourth derivative of 0.1
    /// rad/s⁴ within ±60 ms: less than 1e-5.
    #[test]
    fn a_wrist_that_turns_about_two_axes_has_its_rate_in_base() {
        let (a, b) = (Vector3::y() * 0.5, Vector3::x() * 0.8);
        let turn = |t: f64| so3::exp(&(a * t.sin())) * so3::exp(&(b * (1.3 * t).cos()));
        let trajectory = path(|t| (Vector3::zeros(), turn(t)));
        let t: f64 = 0.9013;
        let known = a * t.cos() - so3::exp(&(a * t.sin())) * (b * (1.3 * (1.3 * t).sin()));
        let found = smoothed_velocity(&trajectory, t).unwrap().angular_velocity;
        assert!((found - known).norm() < 1e-5, "{found} {known}");
    }

    /// Savitzky and Golay's weights give 10.6, 1.82 and 0.38 mm/s; 6000 numbers, correlated over eleven neighbours, know it
    /// to 4 %.
    #[test]
    fn noise_of_the_poses_is_hardly_any_velocity() {
        let mut state = 7_u64;
        let mut noise = |_: usize, _: usize| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5) * 12.0_f64.sqrt() * 3e-5
        };
        let times: Vec<f64> = (0..2000).map(|k| f64::from(k) * PERIOD_S).collect();
        let none = UnitQuaternion::identity();
        let noisy: Vec<Pose> =
            times.iter().map(|_| se3::from_parts(none, Vector3::from_fn(&mut noise))).collect();
        let smoothed = smooth::local_quadratic(&times, &noisy, 0.016, smooth::HALF_WINDOW_S);
        let per_axis_mm_s = |velocities: Vec<Vector3<f64>>| {
            let squares: f64 = velocities.iter().map(Vector3::norm_squared).sum();
            1e3 * (squares / (3 * velocities.len()) as f64).sqrt()
        };
        let slopes = |poses: &[Pose]| {
            let moved = |pair: &[Pose]| (pair[1].translation.vector - pair[0].translation.vector) / PERIOD_S;
            per_axis_mm_s(poses[20..1980].windows(2).map(moved).collect())
        };
        assert!((slopes(&noisy) - 10.6).abs() < 0.4, "{}", slopes(&noisy));
        assert!((slopes(&smoothed) - 1.82).abs() < 0.2, "{}", slopes(&smoothed));
        let trajectory = Trajectory::new(times, &smoothed).unwrap();
        let here = |k: usize| smoothed_velocity(&trajectory, k as f64 * PERIOD_S).unwrap().velocity;
        let left = per_axis_mm_s((20..1980).map(here).collect());
        assert!((left - 0.38).abs() < 0.06, "{left}");
    }

    /// The slope of a cubic over ±T for a sine of ω is too small by (ωT)⁴/280 × 3 to first order: 2 Hz, 60 ms give 0.35 %.
    #[test]
    fn a_weave_keeps_its_velocity() {
        let weave = |hz: f64| {
            let trajectory =
                path(|t| (Vector3::x() * (TAU * hz * t).sin() / (TAU * hz), UnitQuaternion::identity()));
            smoothed_velocity(&trajectory, 1.0).unwrap().velocity.x
        };
        assert!((weave(2.0) - 1.0).abs() < 0.005, "{}", weave(2.0));
        // 13.5 % by the same formula. The next order reduces it slightly.
        assert!((weave(5.0) - 1.0).abs() < 0.14 && weave(5.0) < 1.0, "{}", weave(5.0));
    }

    #[test]
    fn ends_have_no_window() {
        let trajectory = path(|t| (Vector3::x() * t, UnitQuaternion::identity()));
        assert!(
            smoothed_velocity(&trajectory, 0.05).is_none() && smoothed_velocity(&trajectory, 1.95).is_none()
        );
        assert!(smoothed_velocity(&trajectory, 0.07).is_some());
    }
}
