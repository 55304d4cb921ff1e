//! Time offset, hand-eye transform and a cylinder from profiles.

use crate::round;

use nalgebra::{Vector2, Vector3};
use rayon::prelude::*;
use round::{ARM_M, calibrated, err_slowly, of_cast, off, options, squares, with_options};
use trueline_dataset::sensor_setup::Mounted;
use trueline_geometry::se3;
use trueline_method::SensorMode;
use trueline_sensor::board_files::round_scan::{RoundCalibration, RoundCalibrationOptions};
use trueline_sensor::round::RoundTarget as Round;
use trueline_sensor::round::arc::arc;
use trueline_sim::{PoseMotion, RoundScan, RoundTarget};

const RADIUS_M: f64 = 0.02;
/// Position errors of the robot, per axis, m.
const ROBOT_M: f64 = 0.02e-3;
/// What is estimated of a cylinder, in the order of the covariance: all but its turn about its axis and its place along it.
const ESTIMATED: [usize; 11] = [0, 1, 2, 3, 4, 5, 6, 7, 9, 10, 12];

fn usual(at_stops: bool, seed: u64) -> RoundScan {
    RoundScan::usual(RoundTarget::Cylinder, RADIUS_M, at_stops, seed)
}

fn estimated(at_stops: bool) -> impl Iterator<Item = usize> {
    ESTIMATED.into_iter().skip(usize::from(at_stops))
}

/// Errors within four of their standard deviations: eleven of them beyond are one run in 1,400.
fn assert_within(found: &RoundCalibration, scan: &RoundScan, what: &str) {
    let off = off(found, &scan.cast().sighted.truth);
    for k in estimated(scan.sighted.at_stops) {
        let sigma = found.covariance[(k, k)].sqrt();
        assert!(off[k].abs() < 4.0 * sigma, "{what}, component {k}: {} ± {sigma}", off[k]);
    }
}

#[test]
fn exact_profiles_give_the_truth_on_the_tool_and_beside_the_robot_moving_and_at_stops() {
    for mounted in [Mounted::Tool, Mounted::Fixed] {
        for at_stops in [false, true] {
            let mut scan = usual(at_stops, 3);
            scan.noise_m = 0.0;
            scan.sighted.mounted = mounted;
            scan.sighted.robot_noise = [0.0; 2];
            if !at_stops {
                scan.sighted.time_offset_s = -0.731;
            }
            let found = calibrated(&scan).unwrap();
            let off = off(&found, &scan.cast().sighted.truth);
            // At stops nothing is rounded. Moving, the path is straight between samples 4 ms apart, as with a sphere: 10 µm and 80 µrad.
            let [time_s, turn, shift_m] = if at_stops { [0.0, 1e-7, 1e-8] } else { [2e-5, 2e-4, 5e-5] };
            assert!(off[0].abs() <= time_s, "{mounted:?}: {off}");
            for (first, limit) in [(1, turn), (4, shift_m), (7, turn), (10, shift_m)] {
                assert!(off.fixed_rows::<3>(first).norm() < limit, "{mounted:?} {at_stops}: {off}");
            }
            let pose = &found.round.pose;
            assert!(pose.hidden.is_empty(), "{:?}", pose.hidden);
        }
    }
}

#[test]
fn noisy_profiles_give_the_truth_within_their_uncertainty() {
    for seed in 0..4 {
        for at_stops in [false, true] {
            let scan = usual(at_stops, seed);
            let found = calibrated(&scan).unwrap();
            assert_within(&found, &scan, &format!("seed {seed}, at stops {at_stops}"));
            let held_out = found.round.held_out.unwrap();
            assert!(held_out.rms_m > held_out.fitted_rms_m, "{held_out:?}");
        }
    }
}

/// Blocks of the covariance: rotation, translation, what is known of the cylinder, and all of them.
const BLOCKS: [&[usize]; 4] = [&[1, 2, 3], &[4, 5, 6], &[7, 9, 10, 12], &[1, 2, 3, 4, 5, 6, 7, 9, 10, 12]];

/// Squares of the errors of each block over their covariance, for each radius that is stated or not. Starts are near the truth: other tests search.
fn squares_at_stops(seed: u64, is_slow: bool, stated: &[Option<f64>]) -> Vec<[f64; 4]> {
    let mut scan = usual(true, seed);
    scan.sighted.robot_noise = [ROBOT_M, ROBOT_M / ARM_M];
    let mut usual = RoundCalibrationOptions { sensor: SensorMode::Fixed, ..options(&scan) };
    scan.sighted.robot_noise = if is_slow { [0.0; 2] } else { scan.sighted.robot_noise };
    let mut cast = scan.cast();
    if is_slow {
        err_slowly(&mut cast.sighted.robot, ROBOT_M, seed);
    }
    let mut near = cast.sighted.truth.parameters;
    near.tool_from_camera =
        se3::retract_decoupled(&near.tool_from_camera, &Vector3::repeat(0.05), &Vector3::repeat(0.01));
    usual.scan.guess = Some(near);
    let of = |radius_m: &Option<f64>| {
        let options = RoundCalibrationOptions { radius_m: *radius_m, ..usual };
        let found = of_cast(&scan, &cast, &options).unwrap();
        let used = &found.round.pose.used;
        assert!(used.iter().all(|used| *used), "seed {seed}: {used:?}");
        let off = off(&found, &cast.sighted.truth);
        BLOCKS.map(|block| squares(&off, &found.covariance, block))
    };
    stated.iter().map(of).collect()
}

