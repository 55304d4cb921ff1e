//! Tests the noise of poses: which values are used, and the remainder after a local fit.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use nalgebra::{UnitQuaternion, Vector3};
use trueline_geometry::{Pose, Trajectory, se3, smooth, smoothed_velocity::smoothed_velocity, so3};

const PERIOD_S: f64 = 0.004;
const GAP_S: f64 = 0.016;

/// Uniform numbers over ±√3, with variance 1 and without correlation.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 11) as f64 / (1_u64 << 53) as f64 - 0.5) * 12.0_f64.sqrt()
    }

    fn vector(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.next())
    }
}

fn even(count: usize) -> Vec<f64> {
    (0..count).map(|k| k as f64 * PERIOD_S).collect()
}

fn at(place: Vector3<f64>) -> Pose {
    se3::from_parts(UnitQuaternion::identity(), place)
}

#[test]
fn four_windows_are_enough_and_three_are_not() {
    let mut noise = Noise(3);
    let poses: Vec<Pose> = (0..12).map(|_| at(noise.vector() * 1e-5)).collect();
    let of = |count: usize| smooth::position_noise(&even(count), &poses[..count], PERIOD_S, GAP_S);
    // A window has nine samples and three axes: twelve numbers.
    assert_eq!((of(11), of(0), smooth::rotation_noise(&[], &[], PERIOD_S, GAP_S)), (0.0, 0.0, 0.0));
    assert!(of(12) > 1e-6);
}

/// One deviation from a straight motion, and its eighth differences: (1, 8, 28, 56, 70) over √C(16, 8).
#[test]
fn the_noise_of_a_single_wrong_sample_is_that_of_the_eighth_difference() {
    let times = even(17);
    let mut poses: Vec<Pose> = times.iter().map(|t| at(Vector3::new(*t, -*t, 2.0 * t))).collect();
    let all = [1.0, 8.0, 28.0, 56.0, 70.0, 56.0, 28.0, 8.0, 1.0].map(|c: f64| c / 12_870_f64.sqrt());
    poses[8].translation.vector += Vector3::repeat(1e-3);
    // In nine windows it is at each place once. The median of the nine is 28.
    let expected = 1e-3 * all[2] / 0.674_49;
    let found = smooth::position_noise(&times, &poses, PERIOD_S, GAP_S);
    // Rounding of 1e-3 times the weights of 1e2.
    assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
}

#[test]
fn rests_and_gaps_and_equal_stamps_are_no_noise() {
    let mut noise = Noise(5);
    let times = even(300);
    let mut poses: Vec<Pose> = times.iter().map(|t| at(Vector3::x() * *t + noise.vector() * 1e-5)).collect();
    let all = smooth::position_noise(&times, &poses, PERIOD_S, GAP_S);
    assert!((all / 1e-5 - 1.0).abs() < 0.2, "{all}");
    // Every nine numbers contain a repetition, so no window remains.
    for k in (8..300).step_by(8) {
        poses[k].translation = poses[k - 1].translation;
    }
    assert_eq!(smooth::position_noise(&times, &poses, PERIOD_S, GAP_S), 0.0);
    // A step up to the gap limit is bridged. A longer one is not, and neither is a zero step.
    let moving: Vec<Pose> = times.iter().map(|t| at(Vector3::x() * *t + noise.vector() * 1e-5)).collect();
    for (long_s, joins) in [(0.0156, true), (0.0164, false), (0.0, false)] {
        let mut time_s = 0.0;
        let stretched: Vec<f64> = (0..300)
            .map(|k| {
                time_s += if k % 8 == 0 { long_s } else { PERIOD_S };
                time_s
            })
            .collect();
        assert_eq!(smooth::position_noise(&stretched, &moving, PERIOD_S, GAP_S) > 0.0, joins, "{long_s}");
    }
}

