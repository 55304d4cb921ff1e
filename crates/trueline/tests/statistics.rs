//! The ± means what it says: Monte Carlo spread against predicted covariance.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use nalgebra::{DMatrix, DVector};
use trueline::{Config, calibrate};
use trueline_geometry::se3;
use trueline_sim::{Preset, simulate};

const RUNS: u64 = 120;

/// Mean normalised error squared of the seven sensor unknowns, divided by seven, over seeded scans.
fn mean_normalised_error(preset: Preset) -> f64 {
    let total: f64 = (1000..1000 + RUNS)
        .map(|seed| {
            let recording = simulate(&preset.scenario(), seed).unwrap();
            let truth = recording.truth.as_ref().unwrap().parameters;
            let calibration = calibrate(&recording, Some(&truth), &Config::default()).unwrap();
            let estimate = &calibration.parameters;
            let (turn, shift) =
                se3::difference_decoupled(&estimate.tool_from_camera, &truth.tool_from_camera);
            let mut error = vec![estimate.time_offset_s - truth.time_offset_s];
            error.extend(turn.iter().chain(shift.iter()));
            let error = DVector::from_vec(error);
            let covariance: DMatrix<f64> = calibration.covariance.view((0, 0), (7, 7)).into_owned();
            error.dot(&covariance.cholesky().unwrap().solve(&error)) / 7.0
        })
        .sum();
    total / RUNS as f64
}

/// χ² with 7·120 degrees of freedom over as many: standard deviation √(2/840) = 0.049. The covariance itself
/// is estimated from some 660 frames, which adds about (7 + 1)/660 = 1 % to the mean, more where the data's own
/// share is large. Four standard deviations and 10 %: 0.8 to 1.3.
fn assert_honest(preset: Preset) {
    let mean = mean_normalised_error(preset);
    assert!((0.8..1.3).contains(&mean), "{}: {mean}", preset.name());
}

#[test]
fn one_line() {
    assert_honest(Preset::Quick);
}

#[test]
fn two_lines_share_their_frames_noise() {
    assert_honest(Preset::TwoLines);
}

#[test]
fn little_tilt() {
    assert_honest(Preset::Weak);
}

#[test]
fn profiler() {
    assert_honest(Preset::Profiler);
}