/// The stated accuracy of a robot covers what differs from stop to stop and what changes slowly over the workspace. Of robots that err in one of the
/// two ways alone, neither must count twice or be missed.
#[test]
fn errors_are_as_large_as_their_covariance_says() {
    let seeds = 100..140;
    let count = seeds.clone().count() as f64;
    for (is_slow, stated) in [(false, &[Some(RADIUS_M), None][..]), (true, &[Some(RADIUS_M)])] {
        let all: Vec<Vec<[f64; 4]>> =
            seeds.clone().into_par_iter().map(|seed| squares_at_stops(seed, is_slow, stated)).collect();
        for (row, (block, of)) in
            (0..stated.len()).flat_map(|row| BLOCKS.iter().enumerate().map(move |b| (row, b)))
        {
            // A mean of χ²/n over so many scans has a standard deviation of √(2/(n · scans)).
            let spread = f64::sqrt(2.0 / (of.len() as f64 * count));
            let mean = all.iter().map(|squares| squares[row][block]).sum::<f64>() / count;
            eprintln!("slow {is_slow}: {mean:.2} ± {spread:.2} of {of:?}");
            // Slow errors move the residuals a little, and count as noise so far.
            let least = if is_slow { 0.8 } else { 1.0 } - 4.0 * spread;
            assert!((least..1.0 + 4.0 * spread).contains(&mean), "{mean} ± {spread} of {of:?}, row {row}");
        }
    }
}

#[test]
fn a_radius_that_nobody_states_is_estimated() {
    let scan = usual(false, 5);
    let free = RoundCalibrationOptions { radius_m: None, ..options(&scan) };
    let found = with_options(&scan, &free).unwrap();
    assert_within(&found, &scan, "free radius");
    let sigma_m = found.round.radius_sigma_m.unwrap();
    let radius_m = found.round.radius_m;
    assert!((radius_m - RADIUS_M).abs() < 4.0 * sigma_m, "{radius_m} ± {sigma_m}");
}

#[test]
fn three_of_ten_wrong_profiles_are_left_out() {
    let mut scan = usual(false, 7);
    scan.sighted.outliers = 0.3;
    let found = calibrated(&scan).unwrap();
    assert_within(&found, &scan, "outliers");
}

#[test]
fn what_a_motion_does_not_show_is_named() {
    // Shifts without a turn show no translation of the sensor, and of its rotation not the turn about the cylinder's axis.
    let shifts = calibrated(&usual(false, 9).moving(PoseMotion::Shifts)).unwrap().round.pose;
    assert_eq!(shifts.hidden.translation.len(), 3, "{:?}", shifts.hidden);
    let of_cylinder = shifts.covariance.fixed_view::<6, 6>(7, 7);
    // What a cylinder looks the same under is held whatever the motion is, and has no uncertainty that could be taken for knowledge.
    assert_eq!((of_cylinder[(1, 1)], of_cylinder[(4, 4)]), (0.0, 0.0));
}

/// The arc of an ellipse with half axes of 23 and 20 mm, the longer turned by 0.4 rad, about (5 mm, 150 mm), and a table below.
fn cap() -> Vec<Vector2<f64>> {
    let turn = nalgebra::Rotation2::new(0.4);
    let at = |k: i32| {
        let angle = 0.01 * f64::from(k);
        turn * Vector2::new(0.023 * angle.cos(), 0.02 * angle.sin()) + Vector2::new(0.005, 0.15)
    };
    let mut points: Vec<Vector2<f64>> = (-240..-110).map(at).collect();
    points.sort_by(|a, b| a.x.total_cmp(&b.x));
    points
}

#[test]
fn an_arc_of_an_ellipse_is_found_beside_a_table() {
    let table = |k: i32| Vector2::new(0.25e-3 * f64::from(k), 0.17 + 1e-5 * f64::from(k));
    let cap = cap();
    let (first, last) = (cap[0].x, cap[cap.len() - 1].x);
    let mut profile: Vec<Vector2<f64>> = (-200..200).map(table).filter(|p| p.x < first - 0.006).collect();
    profile.extend(&cap);
    profile.extend((-200..300).map(table).filter(|p| p.x > last + 0.006));
    let found = arc(&profile, Round::Cylinder, Some(RADIUS_M)).unwrap();
    assert!(found.len() > cap.len() - 8 && found.len() <= cap.len(), "{} of {}", found.len(), cap.len());
    let flat: Vec<Vector2<f64>> = (-200..200).map(table).collect();
    assert_eq!(arc(&flat, Round::Cylinder, None), None);
}