/// Jitter of the stamps is no position noise: samples are placed at whole periods, and lost ones are skipped.
#[test]
fn stamps_count_in_whole_periods() {
    let curve = |periods: f64| {
        let x = 0.01 * periods;
        at(Vector3::new(x.powi(7), x.powi(6) - x, x * x))
    };
    let mut periods = 0.0;
    let numbers: Vec<f64> = (0..60)
        .map(|k| {
            periods += if k % 7 == 3 { 2.0 } else { 1.0 };
            periods
        })
        .collect();
    let poses: Vec<Pose> = numbers.iter().map(|n| curve(*n)).collect();
    let jittering: Vec<f64> = numbers.iter().map(|n| (n + 0.2 * (2.3 * n).sin()) * PERIOD_S).collect();
    // A polynomial of degree seven through eight neighbours is exact: 1e-16 of values up to 0.1 times weights of 1e2.
    let found = smooth::position_noise(&jittering, &poses, PERIOD_S, GAP_S);
    assert!(found < 1e-14, "{found:e}");
}

#[test]
fn turns_are_as_noisy_as_shifts_of_that_many_radians() {
    let mut noise = Noise(7);
    let times = even(1000);
    let turns: Vec<Pose> = (times.iter())
        .map(|t| {
            let motion = so3::exp(&(Vector3::new(0.1, -0.2, 0.3) * (0.5 * t).sin()));
            se3::from_parts(motion * so3::exp(&(noise.vector() * 2e-5)), Vector3::zeros())
        })
        .collect();
    let found = smooth::rotation_noise(&times, &turns, PERIOD_S, GAP_S);
    // A median of 3000 numbers with correlated neighbours.
    assert!((found / 2e-5 - 1.0).abs() < 0.15, "{found}");
    // All positions are equal and have no noise.
    assert_eq!(smooth::position_noise(&times, &turns, PERIOD_S, GAP_S), 0.0);
}

#[test]
fn the_noise_left_by_a_fit_follows_from_its_weights() {
    // Savitzky–Golay weights of two, three and four neighbours on each side: variance 17/35, 7/21, 59/231.
    for (half_s, expected) in [(0.0199, 1.0), (0.02, 17.0 / 35.0), (0.03, 7.0 / 21.0), (0.0401, 59.0 / 231.0)]
    {
        let left = smooth::noise_left(0.01, half_s).powi(2);
        assert!((left - expected).abs() < 1e-12, "{half_s}: {left} {expected}");
    }
}

/// Weights of 5 points: (−3, 12, 17, 12, −3)/35, and of 7: (−2, 3, 6, 7, 6, 3, −2)/21.
#[test]
fn a_sample_becomes_the_weighted_sum_of_those_within_the_window_on_both_sides() {
    let times: Vec<f64> = (0..40).map(|k| f64::from(k) * 0.01).collect();
    let mut noise = Noise(11);
    let poses: Vec<Pose> =
        (0..40).map(|_| se3::from_parts(so3::exp(&(noise.vector() * 1e-9)), noise.vector() * 1e-3)).collect();
    let places = |poses: &[Pose]| poses.iter().map(|pose| pose.translation.vector).collect::<Vec<_>>();
    let before = places(&poses);
    let weighted = |k: usize, weights: &[f64]| -> Vector3<f64> {
        let side = weights.len() / 2;
        weights.iter().enumerate().map(|(i, weight)| before[k - side + i] * *weight).sum()
    };
    let five = [-3.0, 12.0, 17.0, 12.0, -3.0].map(|w| w / 35.0);
    let seven = [-2.0, 3.0, 6.0, 7.0, 6.0, 3.0, -2.0].map(|w| w / 21.0);
    // Values of 1 mm, with weights accurate to 1e-9 of the window.
    let same = |a: Vector3<f64>, b: Vector3<f64>| (a - b).norm() < 1e-11;
    let found = places(&smooth::local_quadratic(&times, &poses, 0.04, 0.02));
    for k in 0..40 {
        let expected = if (2..38).contains(&k) { weighted(k, &five) } else { before[k] };
        assert!(same(found[k], expected), "{k}");
    }
    let found = places(&smooth::local_quadratic(&times, &poses, 0.04, 0.03));
    for k in 0..40 {
        let expected = match k {
            3..37 => weighted(k, &seven),
            // Equally many on both sides: near an end the window is limited by the distance to it.
            2 | 37 => weighted(k, &five),
            _ => before[k],
        };
        assert!(same(found[k], expected), "{k}");
    }
    // A gap acts like an end. A step of the gap limit is bridged.
    let gapped: Vec<f64> =
        times.iter().enumerate().map(|(k, t)| if k < 20 { *t } else { t + 0.031 }).collect();
    let found = places(&smooth::local_quadratic(&gapped, &poses, 0.04, 0.02));
    for k in 16..24 {
        let expected = if (18..22).contains(&k) { before[k] } else { weighted(k, &five) };
        assert!(same(found[k], expected), "{k}");
    }
}

