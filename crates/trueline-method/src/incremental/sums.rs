//! Normal equations of samples that are not kept.

use crate::problem::line_problem::LineProblem;
use crate::problem::parameters::{Parameters, TIME_OFFSET};
use nalgebra::{DMatrix, DVector, Matrix2, Vector2};

/// Unit of a drift: parts per million.
const PPM: f64 = 1e-6;

/// Newton's sums over samples at one state. Their last unknown is a drift of the time offset, ppm: a column (t − t₀) ∂r/∂t_d.
///
/// The Hessian is that of the robust cost, Jᵀ(ρ′ + 2ρ″ r rᵀ)J, and not the re-weighted one. A step with these sums is not repeated and must not be
/// too short.
#[derive(Clone, Debug)]
pub(super) struct Sums {
    /// Hessian of the cost.
    pub(super) hessian: DMatrix<f64>,
    /// Its gradient.
    pub(super) gradient: DVector<f64>,
    /// Number of samples added.
    pub(super) count: usize,
    /// Their weights, summed.
    pub(super) weight: f64,
}

impl Sums {
    /// Empty sums for a number of unknowns and the drift.
    pub(super) fn zeros(dimension: usize) -> Self {
        Self {
            hessian: DMatrix::zeros(dimension + 1, dimension + 1),
            gradient: DVector::zeros(dimension + 1),
            count: 0,
            weight: 0.0,
        }
    }

    /// Adds other sums at the same state.
    pub(super) fn add(&mut self, other: &Self) {
        self.hessian += &other.hessian;
        self.gradient += &other.gradient;
        self.count += other.count;
        self.weight += other.weight;
    }

    /// Moves the stamps of all added samples by a shift, and at a rate about the stamp of the drift.
    pub(super) fn move_stamps(&mut self, shift_s: f64, rate: f64) {
        let drift = self.gradient.len() - 1;
        let moved = self.hessian.column(TIME_OFFSET) * shift_s + self.hessian.column(drift) * (rate / PPM);
        // The exposure time is the stamp minus the time offset.
        self.gradient -= moved;
    }

    /// Adds all samples of a problem. The drift is zero at the stamp `about_s` of its observations.
    pub(super) fn add_problem(&mut self, problem: &LineProblem<'_>, at: &Parameters, about_s: f64) {
        let drift = self.gradient.len() - 1;
        for pair in problem.selected() {
            let Some((residual, jacobian)) = problem.whitened(pair, at) else { continue };
            let squared = residual.norm_squared();
            let weight = problem.loss.weight(squared);
            let slope = problem.loss.weight_slope(squared);
            let curvature = Matrix2::identity() * weight + residual * residual.transpose() * (2.0 * slope);
            let line = pair.0.line as usize;
            let mut columns: Vec<(usize, Vector2<f64>)> = (0..problem.unknowns.local())
                .map(|k| (problem.unknowns.place(k, line), jacobian.column(k).into_owned()))
                .collect();
            columns.push((drift, jacobian.column(TIME_OFFSET) * ((pair.0.stamp_s - about_s) * PPM)));
            for (row, one) in &columns {
                let curved = curvature * one;
                self.gradient[*row] += weight * one.dot(&residual);
                for (column, other) in &columns {
                    self.hessian[(*row, *column)] += curved.dot(other);
                }
            }
            self.count += 1;
            self.weight += weight;
        }
    }
}

/// The inverse of a Hessian over the unknowns in `free`, and zero elsewhere. `None` if it is not positive definite.
pub(super) fn inverse(hessian: &DMatrix<f64>, free: &[usize]) -> Option<DMatrix<f64>> {
    let scale: Vec<f64> = free.iter().map(|k| hessian[(*k, *k)].sqrt().recip()).collect();
    let scaled =
        DMatrix::from_fn(free.len(), free.len(), |i, j| hessian[(free[i], free[j])] * scale[i] * scale[j]);
    let inverse = scaled.cholesky()?.inverse();
    let mut all = DMatrix::zeros(hessian.nrows(), hessian.ncols());
    for i in 0..free.len() {
        for j in 0..free.len() {
            all[(free[i], free[j])] = inverse[(i, j)] * scale[i] * scale[j];
        }
    }
    all.iter().all(|x| x.is_finite()).then_some(all)
}

/// A root C½ of a covariance, C = C½ C½ᵀ. Held unknowns have zero rows and columns.
pub(super) fn root(covariance: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let scale = covariance.diagonal().map(f64::sqrt);
    let held = |k: usize| scale[k] == 0.0;
    let scaled = DMatrix::from_fn(scale.len(), scale.len(), |i, j| match (held(i) || held(j), i == j) {
        (true, same) => f64::from(u8::from(same)),
        (false, _) => covariance[(i, j)] / (scale[i] * scale[j]),
    });
    let mut root = scaled.cholesky()?.l();
    for (k, mut row) in root.row_iter_mut().enumerate() {
        row *= scale[k];
    }
    Some(root)
}
