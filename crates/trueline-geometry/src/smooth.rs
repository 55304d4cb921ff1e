//! How noisy recorded poses are, and a local fit that takes the noise out.
//!
//! A robot's motion is smooth over tens of milliseconds, its feedback is not: interpolating between two
//! noisy samples gives a velocity that is mostly noise, and with it a time offset that looks better known
//! than it is. A local quadratic over a short window \[Savitzky1964\] keeps position, velocity and
//! acceleration of the motion and averages the noise.

use crate::curve::lagrange_weights;
use crate::statistics::median;
use crate::{Pose, se3, so3};
use nalgebra::{Matrix3, Vector3};

/// Half the window, s: 20 ms keeps a motion of 5 Hz to 0.05 % of its amplitude.
pub const HALF_WINDOW_S: f64 = 0.020;
/// Fewest samples to either side: slower streams stay as they are, for a longer window would bend the motion.
const MIN_SIDE: usize = 2;

/// Neighbours to either side from which a sample is predicted.
const PREDICTORS: usize = 4;

/// Standard deviation of the positions per axis (m) about a smooth motion: how far each sample is off the polynomial
/// through its four neighbours to either side, in units of what that is for samples with noise 1; the median of it.
///
/// For even spacing these are the eighth differences: a swing of 1 Hz and 50 mm sampled at 20 Hz passes for 1 µm of
/// noise. Samples count as whole periods apart: lost ones are missed, but jitter of the stamps, which is measured
/// elsewhere, is no noise of the positions. Zero if fewer than twelve numbers can be had.
#[must_use]
pub fn position_noise(times: &[f64], poses: &[Pose], period: f64, gap_limit: f64) -> f64 {
    let mut errors: Vec<f64> = Vec::with_capacity(3 * poses.len());
    let width = 2 * PREDICTORS + 1;
    for (t, p) in times.windows(width).zip(poses.windows(width)) {
        let joined = t.windows(2).all(|pair| pair[1] > pair[0] && pair[1] - pair[0] <= gap_limit);
        // A robot at rest may report the very same numbers; that says nothing about those in motion.
        let moves = p.windows(2).all(|pair| pair[0].translation != pair[1].translation);
        if joined && moves {
            let mut periods = [0.0; 2 * PREDICTORS + 1];
            for k in 1..width {
                periods[k] = periods[k - 1] + ((t[k] - t[k - 1]) / period).round().max(1.0);
            }
            errors.extend(prediction_error(&periods, p).iter());
        }
    }
    if errors.len() < 12 {
        return 0.0;
    }
    // The median of |N(0, 1)| is 0.67449.
    median(errors.into_iter()).unwrap_or(0.0) / 0.674_49
}

/// The same of the attitudes, rad per axis, by their logarithms from the one in the middle of the recording: within half a radian
/// of it these turn as the attitude does, to a tenth.
#[must_use]
pub fn rotation_noise(times: &[f64], poses: &[Pose], period: f64, gap_limit: f64) -> f64 {
    let Some(middle) = poses.get(poses.len() / 2) else { return 0.0 };
    let turned = |pose: &Pose| {
        let turn = so3::log(&(middle.rotation.inverse() * pose.rotation));
        se3::from_parts(nalgebra::UnitQuaternion::identity(), turn)
    };
    let turns: Vec<Pose> = poses.iter().map(turned).collect();
    position_noise(times, &turns, period, gap_limit)
}

/// |measured − predicted| of the middle sample, per axis, over the standard deviation that noise 1 gives it.
fn prediction_error(times: &[f64], poses: &[Pose]) -> Vector3<f64> {
    let mut nodes = [0.0; 2 * PREDICTORS];
    nodes[..PREDICTORS].copy_from_slice(&times[..PREDICTORS]);
    nodes[PREDICTORS..].copy_from_slice(&times[PREDICTORS + 1..]);
    let mut weights = [0.0; 2 * PREDICTORS];
    lagrange_weights(&nodes, times[PREDICTORS], &mut weights);
    let middle = poses[PREDICTORS].translation.vector;
    let others = poses[..PREDICTORS].iter().chain(&poses[PREDICTORS + 1..]);
    let predicted: Vector3<f64> =
        others.zip(weights).map(|(pose, weight)| (pose.translation.vector - middle) * weight).sum();
    let gain = (1.0 + weights.iter().map(|w| w * w).sum::<f64>()).sqrt();
    predicted.abs() / gain
}

/// Part of a sample's noise that [`local_quadratic`] leaves, for evenly spaced samples:
/// √(3(3m² + 3m − 1) / ((2m − 1)(2m + 1)(2m + 3))) with m neighbours to either side \[Savitzky1964\].
#[must_use]
pub fn noise_left(period_s: f64) -> f64 {
    let m = (HALF_WINDOW_S / period_s * (1.0 + 1e-9)).floor();
    if m < MIN_SIDE as f64 {
        return 1.0;
    }
    (3.0 * (3.0 * m * m + 3.0 * m - 1.0) / ((2.0 * m - 1.0) * (2.0 * m + 1.0) * (2.0 * m + 3.0))).sqrt()
}

/// Replaces each pose by the value there of a quadratic fitted to its neighbours within
/// [`HALF_WINDOW_S`], never across a gap. Poses with too few neighbours stay as they are.
#[must_use]
pub fn local_quadratic(times: &[f64], poses: &[Pose], gap_limit: f64) -> Vec<Pose> {
    (0..poses.len()).map(|k| smoothed(times, poses, k, gap_limit)).collect()
}

/// [`local_quadratic`] of one pose.
#[must_use]
pub fn smoothed(times: &[f64], poses: &[Pose], k: usize, gap_limit: f64) -> Pose {
    let reaches = |from: usize, to: usize| {
        (times[to] - times[from]).abs() <= gap_limit
            && (times[to] - times[k]).abs() <= HALF_WINDOW_S * (1.0 + 1e-9)
    };
    let mut side = 0;
    // The same number of neighbours on both sides, so that a cubic motion is kept too.
    while side < k
        && k + side + 1 < poses.len()
        && reaches(k - side, k - side - 1)
        && reaches(k + side, k + side + 1)
    {
        side += 1;
    }
    if side < MIN_SIDE {
        return poses[k];
    }
    let window = k - side..=k + side;
    let shift = constant_of_quadratic(
        window
            .clone()
            .map(|i| (times[i] - times[k], poses[i].translation.vector - poses[k].translation.vector)),
    );
    let inverse = poses[k].rotation.inverse();
    let turn = constant_of_quadratic(
        window.map(|i| (times[i] - times[k], so3::log(&(inverse * poses[i].rotation)))),
    );
    match (shift, turn) {
        (Some(shift), Some(turn)) => {
            se3::from_parts(poses[k].rotation * so3::exp(&turn), poses[k].translation.vector + shift)
        }
        _ => poses[k],
    }
}

/// Value at time 0 of the least-squares quadratic through (time, value).
fn constant_of_quadratic(samples: impl Iterator<Item = (f64, Vector3<f64>)> + Clone) -> Option<Vector3<f64>> {
    let span = samples.clone().map(|(t, _)| t.abs()).fold(0.0, f64::max);
    let mut normal = Matrix3::zeros();
    let mut right = Matrix3::zeros();
    for (time, value) in samples {
        let t = time / span;
        let row = Vector3::new(1.0, t, t * t);
        normal += row * row.transpose();
        right += row * value.transpose();
    }
    let coefficients = normal.cholesky()?.solve(&right);
    Some(coefficients.row(0).transpose())
}
