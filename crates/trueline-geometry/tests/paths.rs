//! Tests sampled paths at their limits: ends, equal stamps, gaps, and the curve between samples.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use nalgebra::{UnitQuaternion, Vector3};
use trueline_geometry::curve::densified;
use trueline_geometry::trajectory::{TrajectoryError, median_period_s};
use trueline_geometry::{Pose, Trajectory, se3, so3};

fn at(place: Vector3<f64>) -> Pose {
    se3::from_parts(UnitQuaternion::identity(), place)
}

fn along_x(times: &[f64]) -> Vec<Pose> {
    times.iter().map(|t| at(Vector3::x() * *t)).collect()
}

fn path(times: &[f64]) -> Trajectory {
    Trajectory::new(times.to_vec(), &along_x(times)).unwrap()
}

#[test]
fn a_gap_is_longer_than_four_periods() {
    // Periods are binary fractions, so that four of them add up exactly.
    let times = [0.0, 0.25, 0.5, 0.75, 1.0, 2.0, 2.25, 3.5, 3.75];
    let trajectory = path(&times);
    assert_eq!((trajectory.median_period(), trajectory.gap_limit()), (0.25, 1.0));
    assert_eq!((trajectory.span(), trajectory.times()), ((0.0, 3.75), &times[..]));
    assert!(trajectory.pose_at(1.5).is_some() && trajectory.pose_at(3.0).is_none());
    let there: Vec<usize> = (0..9).filter(|k| trajectory.segment(*k).is_some()).collect();
    assert_eq!(there, [0, 1, 2, 3, 4, 5, 7]);
}

#[test]
fn at_equal_stamps_the_later_sample_counts_and_at_the_end_the_last_segment_that_lasts() {
    let poses: Vec<Pose> = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0].map(|x| at(Vector3::x() * x)).into();
    let trajectory = Trajectory::new(vec![0.0, 1.0, 1.0, 2.0, 2.0, 2.0], &poses).unwrap();
    let of = |time| trajectory.bracket(time);
    assert_eq!([of(0.0), of(0.99), of(1.0), of(1.5)], [Some(0), Some(0), Some(2), Some(2)]);
    assert_eq!([of(2.0), of(2.001), of(-0.001), of(f64::NAN)], [Some(2), None, None, None]);
    let x = |time| trajectory.pose_at(time).unwrap().translation.x;
    assert_eq!([x(0.5), x(1.0), x(1.5), x(2.0)], [0.5, 2.0, 2.5, 3.0]);
    // All stamps except the first are equal.
    let short = Trajectory::new(vec![0.0, 1.0, 1.0, 1.0], &poses[..4]).unwrap();
    assert_eq!((short.bracket(1.0), short.median_period()), (Some(0), 1.0));
}

#[test]
fn invalid_paths_are_refused_with_the_sample() {
    let refused = |times: &[f64]| Trajectory::new(times.to_vec(), &along_x(times)).unwrap_err();
    assert_eq!([refused(&[]), refused(&[1.0])], [TrajectoryError::TooFewSamples; 2]);
    // Two samples with one time have no duration.
    assert_eq!(refused(&[1.0, 1.0]), TrajectoryError::TooFewSamples);
    assert_eq!(refused(&[0.0, 1.0, 0.5]), TrajectoryError::TimeRunsBackwards { index: 2 });
    assert_eq!(refused(&[f64::NAN, 1.0]), TrajectoryError::TimeRunsBackwards { index: 1 });
    assert_eq!(refused(&[0.0, 1.0, f64::NAN, 2.0]), TrajectoryError::TimeRunsBackwards { index: 2 });
    let fewer = Trajectory::new(vec![0.0, 1.0, 2.0], &along_x(&[0.0, 1.0])).unwrap_err();
    assert_eq!(fewer, TrajectoryError::LengthsDiffer);
    let sentences = [
        (TrajectoryError::TooFewSamples, "fewer than two samples of rising time"),
        (TrajectoryError::LengthsDiffer, "there are not as many times as poses"),
        (TrajectoryError::TimeRunsBackwards { index: 7 }, "time runs backwards at sample 7"),
    ];
    for (error, sentence) in sentences {
        assert_eq!(error.to_string(), sentence);
    }
    // Two are enough.
    assert_eq!(
        (path(&[0.0, 1.0]).pose_at(0.25).unwrap().translation.x, path(&[0.0, 1.0]).median_period()),
        (0.25, 1.0)
    );
    assert_eq!(median_period_s(&[0.0, 1.0, 1.0, 3.0, 6.0]), Ok(2.0));
}

#[test]
fn between_samples_is_put_what_the_step_asks_for() {
    let times = [0.0, 0.25, 0.75, 1.0, 1.0, 3.0];
    let (dense, poses) = densified(&times, &along_x(&times), 1.0, 0.25);
    // A step of the requested length is kept. No samples are added between equal stamps or in a gap.
    assert_eq!(dense, [0.0, 0.25, 0.5, 0.75, 1.0, 1.0, 3.0]);
    assert!((poses[2].translation.x - 0.5).abs() < 1e-15);
    // Gaps up to the limit are bridged; a little more than two steps need three parts.
    let times = [0.0, 1.0, 2.0];
    assert_eq!(densified(&times, &along_x(&times), 1.0, 0.5).0, [0.0, 0.5, 1.0, 1.5, 2.0]);
    assert_eq!(densified(&times, &along_x(&times), 0.99, 0.5).0, times);
    assert_eq!(densified(&times, &along_x(&times), 1.0, 0.49).0.len(), 7);
    assert_eq!(densified(&[], &[], 1.0, 0.5).0.len(), 0);
}

/// Three samples to either side if available: degree five; less next to an end or a gap.
#[test]
fn the_curve_is_of_the_degree_that_the_samples_allow() {
    // Two stretches of eight samples with a gap between them, and different motions on its sides.
    let times: Vec<f64> = (0..16).map(|k| f64::from(k) + if k < 8 { 0.0 } else { 5.0 }).collect();
    let monomial = |degree: i32| {
        let value =
            |t: f64| if t < 8.0 { (t / 8.0).powi(degree) } else { ((21.0 - t) / 8.0).powi(degree) + 7.0 };
        let pose = |t: &f64| {
            let turn = so3::exp(&(Vector3::z() * (0.1 * value(*t))));
            se3::from_parts(turn, Vector3::new(value(*t), 0.0, -value(*t)))
        };
        let (dense_times, dense) = densified(&times, &times.iter().map(pose).collect::<Vec<_>>(), 1.0, 0.5);
        // Error at the middle of the interval that begins at each sample.
        let off = |k: usize| {
            let place = dense_times.iter().position(|t| *t == times[k] + 0.5).unwrap();
            let (turn, shift) = se3::difference_decoupled(&dense[place], &pose(&(times[k] + 0.5)));
            shift.norm().max(turn.norm())
        };
        std::array::from_fn::<bool, 7, _>(|k| off(k) < 1e-14 && off(14 - k) < 1e-14)
    };
    assert_eq!(monomial(3), [true; 7]);
    // Four samples at the very ends, five in the next interval, and six with three on each side.
    assert_eq!(monomial(4), [false, true, true, true, true, true, false]);
    assert_eq!(monomial(5), [false, false, true, true, true, false, false]);
    assert_eq!(monomial(6), [false; 7]);
}
