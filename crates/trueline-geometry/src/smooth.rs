//! Noise of recorded poses, and a local fit that smooths it.
//!
//! A robot's motion is smooth over tens of milliseconds, its feedback is not. Interpolation between two noisy
//! samples gives a velocity that is mostly noise. The time offset then seems more certain than it is. A local
//! quadratic over a short window \[Savitzky1964\] keeps position, velocity and acceleration of the motion and
//! averages the noise.

use crate::curve::lagrange_weights;
use crate::local_polynomial::{self, weights_at_zero, weights_into};
use crate::statistics::median;
use crate::{Pose, se3, so3};
use nalgebra::Vector3;

/// Half the window of an unknown motion, s: 20 ms keeps a motion of 5 Hz to 0.05 % of its amplitude.
pub const HALF_WINDOW_S: f64 = 0.020;
/// Fewest samples on either side: with fewer a sample stays unchanged.
const MIN_SIDE: usize = 2;
/// Ratio of each trial window to the one before.
const WIDER: f64 = 1.2;
/// A window may bend the motion by this part of the noise (root mean square): far below the noise that it removes.
const BENT: f64 = 0.02;
/// A window twice as wide bends a motion 16 times as much, because the error of a local quadratic begins with the fourth
/// derivative.
const BENT_BY_TWICE: f64 = 16.0;
/// A point of the tool that relates rotations to shifts, m along each axis.
const TIP_M: f64 = 0.12;
/// Number of samples on which a window is tried.
const TRIED: usize = 1500;

/// Neighbours on each side that predict a sample.
const PREDICTORS: usize = 4;

/// Standard deviation of the positions per axis (m) about a smooth motion. Each sample's distance from the
/// polynomial through its four neighbours on either side is divided by its value for samples with noise 1;
/// the median counts.
///
/// For even spacing these are the eighth differences: a swing of 1 Hz and 50 mm sampled at 20 Hz contributes 1 µm of noise. Samples are placed at
/// whole periods. Lost samples are skipped. Jitter of the stamps is measured elsewhere and is not position noise. Zero with fewer than twelve
/// values.
#[must_use]
pub fn position_noise(times: &[f64], poses: &[Pose], period: f64, gap_limit: f64) -> f64 {
    let mut errors: Vec<f64> = Vec::with_capacity(3 * poses.len());
    let width = 2 * PREDICTORS + 1;
    let mut prediction = Prediction::at([f64::NAN; 2 * PREDICTORS + 1]);
    for (t, p) in times.windows(width).zip(poses.windows(width)) {
        let joined = t.windows(2).all(|pair| pair[1] > pair[0] && pair[1] - pair[0] <= gap_limit);
        // A robot at rest may report the very same numbers. They contain no information about those in motion.
        let moves = p.windows(2).all(|pair| pair[0].translation != pair[1].translation);
        if joined && moves {
            let mut periods = [0.0; 2 * PREDICTORS + 1];
            for k in 1..width {
                periods[k] = periods[k - 1] + ((t[k] - t[k - 1]) / period).round().max(1.0);
            }
            if periods != prediction.times {
                prediction = Prediction::at(periods);
            }
            errors.extend(prediction.error(p).iter());
        }
    }
    if errors.len() < 12 {
        return 0.0;
    }
    // The median of |N(0, 1)| is 0.67449.
    median(errors.into_iter()).unwrap_or(0.0) / 0.674_49
}

/// The same for the attitudes, rad per axis, by their logarithms from the one in the middle of the recording.
/// Within half a radian of it these turn as the attitude does, to a tenth.
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

/// Prediction of the middle one of some samples from the others.
struct Prediction {
    times: [f64; 2 * PREDICTORS + 1],
    weights: [f64; 2 * PREDICTORS],
    /// Standard deviation of measured − predicted for samples with noise 1.
    gain: f64,
}

