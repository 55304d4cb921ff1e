//! Every threshold of the verdict, in one place.

/// Residuals this much larger than expected are not noise: something is wrong with the data or the frames.
pub(super) const NOISE_FACTOR: f64 = 3.0;
/// Beyond this no edge, however bad, explains them, even if they look like noise: real welds reach some ten.
pub(super) const MOST_NOISE_FACTOR: f64 = 20.0;
/// Outside of these the noise differs from the expected noise, which the user should know.
pub(super) const USUAL_NOISE_FACTOR: [f64; 2] = [0.4, 1.2];
/// A result that can use fewer of the features than this is of another scan …
pub(super) const LEAST_USED: f64 = 0.5;
/// … and so is one that leaves out more than a fifth and has residuals this much larger than expected.
pub(super) const LEAST_USED_BADLY: (f64, f64) = (0.8, 1.5);
/// More features left out than one in this many are worth a warning.
pub(super) const MANY_SKIPPED: usize = 10;
/// With more of the robot's samples missing than this, what it did between the others is not known well enough to go unsaid.
pub(super) const MANY_MISSING: f64 = 0.1;
/// With a larger share of repeated robot stamps the stamps are too coarse.
pub(super) const COARSE_STAMPS: f64 = 0.1;
/// With more outliers than this the majority no longer decides.
pub(super) const OUTLIERS: f64 = 0.5;
/// With more than this left out of an adjustment, the rest may agree by chance.
pub(super) const MOST_LEFT_OUT: f64 = 0.35;
/// With more readings than this off a curve it may be another's: wrong curves reach 46 % of them.
pub(super) const MOST_OFF_CURVE: f64 = 0.4;
/// More outliers than this should be looked at.
pub(super) const MANY_OUTLIERS: f64 = 0.2;
/// Of five parts and seven unknowns the largest reaches 3 σ by chance.
pub(super) const CROSS_VALIDATION_SIGMAS: f64 = 5.0;
/// Predicting a part from the others costs some percent with a few hundred features; more is disagreement.
pub(super) const CROSS_VALIDATION_RATIO: f64 = 1.1;
/// A dozen unknowns make the error of prediction: chance does not make its square four times what is expected.
pub(super) const CROSS_VALIDATION_SURPLUS: f64 = 4.0;
/// A seam point that the scan alone leaves less well known than this is not what a user expects, m.
pub(super) const POORLY_KNOWN_M: f64 = 0.5e-3;
/// … nor is one that is known worse than this with the robot, the sensor and the bias that are assumed.
pub(super) const USELESS_M: f64 = 2e-3;
/// A seam that waves by more than this is worth a remark, m: what a welder sees.
pub(super) const WAVY_M: f64 = 0.05e-3;
/// … and so is an arm that is further off its poses than this along a scan, m.
pub(super) const ROBOT_MOVES_M: f64 = 0.1e-3;