/// Without a sample for a test the window stays narrow. Without distortion it is as wide as allowed.
#[test]
fn windows_are_widened_only_on_evidence() {
    let times = even(2000);
    let mut noise = Noise(13);
    let still: Vec<Pose> = times.iter().map(|t| at(Vector3::x() * *t + noise.vector() * 3e-5)).collect();
    let widest = smooth::half_window_s(&times, &still, GAP_S, 3e-5, 0.06);
    // 20 ms times 1.2 to the power that fits into 60 ms: six.
    assert!((widest - 0.020 * 1.2_f64.powi(6)).abs() < 1e-12, "{widest}");
    let few = 12;
    assert_eq!(smooth::half_window_s(&times[..few], &still[..few], GAP_S, 3e-5, 0.06), smooth::HALF_WINDOW_S);
    assert_eq!(smooth::half_window_s(&[], &[], GAP_S, 3e-5, 0.06), smooth::HALF_WINDOW_S);
    // A robot that rotates about its tool's origin moves the tip by 0.12 m times √2 a radian.
    let turning: Vec<Pose> = (times.iter())
        .map(|t| {
            let turn = so3::exp(&(Vector3::z() * (0.05 * (std::f64::consts::TAU * 4.0 * t).sin())));
            se3::from_parts(turn, noise.vector() * 3e-5)
        })
        .collect();
    assert_eq!(smooth::half_window_s(&times, &turning, GAP_S, 3e-5, 0.06), smooth::HALF_WINDOW_S);
}

/// A slow robot's window extends over five samples on each side, and never across a gap.
#[test]
fn the_velocity_of_a_slow_robot_comes_from_five_samples_to_either_side() {
    let times: Vec<f64> = (0..60).map(|k| f64::from(k) * 0.05).collect();
    let motion = |t: &f64| at(Vector3::new(t.powi(3), -2.0 * t, 0.5 * t * t));
    let poses: Vec<Pose> = times.iter().map(motion).collect();
    let trajectory = Trajectory::new(times.clone(), &poses).unwrap();
    for (time_s, there) in [(0.249, false), (0.251, true), (2.699, true), (2.701, false)] {
        assert_eq!(smoothed_velocity(&trajectory, time_s).is_some(), there, "{time_s}");
    }
    let t: f64 = 1.512;
    let found = smoothed_velocity(&trajectory, t).unwrap();
    assert!((found.velocity - Vector3::new(3.0 * t * t, -2.0, t)).norm() < 1e-9, "{}", found.velocity);
    assert!(found.angular_velocity.norm() < 1e-12);
    // Two lost samples in succession are bridged, and five are not: the window of ±0.25 s must not touch them.
    let without = |lost: std::ops::Range<usize>| {
        let kept = |k: &usize| !lost.contains(k);
        let (times, poses): (Vec<f64>, Vec<Pose>) =
            (0..60).filter(kept).map(|k| (times[k], poses[k])).unzip();
        Trajectory::new(times, &poses).unwrap()
    };
    assert!(smoothed_velocity(&without(28..30), 1.21).is_some());
    let gapped = without(28..33);
    for (time_s, there) in [(1.09, true), (1.21, false), (1.36, false), (1.8, false), (1.91, true)] {
        assert_eq!(smoothed_velocity(&gapped, time_s).is_some(), there, "{time_s}");
    }
}