impl Prediction {
    /// For samples at these times.
    fn at(times: [f64; 2 * PREDICTORS + 1]) -> Self {
        let mut nodes = [0.0; 2 * PREDICTORS];
        nodes[..PREDICTORS].copy_from_slice(&times[..PREDICTORS]);
        nodes[PREDICTORS..].copy_from_slice(&times[PREDICTORS + 1..]);
        let mut weights = [0.0; 2 * PREDICTORS];
        lagrange_weights(&nodes, times[PREDICTORS], &mut weights);
        let gain = (1.0 + weights.iter().map(|w| w * w).sum::<f64>()).sqrt();
        Self { times, weights, gain }
    }

    /// |measured − predicted| of the middle sample, per axis, divided by its standard deviation for noise 1.
    fn error(&self, poses: &[Pose]) -> Vector3<f64> {
        let middle = poses[PREDICTORS].translation.vector;
        let others = poses[..PREDICTORS].iter().chain(&poses[PREDICTORS + 1..]);
        let predicted: Vector3<f64> =
            others.zip(self.weights).map(|(pose, weight)| (pose.translation.vector - middle) * weight).sum();
        predicted.abs() / self.gain
    }
}

/// Fraction of a sample's noise after [`local_quadratic`], for evenly spaced samples: √(3(3m² + 3m − 1) / ((2m − 1)(2m + 1)(2m + 3))) with m
/// neighbours on each side \[Savitzky1964\].
#[must_use]
pub fn noise_left(period_s: f64, half_window_s: f64) -> f64 {
    let m = (half_window_s / period_s * (1.0 + 1e-9)).floor();
    if m < MIN_SIDE as f64 { 1.0 } else { variance_left(m as usize).sqrt() }
}

/// The square of it, with this many neighbours on either side.
fn variance_left(side: usize) -> f64 {
    let m = side as f64;
    3.0 * (3.0 * m * m + 3.0 * m - 1.0) / ((2.0 * m - 1.0) * (2.0 * m + 1.0) * (2.0 * m + 3.0))
}

/// Half the widest window, s, from [`HALF_WINDOW_S`] to `most_s`, that leaves the motion unchanged. Its
/// effect follows from the difference to a window twice as wide, less the part of noise.
#[must_use]
pub fn half_window_s(times: &[f64], poses: &[Pose], gap_limit: f64, noise_m: f64, most_s: f64) -> f64 {
    let tip = |pose: &Pose| pose * nalgebra::Point3::new(TIP_M, TIP_M, TIP_M);
    let tips: Vec<Vector3<f64>> = poses.iter().map(|pose| tip(pose).coords).collect();
    let every = poses.len().div_ceil(TRIED).max(1);
    let mut half_s = HALF_WINDOW_S;
    while half_s * WIDER <= most_s {
        let (narrow_s, wide_s) = (half_s * WIDER, 2.0 * half_s * WIDER);
        let tried = (0..poses.len()).step_by(every).filter_map(|k| {
            let sides = [side(times, k, gap_limit, narrow_s), side(times, k, gap_limit, wide_s)];
            // At the ends and beside gaps there is no room for the wide one.
            if sides[1] < 2 * sides[0] || sides[0] < MIN_SIDE {
                return None;
            }
            let [near, far] = sides.map(|side| value_at(times, &tips, k, side));
            let by_noise = sides.map(variance_left);
            Some(((near? - far?).norm_squared() / 3.0, by_noise[0] - by_noise[1]))
        });
        let (squares, by_noise): (Vec<f64>, Vec<f64>) = tried.unzip();
        let count = squares.len() as f64;
        let bent =
            squares.iter().sum::<f64>() / count - by_noise.iter().sum::<f64>() / count * noise_m.powi(2);
        // Without data for the test the window is not widened.
        if squares.is_empty() || bent.max(0.0).sqrt() > BENT * noise_m * (BENT_BY_TWICE - 1.0) {
            break;
        }
        half_s *= WIDER;
    }
    half_s
}

