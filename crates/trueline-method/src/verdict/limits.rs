//! Every threshold of the verdict, in one place.

/// Noise factor above which the residuals are not noise: something is wrong with the data or the frames.
pub(crate) const NOISE_FACTOR: f64 = 3.0;
/// Noise factor above which no edge explains the residuals, even if they look like noise. Real welds reach some ten.
pub(super) const MOST_NOISE_FACTOR: f64 = 20.0;
/// Noise factors outside this range differ from the expected noise enough for a warning.
pub(super) const USUAL_NOISE_FACTOR: [f64; 2] = [0.4, 1.2];
/// Least fraction of usable features. Below it the data belong to another scan …
pub(super) const LEAST_USED: f64 = 0.5;
/// … as they do with more than a fifth unused and a noise factor above this.
pub(super) const LEAST_USED_BADLY: (f64, f64) = (0.8, 1.5);
/// More unused features than one in this many give a warning.
pub(super) const MANY_SKIPPED: usize = 10;
/// Fraction of missing robot samples above which the motion between them is uncertain enough for a warning.
pub(super) const MANY_MISSING: f64 = 0.1;
/// Fraction of repeated robot stamps above which the stamps are too coarse.
pub(super) const COARSE_STAMPS: f64 = 0.1;
/// Fraction of outliers above which the inliers are no majority.
pub(super) const OUTLIERS: f64 = 0.5;
/// Fraction of readings off a curve above which it may be the wrong curve. Wrong curves reach 46 %.
pub(super) const MOST_OFF_CURVE: f64 = 0.4;
/// Fraction of outliers that gives a warning.
pub(super) const MANY_OUTLIERS: f64 = 0.2;
/// With five parts and seven unknowns the largest shift reaches 3 σ by chance.
pub(super) const CROSS_VALIDATION_SIGMAS: f64 = 5.0;
/// Prediction of a part from the others costs some percent with a few hundred features. A larger ratio is disagreement.
pub(super) const CROSS_VALIDATION_RATIO: f64 = 1.1;
/// The error of prediction depends on a dozen unknowns. Chance does not make its square four times the expected one.
pub(super) const CROSS_VALIDATION_SURPLUS: f64 = 4.0;
/// Seam error from the scan alone that gives a warning, m.
pub(super) const POORLY_KNOWN_M: f64 = 0.5e-3;
/// … and seam error with the assumed errors of robot, sensor and bias that gives a warning, m.
pub(super) const USELESS_M: f64 = 2e-3;
/// Waviness of a seam that gives a warning, m. A welder can see it.
pub(super) const WAVY_M: f64 = 0.05e-3;
/// Robot error along a scan that gives a warning, m.
pub(super) const ROBOT_MOVES_M: f64 = 0.1e-3;
