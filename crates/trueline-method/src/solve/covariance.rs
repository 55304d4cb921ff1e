//! Calibrated covariance of the estimates.
//!
//! H⁻¹ holds for independent residuals of the expected size. But all features of a frame share the robot's error and the stamp's jitter, and
//! neighbouring frames may be correlated. The scores (gradients) are therefore summed frame by frame. Their covariance, with neighbours up to a lag,
//! replaces the expected one (cluster and autocorrelation consistent, \[Newey1987\]). That estimate is noisy and is shrunk towards the expected one
//! according to its own noise \[Ledoit2004\]. If the data agree with the model, the result is the model's. The model includes the common errors of
//! the features of a frame: the robot's position error and the stamp's.

use crate::input::noise_levels::NoiseLevels;
use crate::problem::layout::Layout;
use crate::problem::line_problem::LineProblem;
use crate::problem::parameters::Parameters;
use crate::problem::row_products::RowProducts;
use crate::problem::row_table::RowTable;
use crate::problem::simd::WhitenedRow;
use crate::problem::unknowns::{LOCAL_ALL, Unknowns};
use nalgebra::{DMatrix, DVector, SMatrix, SVector};
use std::collections::BTreeMap;
use trueline_lsq::Information;

/// A covariance and its origin.
#[derive(Clone, Debug)]
pub struct Uncertainty {
    /// Covariance of the tangent, SI units. Unobservable directions are left out.
    pub covariance: DMatrix<f64>,
    /// Variance of the whitened residuals about 1, corrected for the robust loss.
    pub variance_factor: f64,
    /// Share of the model in the covariance, 0 to 1. The rest comes from the data.
    pub model_share: f64,
}

/// Sums over all observations for the robust covariance.
#[derive(Default)]
struct Moments {
    count: f64,
    weight: f64,
    weight_and_slope: f64,
    score: f64,
}

/// The scores of all frames in the root's coordinates, and their expected covariance.
struct Scores {
    frames: RowTable,
    /// Expected covariance of their sum. It is the identity if every frame has one feature and there is no prior.
    expected: DMatrix<f64>,
    /// The prior's part of the information, in the same coordinates.
    known: DMatrix<f64>,
    moments: Moments,
}

/// Covariance at the solution, for the noise that whitened the problem.
#[must_use]
pub fn assess(
    problem: &LineProblem<'_>,
    at: &Parameters,
    noise: &NoiseLevels,
    information: &Information,
) -> Uncertainty {
    let root = information.covariance_root();
    let scores = frame_scores(problem, at, noise, root);
    let moments = &scores.moments;
    // An M-estimator's covariance is H⁻¹ times E[w²s/2] E[w] / E[w + s w′]² [Huber2009, ch. 7].
    let unknowns = information.rank() as f64;
    let freedom = (2.0 * moments.count / (2.0 * moments.count - unknowns)).max(1.0);
    let bend = moments.weight_and_slope / moments.weight;
    let per_weight = moments.score / moments.weight * freedom;
    let variance_factor = per_weight / (bend * bend);
    let (middle, model_share) = blend(&scores.frames, &scores.expected, per_weight);
    // The measured level is that of the residuals. The prior keeps its own.
    let middle = middle * variance_factor + &scores.known;
    Uncertainty { covariance: root * middle * root.transpose(), variance_factor, model_share }
}

/// Sums the scores frame by frame.
fn frame_scores(
    problem: &LineProblem<'_>,
    at: &Parameters,
    noise: &NoiseLevels,
    root: &DMatrix<f64>,
) -> Scores {
    let mut frames = RowTable::new(root.nrows());
    let mut moments = Moments::default();
    let mut shared = SharedErrors::default();
    let mut last_stamp = f64::NAN;
    problem.for_each_whitened(at, |index, WhitenedRow { residual, jacobian }| {
        let o = &problem.list[index];
        let squared = residual.norm_squared();
        let weight = problem.loss.weight(squared);
        moments.count += f64::from(weight > 0.0);
        moments.weight += weight;
        moments.weight_and_slope += weight + squared * problem.loss.weight_slope(squared);
        moments.score += 0.5 * weight * weight * squared;
        if o.stamp_s != last_stamp {
            frames.push();
            shared.close_frame();
            last_stamp = o.stamp_s;
        }
        let gradient: SVector<f64, LOCAL_ALL> = jacobian.tr_mul(residual) * weight;
        problem.unknowns.add(o.line as usize, gradient.as_slice(), frames.last());
        if problem.observations.line_count > 1
            && let Some(errors) = problem.shared_errors(jacobian, noise)
        {
            shared.open.push((o.line, jacobian.tr_mul(&errors) * weight.sqrt()));
        }
    });
    let size = root.ncols();
    let known = at.known(problem.shape_prior.as_ref()).information(root.nrows());
    let known = root.transpose() * known * root;
    let together = root.transpose() * shared.sums(&problem.unknowns) * root;
    let expected = DMatrix::identity(size, size) - &known + together;
    Scores { frames: frames.in_root(root), expected, known, moments }
}

/// Columns by the local unknowns of an observation for the four errors shared by the features of a frame.
type ErrorColumns = SMatrix<f64, LOCAL_ALL, 4>;