/// Replaces each pose by the value there of a quadratic fitted to its neighbours within `half_window_s`, never across a gap.
/// Poses with too few neighbours stay unchanged.
#[must_use]
pub fn local_quadratic(times: &[f64], poses: &[Pose], gap_limit: f64, half_window_s: f64) -> Vec<Pose> {
    let mut weights = Weights::default();
    (0..poses.len()).map(|k| smoothed(times, poses, k, [gap_limit, half_window_s], &mut weights)).collect()
}

/// Weights of the samples of a window in the value of their quadratic at its middle.
#[derive(Default)]
struct Weights {
    /// Times of the window from its middle, s.
    elapsed_s: Vec<f64>,
    by_sample: Vec<f64>,
}

/// Times that differ by less than this fraction of the window share their weights. The error is 1e-8 of values that differ by millimetres.
const SAME_TIMES: f64 = 1e-9;

impl Weights {
    /// For the window at these times about sample `k`, those of the window before if its times are the same;
    /// `None` if they do not determine a quadratic.
    fn at(&mut self, window: &[f64], middle_s: f64) -> Option<&[f64]> {
        let span_s = (window[0] - middle_s).abs().max((window[window.len() - 1] - middle_s).abs());
        let is_same = |(time, elapsed): (&f64, &f64)| (time - middle_s - elapsed).abs() < SAME_TIMES * span_s;
        if self.elapsed_s.len() != window.len() || !window.iter().zip(&self.elapsed_s).all(is_same) {
            let elapsed_s: Vec<f64> = window.iter().map(|time| time - middle_s).collect();
            self.by_sample = weights_at_zero::<3>(&elapsed_s, span_s)?;
            self.elapsed_s = elapsed_s;
        }
        Some(&self.by_sample)
    }
}

/// Neighbours to either side of a sample within half a window and before a gap. Both sides have equally many, so a cubic
/// motion is kept too.
fn side(times: &[f64], k: usize, gap_limit: f64, half_window_s: f64) -> usize {
    let reaches = |from: usize, to: usize| {
        (times[to] - times[from]).abs() <= gap_limit
            && (times[to] - times[k]).abs() <= half_window_s * (1.0 + 1e-9)
    };
    let mut side = 0;
    while side < k
        && k + side + 1 < times.len()
        && reaches(k - side, k - side - 1)
        && reaches(k + side, k + side + 1)
    {
        side += 1;
    }
    side
}

/// Value at a sample of the quadratic through this many neighbours on either side, less the sample itself.
fn value_at(times: &[f64], values: &[Vector3<f64>], k: usize, side: usize) -> Option<Vector3<f64>> {
    let window = k - side..=k + side;
    let elapsed_s: Vec<f64> = times[window.clone()].iter().map(|time| time - times[k]).collect();
    let span_s = elapsed_s[0].abs().max(elapsed_s[2 * side].abs());
    let weights = weights_at_zero::<3>(&elapsed_s, span_s)?;
    Some(values[window].iter().zip(weights).map(|(value, weight)| (value - values[k]) * weight).sum())
}

/// [`local_quadratic`] of one pose, from the longest step that it bridges and half its window, s.
fn smoothed(
    times: &[f64],
    poses: &[Pose],
    k: usize,
    [gap_limit, half_window_s]: [f64; 2],
    weights: &mut Weights,
) -> Pose {
    let side = side(times, k, gap_limit, half_window_s);
    if side < MIN_SIDE {
        return poses[k];
    }
    let window = k - side..=k + side;
    let Some(weights) = weights.at(&times[window.clone()], times[k]) else { return poses[k] };
    let inverse = poses[k].rotation.inverse();
    let (mut shift, mut turn) = (Vector3::zeros(), Vector3::zeros());
    for (pose, weight) in poses[window].iter().zip(weights) {
        shift += (pose.translation.vector - poses[k].translation.vector) * *weight;
        turn += so3::log(&(inverse * pose.rotation)) * *weight;
    }
    se3::from_parts(poses[k].rotation * so3::exp(&turn), poses[k].translation.vector + shift)
}

