//! Errors of u and v that go together: weighed by their correlation, the result is better and as good as it says.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use trueline_dataset::{Measured, Recording};
use trueline_method::{Config, calibrate};
use trueline_sim::noise::Noise;
use trueline_sim::{Disturbance, Preset, simulate};

/// Of the pixels of a seam point. A stripe that is seen at 45° moves u and v by the same.
const CORRELATION: f64 = 0.95;
const SIGMA_PX: f64 = 1.0;
const SEEDS: u64 = 24;

/// A scan whose only errors are those of its pixels, drawn with that correlation.
fn scan(seed: u64) -> Recording {
    let mut scenario = Preset::Quick.scenario();
    scenario.disturbance = Disturbance::default();
    let mut recording = simulate(&scenario, seed).unwrap();
    let mut noise = Noise::new(seed, 0xc0);
    for feature in &mut recording.features {
        let Measured::Pixel([u, v]) = feature.measured else { panic!("a camera was simulated") };
        let [a, b] = [noise.normal(SIGMA_PX), noise.normal(SIGMA_PX)];
        let other = CORRELATION * a + (1.0 - CORRELATION * CORRELATION).sqrt() * b;
        feature.measured = Measured::Pixel([u + a, v + other]);
        feature.sigma = Some([SIGMA_PX; 2]);
    }
    recording
}

/// Squares of (error, stated sigma, error / stated sigma) of the camera's place, summed over axes and scans, the features said to have
/// a correlation.
fn squares(stated: f64) -> [f64; 3] {
    let mut sums = [0.0; 3];
    for seed in 0..SEEDS {
        let mut recording = scan(seed);
        recording.features.iter_mut().for_each(|feature| feature.correlation = stated);
        let calibration = calibrate(&recording, None, &Config::default()).unwrap();
        let truth = &recording.truth.as_ref().unwrap().parameters;
        let found = calibration.best_fit().tool_from_camera.translation.vector;
        let error_m = found - truth.tool_from_camera.translation.vector;
        for axis in 0..3 {
            let sigma_m = calibration.sigma(4 + axis).unwrap();
            sums[0] += error_m[axis].powi(2);
            sums[1] += sigma_m.powi(2);
            sums[2] += (error_m[axis] / sigma_m).powi(2);
        }
    }
    sums.map(|sum| sum / (3 * SEEDS) as f64)
}

#[test]
fn correlated_pixels_are_weighed_by_what_they_say() {
    let [right, none, reverse] = [CORRELATION, 0.0, -CORRELATION].map(squares);
    for (name, sums) in [("right", right), ("none", none), ("reverse", reverse)] {
        let [error_mm, sigma_mm] = [sums[0].sqrt() * 1e3, sums[1].sqrt() * 1e3];
        println!("{name}: error {error_mm:.4} mm, said {sigma_mm:.4} mm, z {:.2}", sums[2].sqrt());
    }
    // 24 scans of three axes, which go together in pairs at worst: a mean square of 1 ± √(2/36) = 0.24; four of them.
    assert!((0.05..1.95).contains(&right[2]), "z² {}", right[2]);
    // Of the two numbers of a point one is known √(1 − ρ²) = 0.31 times as well as the sigmas alone say; the line's direction
    // decides how much of that counts. In every direction it counts for something.
    assert!(right[0] < 0.8 * none[0] && right[1] < 0.8 * none[1]);
    // Who states the wrong sign loses what the right one gains: the test would see it.
    assert!(reverse[0] > 1.5 * right[0]);
}
