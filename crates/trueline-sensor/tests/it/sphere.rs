//! Time offset, hand-eye transform and a sphere from profiles.

use crate::round;

use nalgebra::Vector2;
use round::{ARM_M, calibrated, err_slowly, of_cast, off, options, squares, with_options};
use trueline_dataset::sensor_setup::Mounted;
use trueline_method::SensorMode;
use trueline_sensor::Error;
use trueline_sensor::board_files::BoardError;
use trueline_sensor::board_files::round_scan::{RoundCalibration, RoundCalibrationOptions};
use trueline_sensor::round::RoundTarget as Round;
use trueline_sensor::round::arc::arc;
use trueline_sensor::round::cut::Circle;
use trueline_sim::{PoseMotion, RoundScan, RoundTarget};

const RADIUS_M: f64 = 0.02;

fn usual(at_stops: bool, seed: u64) -> RoundScan {
    RoundScan::usual(RoundTarget::Sphere, RADIUS_M, at_stops, seed)
}

/// Errors of time offset, hand-eye and centre within four of their standard deviations: ten of them beyond are one run in 1,600.
fn assert_within(found: &RoundCalibration, scan: &RoundScan, what: &str) {
    let off = off(found, &scan.cast().sighted.truth);
    for k in (usize::from(scan.sighted.at_stops)..7).chain(10..13) {
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
            // The path is straight between samples 4 ms apart: 10 rad/s² (0.5 m of arm: 5 m/s²) bend it by a T²/8 = 10 µm at most. Of a
            // sphere in reach of 0.13 m that is 80 µrad.
            assert!(off[0].abs() < 2e-5, "{mounted:?}: {off}");
            assert!(off.fixed_rows::<3>(1).norm() < 2e-4, "{mounted:?} {at_stops}: {off}");
            assert!(off.fixed_rows::<3>(4).norm() < 5e-5, "{mounted:?} {at_stops}: {off}");
            assert!(off.fixed_rows::<3>(10).norm() < 5e-5, "{mounted:?} {at_stops}: {off}");
            let pose = &found.round.pose;
            assert!(pose.hidden.is_empty(), "{:?}", pose.hidden);
        }
    }
}

#[test]
fn noisy_profiles_give_the_truth_within_their_uncertainty() {
    for seed in 0..6 {
        for at_stops in [false, true] {
            let scan = usual(at_stops, seed);
            let found = calibrated(&scan).unwrap();
            assert_within(&found, &scan, &format!("seed {seed}, at stops {at_stops}"));
            let held_out = found.round.held_out.unwrap();
            assert!(held_out.rms_m > held_out.fitted_rms_m, "{held_out:?}");
        }
    }
}

/// The errors of a robot at stops count once, whether they differ from stop to stop or change slowly.
#[test]
fn errors_at_stops_are_as_large_as_stated() {
    const ROBOT_M: f64 = 0.05e-3;
    const HAND_EYE: [usize; 6] = [1, 2, 3, 4, 5, 6];
    let cells = 24;
    for is_slow in [false, true] {
        let mut sum = 0.0;
        for seed in 200..200 + cells {
            let mut scan = usual(true, seed);
            scan.sighted.robot_noise = [ROBOT_M, ROBOT_M / ARM_M];
            let options = RoundCalibrationOptions { sensor: SensorMode::Fixed, ..options(&scan) };
            scan.sighted.robot_noise = if is_slow { [0.0; 2] } else { scan.sighted.robot_noise };
            let mut cast = scan.cast();
            if is_slow {
                err_slowly(&mut cast.sighted.robot, ROBOT_M, seed);
            }
            let found = of_cast(&scan, &cast, &options).unwrap();
            sum += squares(&off(&found, &cast.sighted.truth), &found.covariance, &HAND_EYE);
        }
        let mean = sum / cells as f64;
        eprintln!("slow {is_slow}: {mean:.2}");
        // √(2 / (6 · 24)) is 0.12: four of these.
        assert!((0.53..1.47).contains(&mean), "slow {is_slow}: {mean}");
    }
}

