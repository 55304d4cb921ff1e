//! Covariance of the estimates that means what it says.
//!
//! Were every residual independent and of the expected size, H⁻¹ would do. They are not: all features of
//! a frame share the robot's error and the stamp's jitter, and neighbouring frames may be alike. So the
//! scores (gradients) are summed frame by frame and their covariance, with neighbours up to a lag, takes
//! the place of the expected one (cluster and autocorrelation consistent, \[Newey1987\]). That estimate is
//! noisy, so it is drawn towards the expected one as far as its own noise demands \[Ledoit2004\]: where the
//! data agree with the model the result is the model's.

use crate::parameters::Parameters;
use crate::problem::{LOCAL, LineProblem, global_index};
use nalgebra::{DMatrix, DVector, SVector};
use trueline_lsq::Information;

/// A covariance and how it came about.
#[derive(Clone, Debug)]
pub struct Uncertainty {
    /// Covariance of the tangent, SI units; rows of unseen directions hold only what is seen.
    pub covariance: DMatrix<f64>,
    /// Variance of the whitened residuals about 1, corrected for the robust loss.
    pub variance_factor: f64,
    /// Part of the covariance that is the model's, 0 to 1; the rest is the data's own.
    pub model_share: f64,
}

/// Sums over all observations that the robust covariance needs.
#[derive(Default)]
struct Moments {
    count: f64,
    weight: f64,
    weight_and_slope: f64,
    score: f64,
}

/// Covariance at the solution.
#[must_use]
pub fn assess(problem: &LineProblem<'_>, at: &Parameters, information: &Information) -> Uncertainty {
    let root = information.covariance_root();
    let (scores, moments) = frame_scores(problem, at, &root);
    // An M-estimator's covariance is H⁻¹ times E[w²s/2] E[w] / E[w + s w′]² [Huber2009, ch. 7].
    let unknowns = information.rank() as f64;
    let freedom = (2.0 * moments.count / (2.0 * moments.count - unknowns)).max(1.0);
    let bend = moments.weight_and_slope / moments.weight;
    let per_weight = moments.score / moments.weight * freedom;
    let variance_factor = per_weight / (bend * bend);
    let (middle, model_share) = blend(&scores, per_weight, root.ncols());
    Uncertainty {
        covariance: &root * middle * root.transpose() * variance_factor,
        variance_factor,
        model_share,
    }
}

/// Score of each frame in the root's coordinates, where the model expects the unit matrix.
fn frame_scores(
    problem: &LineProblem<'_>,
    at: &Parameters,
    root: &DMatrix<f64>,
) -> (Vec<DVector<f64>>, Moments) {
    let mut scores: Vec<DVector<f64>> = Vec::new();
    let mut moments = Moments::default();
    let mut last_stamp = f64::NAN;
    let mut hint = 0;
    for pair in &problem.selected {
        let Some((residual, jacobian)) = problem.whitened(pair, at, &mut hint) else {
            continue;
        };
        let squared = residual.norm_squared();
        let weight = problem.loss.weight(squared);
        moments.count += f64::from(weight > 0.0);
        moments.weight += weight;
        moments.weight_and_slope += weight + squared * problem.loss.weight_slope(squared);
        moments.score += 0.5 * weight * weight * squared;
        let gradient: SVector<f64, LOCAL> = jacobian.transpose() * residual * weight;
        if pair.0.stamp_s != last_stamp {
            scores.push(DVector::zeros(root.ncols()));
            last_stamp = pair.0.stamp_s;
        }
        if let Some(score) = scores.last_mut() {
            for (local, g) in gradient.iter().enumerate() {
                let row = global_index(local, pair.0.line as usize);
                score.axpy(*g, &root.row(row).transpose(), 1.0);
            }
        }
    }
    (scores, moments)
}

/// The data's own covariance of the scores, drawn towards the unit matrix; and how far.
fn blend(scores: &[DVector<f64>], per_weight: f64, size: usize) -> (DMatrix<f64>, f64) {
    let unit = DMatrix::identity(size, size);
    if scores.len() < 30 || per_weight <= 0.0 {
        return (unit, 1.0);
    }
    let lags = lag_limit(scores);
    let mut own = DMatrix::zeros(size, size);
    let mut kernel_square_sum = 0.0;
    for lag in 0..=lags {
        let kernel = 1.0 - lag as f64 / (lags as f64 + 1.0);
        let mut product = DMatrix::zeros(size, size);
        for (earlier, later) in scores.iter().zip(&scores[lag..]) {
            product.ger(1.0, earlier, later, 1.0);
        }
        let sides = if lag == 0 { 1.0 } else { 2.0 };
        kernel_square_sum += sides * kernel * kernel;
        own += (&product + product.transpose()) * (0.5 * sides * kernel / per_weight);
    }
    let noise =
        kernel_square_sum * scores.iter().map(|s| (s.norm_squared() / per_weight).powi(2)).sum::<f64>();
    let distance = (&own - &unit).norm_squared();
    let share = if distance > 0.0 { (noise / distance).min(1.0) } else { 1.0 };
    (own * (1.0 - share) + unit * share, share)
}

/// How many neighbouring frames are alike: the bandwidth of the Bartlett kernel that is best for a
/// first-order process with the scores' own correlation \[Andrews1991, Eq. 6.2\].
fn lag_limit(scores: &[DVector<f64>]) -> usize {
    let product: f64 = scores.windows(2).map(|w| w[0].dot(&w[1])).sum();
    let power: f64 = scores.iter().map(DVector::norm_squared).sum();
    let rho = (product / power).clamp(-0.97, 0.97);
    let alpha = 4.0 * rho * rho / (1.0 - rho * rho).powi(2);
    let bandwidth = 1.1447 * (alpha * scores.len() as f64).cbrt();
    (bandwidth.floor() as usize).min(scores.len() / 10)
}
