//! The arm's kinematics: the inverse against the forward one, and the errors' size.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use trueline_sim::arm::{Arm, NOMINAL, forward, inverse};
use trueline_sim::noise::Noise;

/// Joint angles in front of the arm, elbow up, wrist not flipped.
fn angles(random: &mut ChaCha8Rng) -> [f64; 6] {
    let mut between = |low: f64, high: f64| random.random_range(low..high);
    [
        between(-1.2, 1.2),
        between(-0.3, 1.0),
        between(-0.6, 0.8),
        between(-1.5, 1.5),
        between(0.3, 1.8),
        between(-3.0, 3.0),
    ]
}

#[test]
fn the_inverse_undoes_the_forward_kinematics() {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    for _ in 0..500 {
        let wanted = angles(&mut random);
        let pose = forward(&NOMINAL, &wanted);
        let found = inverse(&pose).unwrap();
        for (found, wanted) in found.iter().zip(&wanted) {
            // Rounding, magnified by the wrist's smallest sine of 0.3.
            assert!((found - wanted).abs() < 1e-10, "{found} {wanted}");
        }
    }
}

#[test]
fn stretched_out_the_arm_reaches_what_the_data_sheet_says() {
    // Upper arm horizontal, forearm in line with it: 0.32 + 1.125 + hypot(0.2, 1.1425) m from the first axis to the wrist.
    let bend_zero = -(1.1425_f64).atan2(0.2);
    let wrist_and_flange = forward(&NOMINAL, &[0.0, std::f64::consts::FRAC_PI_2, bend_zero, 0.0, 0.0, 0.0]);
    let flange_axis = wrist_and_flange.rotation * nalgebra::Vector3::z();
    let wrist = wrist_and_flange.translation.vector - flange_axis * 0.2;
    assert!((wrist.xy().norm() - (0.32 + 1.125 + 0.2_f64.hypot(1.1425))).abs() < 1e-12);
    assert!((wrist.z - 0.78).abs() < 1e-12);
    let beyond = nalgebra::Isometry3::translation(3.5, 0.0, 1.0);
    assert!(inverse(&beyond).is_none());
}

/// The errors were sized for 0.3 mm RMS over the workspace with the mean removed; drawn arms differ by tens of
/// percent, and the mean of 40 by a few.
#[test]
fn drawn_arms_have_the_stated_accuracy() {
    let mut random = ChaCha8Rng::seed_from_u64(2);
    let middle = forward(&NOMINAL, &[0.2, 0.3, 0.2, 0.3, 1.1, 0.4]);
    let mut mean_square = 0.0;
    for seed in 0..40 {
        let arm = Arm::before(&middle, Noise::new(seed, 1), 0.3e-3).unwrap();
        let errors: Vec<_> = (0..200)
            .map(|_| forward(&NOMINAL, &angles(&mut random)))
            .map(|pose| arm.true_from_nominal(&pose).unwrap().translation.vector - pose.translation.vector)
            .collect();
        let mean = errors.iter().sum::<nalgebra::Vector3<f64>>() / errors.len() as f64;
        mean_square +=
            errors.iter().map(|e| (e - mean).norm_squared()).sum::<f64>() / errors.len() as f64 / 40.0;
    }
    let rms_mm = mean_square.sqrt() * 1e3;
    assert!((0.2..0.4).contains(&rms_mm), "{rms_mm}");
}