#[test]
fn a_radius_that_nobody_states_is_estimated() {
    let scan = usual(false, 5);
    let free = RoundCalibrationOptions { radius_m: None, ..options(&scan) };
    let found = with_options(&scan, &free).unwrap();
    assert_within(&found, &scan, "free radius");
    let sigma_m = found.round.radius_sigma_m.unwrap();
    assert!((found.round.radius_m - RADIUS_M).abs() < 4.0 * sigma_m, "{} ± {sigma_m}", found.round.radius_m);
    assert_eq!(calibrated(&scan).unwrap().round.radius_sigma_m, None);
}

#[test]
fn three_of_ten_wrong_profiles_are_left_out() {
    let mut scan = usual(false, 7);
    scan.sighted.outliers = 0.3;
    let found = calibrated(&scan).unwrap();
    assert_within(&found, &scan, "outliers");
    let used = found.round.pose.used.iter().filter(|used| **used).count();
    // Of 300 profiles 90 are off by up to 6 mm along each axis; few of these are off by less than the noise.
    assert!((190..230).contains(&used), "{used}");
}

#[test]
fn what_a_motion_does_not_show_is_named() {
    let shifts = usual(false, 9).moving(PoseMotion::Shifts);
    let pose = calibrated(&shifts).unwrap().round.pose;
    assert_eq!(pose.hidden.translation.len(), 3, "{:?}", pose.hidden);
    assert!(pose.hidden.rotation.is_empty(), "{:?}", pose.hidden);
}

#[test]
fn a_sensor_whose_scale_is_off_is_found_and_carried() {
    let scan = usual(false, 11);
    let mut cast = scan.cast();
    for point in cast.profiles.iter_mut().flat_map(|profile| &mut profile.points) {
        point.x_m *= 1.004;
    }
    let found = of_cast(&scan, &cast, &options(&scan)).unwrap();
    assert_within(&found, &scan, "scale");
    let [h, sigma] = found.round.shape.unwrap();
    // The sensor reports too much: the correction is 1/1.004 − 1.
    assert!((h[0] - (1.0 / 1.004 - 1.0)).abs() < 4.0 * sigma[0], "{h} ± {sigma}");
    assert!(sigma[0] < 2e-3, "{sigma}");
}

#[test]
fn profiles_without_a_sphere_are_refused_with_their_number() {
    let scan = usual(true, 13);
    let small = RoundCalibrationOptions { radius_m: Some(0.004), ..options(&scan) };
    match with_options(&scan, &small).unwrap_err() {
        BoardError::Calibration { error: Error::TooFewArcs { found, profiles: 24, .. }, .. } => {
            assert!(found < 6, "{found}");
        }
        error => panic!("{error}"),
    }
}

/// Points of a circle of 20 mm about (5 mm, 150 mm), every 0.25 mm of x, so far as they lie nearer than 142 mm.
fn cap() -> Vec<Vector2<f64>> {
    let at = |k: i32| {
        let x = 0.25e-3 * f64::from(k);
        let across = x - 0.005;
        let z = 0.15 - (RADIUS_M.powi(2) - across * across).max(0.0).sqrt();
        (z < 0.142).then(|| Vector2::new(x, z))
    };
    (-100..=140).filter_map(at).collect()
}

#[test]
fn an_arc_is_found_on_a_table_and_a_table_is_none() {
    let table = |k: i32| Vector2::new(0.25e-3 * f64::from(k), 0.17 + 1e-5 * f64::from(k));
    let cap = cap();
    let mut profile: Vec<Vector2<f64>> = (-200..-120).map(table).collect();
    profile.extend(&cap);
    profile.extend((150..220).map(table));
    let found = arc(&profile, Round::Sphere, Some(RADIUS_M)).unwrap();
    let circle = Circle::of(&found).unwrap();
    assert!((circle.center_m - Vector2::new(0.005, 0.15)).norm() < 1e-9, "{circle:?}");
    assert!((circle.radius_m - RADIUS_M).abs() < 1e-9, "{circle:?}");
    // At either end a hundredth is left out.
    assert!(found.len() > cap.len() - 6 && found.len() <= cap.len(), "{} of {}", found.len(), cap.len());
    assert_eq!(arc(&profile, Round::Sphere, Some(0.015)), None);
    let flat: Vec<Vector2<f64>> = (-200..200).map(table).collect();
    assert_eq!(arc(&flat, Round::Sphere, None), None);
}