/// Shared errors of the features of each frame: the products between different features.
#[derive(Default)]
struct SharedErrors {
    /// The columns of the features of the open frame, with their lines.
    open: Vec<(u32, ErrorColumns)>,
    /// Sums of the products of the columns of two lines.
    products: BTreeMap<(u32, u32), SMatrix<f64, LOCAL_ALL, LOCAL_ALL>>,
}

impl SharedErrors {
    /// Adds the products between different features of the frame, and begins another.
    fn close_frame(&mut self) {
        for (k, (line, columns)) in self.open.iter().enumerate() {
            for (other_line, other) in &self.open[..k] {
                let sum = self.products.entry((*line, *other_line)).or_insert_with(SMatrix::zeros);
                sum.gemm(1.0, columns, &other.transpose(), 1.0);
            }
        }
        self.open.clear();
    }

    /// The products of shared errors, over all frames and unknowns.
    fn sums(mut self, unknowns: &Unknowns) -> DMatrix<f64> {
        self.close_frame();
        let mut all = DMatrix::zeros(unknowns.dimension(), unknowns.dimension());
        for ((line, other), products) in &self.products {
            for row in 0..unknowns.local() {
                for column in 0..unknowns.local() {
                    let places =
                        (unknowns.place(row, *line as usize), unknowns.place(column, *other as usize));
                    all[places] += products[(row, column)];
                    all[(places.1, places.0)] += products[(row, column)];
                }
            }
        }
        all
    }
}

/// The data's own covariance of the scores, shrunk towards the expected one, with the share of the latter.
///
/// Products of frames up to L apart have the Bartlett weights 1 − lag/(L + 1). They equal the products of running sums of L + 1 frames, divided by L
/// + 1, because the convolution of a box with itself is a triangle.
pub(crate) fn blend(frames: &RowTable, expected: &DMatrix<f64>, per_weight: f64) -> (DMatrix<f64>, f64) {
    if frames.len() < 30 || per_weight <= 0.0 {
        return (expected.clone(), 1.0);
    }
    let box_frames = lag_limit(frames) + 1;
    let mut products = RowProducts::new(frames.width());
    let mut running = DVector::zeros(frames.width());
    for end in 0..frames.len() + box_frames - 1 {
        if end < frames.len() {
            running += frames.of(end);
        }
        products.next_row().copy_from_slice(running.as_slice());
        if end + 1 >= box_frames {
            running -= frames.of(end + 1 - box_frames);
        }
    }
    let length = box_frames as f64;
    let own = products.sums() / (length * per_weight);
    // Σ (1 − |lag|/(L + 1))² over all lags.
    let kernel_square_sum = (2.0 * length * length + 1.0) / (3.0 * length);
    let noise =
        kernel_square_sum * frames.iter().map(|s| (s.norm_squared() / per_weight).powi(2)).sum::<f64>();
    let distance = (&own - expected).norm_squared();
    let share = if distance > 0.0 { (noise / distance).min(1.0) } else { 1.0 };
    (own * (1.0 - share) + expected * share, share)
}

/// Number of correlated neighbouring frames: the optimal bandwidth of the Bartlett kernel for a first-order process with the scores' own correlation
/// \[Andrews1991, Eq. 6.2\].
fn lag_limit(scores: &RowTable) -> usize {
    let product: f64 = scores.iter().zip(scores.iter().skip(1)).map(|(one, next)| one.dot(&next)).sum();
    let power: f64 = scores.iter().map(|score| score.norm_squared()).sum();
    let rho = (product / power).clamp(-0.97, 0.97);
    let alpha = 4.0 * rho * rho / (1.0 - rho * rho).powi(2);
    let bandwidth = 1.1447 * (alpha * scores.len() as f64).cbrt();
    (bandwidth.floor() as usize).min(scores.len() / 10)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the kernel's weights and the products of frames at each lag.
    #[test]
    fn running_sums_weigh_neighbours_by_the_kernel() {
        let mut frames = RowTable::new(2);
        // Correlated over some frames, so that there are lags.
        let value = |k: usize| [(k as f64 * 0.4).sin() + (k as f64 * 7.1).cos(), (k as f64 * 0.3).cos()];
        for k in 0..90 {
            frames.push().copy_from_slice(&value(k));
        }
        let lags = lag_limit(&frames);
        assert!(lags > 3, "{lags}");
        let mut own = DMatrix::zeros(2, 2);
        let mut squares = 0.0;
        for lag in 0..=lags {
            let kernel = 1.0 - lag as f64 / (lags as f64 + 1.0);
            let sides = if lag == 0 { 1.0 } else { 2.0 };
            squares += sides * kernel * kernel;
            for k in lag..90 {
                let product = frames.of(k - lag) * frames.of(k).transpose();
                own += (&product + product.transpose()) * (0.5 * sides * kernel / 1.5);
            }
        }
        let expected = DMatrix::identity(2, 2) * 50.0;
        let noise = squares * frames.iter().map(|s| (s.norm_squared() / 1.5).powi(2)).sum::<f64>();
        let share = (noise / (&own - &expected).norm_squared()).min(1.0);
        let (blended, by) = blend(&frames, &expected, 1.5);
        // Sums of ninety products of about one.
        assert!((by - share).abs() < 1e-12 && share < 1.0, "{by} {share}");
        assert!((blended - (own * (1.0 - share) + expected * share)).amax() < 1e-10);
    }
}