/// Maximum neighbours on each side in [`smoothed_sample`].
pub const MOST_SIDE: usize = 63;

/// One pose of [`local_quadratic`], without memory allocation, for continuing streams.
#[derive(Clone, Copy, Debug)]
pub struct SmoothedSample {
    /// The value of the quadratic there, or the sample itself if it has too few neighbours.
    pub pose: Pose,
    /// Remaining fraction of a sample's variance.
    pub variance_left: f64,
}

/// The result of [`local_quadratic`] for sample `k`, to rounding. Windows of more than [`MOST_SIDE`]
/// neighbours to a side are cut there.
#[must_use]
pub fn smoothed_sample(
    times: &[f64],
    poses: &[Pose],
    k: usize,
    gap_limit: f64,
    half_window_s: f64,
) -> SmoothedSample {
    let raw = SmoothedSample { pose: poses[k], variance_left: 1.0 };
    let side = side(times, k, gap_limit, half_window_s).min(MOST_SIDE);
    if side < MIN_SIDE {
        return raw;
    }
    let (mut elapsed_s, mut weights) = ([0.0; 2 * MOST_SIDE + 1], [0.0; 2 * MOST_SIDE + 1]);
    let (count, window) = (2 * side + 1, k - side..=k + side);
    for (elapsed, time) in elapsed_s.iter_mut().zip(&times[window.clone()]) {
        *elapsed = time - times[k];
    }
    let span_s = elapsed_s[0].abs().max(elapsed_s[count - 1].abs());
    if weights_into::<3>(&elapsed_s[..count], span_s, &local_polynomial::value_at(0.0), &mut weights)
        .is_none()
    {
        return raw;
    }
    let inverse = poses[k].rotation.inverse();
    let (mut shift, mut turn) = (Vector3::zeros(), Vector3::zeros());
    for (pose, weight) in poses[window].iter().zip(&weights) {
        shift += (pose.translation.vector - poses[k].translation.vector) * *weight;
        turn += so3::log(&(inverse * pose.rotation)) * *weight;
    }
    SmoothedSample {
        pose: se3::from_parts(poses[k].rotation * so3::exp(&turn), poses[k].translation.vector + shift),
        variance_left: weights[..count].iter().map(|weight| weight * weight).sum(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sample_alone_is_smoothed_as_all_together() {
        let times: Vec<f64> = (0..60).map(|k| 0.004 * f64::from(k) + 1e-4 * f64::from(k % 3)).collect();
        let pose = |t: &f64| {
            se3::exp(&(Vector3::new(0.3, 0.1, -0.2) * (9.0 * t).sin()), &Vector3::new(*t, t * t, 0.1))
        };
        let poses: Vec<Pose> = times.iter().map(pose).collect();
        let all = local_quadratic(&times, &poses, 0.016, HALF_WINDOW_S);
        for (k, of_all) in all.iter().enumerate() {
            let alone = smoothed_sample(&times, &poses, k, 0.016, HALF_WINDOW_S);
            // The weights of a window are reused within SAME_TIMES, which is 1e-9 of values of 0.1.
            assert!((alone.pose.translation.vector - of_all.translation.vector).norm() < 1e-10);
            assert!(alone.pose.rotation.angle_to(&of_all.rotation) < 1e-7);
            assert!(alone.variance_left <= 1.0);
        }
        // Five to either side: 3(3·25 + 15 − 1)/(9·11·13) = 0.2075, up to the jitter of the times.
        let middle = smoothed_sample(&times, &poses, 30, 0.016, HALF_WINDOW_S).variance_left;
        assert!(
            (middle - variance_left(5)).abs() < 0.01 || (middle - variance_left(4)).abs() < 0.01,
            "{middle}"
        );
    }
}
