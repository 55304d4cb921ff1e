//! The normal equations of unknowns and blocks under one covariance of the noise, and what follows from them.

use crate::adjustment::coloured::Sums;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// What is known before the scan: of unknowns that have moved from where it was known, and of the blocks.
#[derive(Clone, Debug)]
pub(crate) struct Prior {
    /// Inverse covariance of the estimated columns.
    pub information: DMatrix<f64>,
    /// That times where the unknowns are now.
    pub gradient: DVector<f64>,
    /// Twice the cost there.
    pub square: f64,
    /// ln of the determinant of the blocks' covariance.
    pub log_determinant: f64,
}

/// The normal equations at a state.
#[derive(Clone, Debug)]
pub(crate) struct Equations {
    /// Of the estimated columns, by the scan alone.
    pub of_scan: DMatrix<f64>,
    /// Products of the estimated columns with the residual.
    gradient: DVector<f64>,
    /// Products of the estimated columns with what is considered.
    pub considered: DMatrix<f64>,
    /// Products of what is considered with itself.
    considered_square: DMatrix<f64>,
    /// Products of what is considered with the residual.
    considered_gradient: DVector<f64>,
    /// Σ r², whitened.
    square: f64,
    /// ln of the determinant of the noise's covariance.
    log_determinant: f64,
}

impl Equations {
    /// Of the sums of both directions, each with the standard deviation of its white noise.
    #[must_use]
    pub(crate) fn of(sums: [&Sums; 2], sigmas: [f64; 2], estimated: usize) -> Self {
        let width = sums[0].products.ncols();
        let beside = width - estimated - 1;
        let mut all = DMatrix::zeros(width, width);
        let mut log_determinant = 0.0;
        for (sums, sigma) in sums.into_iter().zip(sigmas) {
            all += &sums.products * sigma.powi(-2);
            log_determinant += sums.log_determinant + 2.0 * sums.count as f64 * sigma.ln();
        }
        Self {
            of_scan: all.view((0, 0), (estimated, estimated)).into_owned(),
            gradient: all.view((0, estimated), (estimated, 1)).column(0).into_owned(),
            considered: all.view((0, estimated + 1), (estimated, beside)).into_owned(),
            considered_square: all.view((estimated + 1, estimated + 1), (beside, beside)).into_owned(),
            considered_gradient: all.view((estimated + 1, estimated), (beside, 1)).column(0).into_owned(),
            square: all[(estimated, estimated)],
            log_determinant,
        }
    }

    /// Their solution with the prior; `None` where something is not known at all.
    #[must_use]
    pub(crate) fn solve(&self, prior: &Prior) -> Option<Solved> {
        Some(self.solve_by((&self.of_scan + &prior.information).cholesky()?, prior))
    }

    /// The factors of these and of all equations of the same columns, the first of which are unknowns.
    #[must_use]
    pub(crate) fn factors(&self, prior: &Prior, unknowns: usize) -> Option<Factors> {
        let matrix = &self.of_scan + &prior.information;
        let count = matrix.ncols() - unknowns;
        let of_blocks = matrix.view((unknowns, unknowns), (count, count)).into_owned();
        Some(Factors { all: matrix.cholesky()?, of_blocks: of_blocks.cholesky()?, unknowns })
    }

    /// Their solution, their columns having these factors.
    #[must_use]
    pub(crate) fn solve_with(&self, factors: &Factors, prior: &Prior) -> Solved {
        self.solve_by(factors.all.clone(), prior)
    }

    fn solve_by(&self, factor: Cholesky<f64, Dyn>, prior: &Prior) -> Solved {
        let gradient = &self.gradient + &prior.gradient;
        let step = -factor.solve(&gradient);
        let square = self.square + prior.square + gradient.dot(&step);
        let of_blocks = factor.l_dirty().diagonal().map(f64::ln).sum() * 2.0;
        let twice_negative_log = self.log_determinant + prior.log_determinant + of_blocks + square;
        Solved { factor, step, twice_negative_log }
    }
}

/// Cholesky factors of equations whose residuals move while their columns stay.
pub(crate) struct Factors {
    /// Of all estimated columns.
    all: Cholesky<f64, Dyn>,
    /// Of the blocks alone.
    of_blocks: Cholesky<f64, Dyn>,
    /// Columns before the blocks.
    unknowns: usize,
}

/// A solution.
#[derive(Clone, Debug)]
pub(crate) struct Solved {
    factor: Cholesky<f64, Dyn>,
    /// How the unknowns move, and what the coefficients of the blocks are.
    pub step: DVector<f64>,
    /// Minus twice the logarithm of the restricted likelihood, but for a constant \[Patterson1971\].
    pub twice_negative_log: f64,
}

impl Solved {
    /// Standard deviations of the first columns.
    #[must_use]
    pub(crate) fn sigmas(&self, count: usize) -> Vec<f64> {
        let size = self.step.len();
        let mut rows = DMatrix::<f64>::identity(size, count);
        self.factor.l_dirty().solve_lower_triangular_mut(&mut rows);
        (0..count).map(|column| rows.column(column).norm()).collect()
    }

    /// How much of the estimate was known before: the trace of its information times the covariance. Of the first columns it may be joint, of the others
    /// it is each column's own.
    #[must_use]
    pub(crate) fn known_by(&self, prior: &Prior, joint: usize) -> f64 {
        let size = self.step.len();
        let first = self.factor.solve(&DMatrix::identity(size, joint));
        let of_first = prior.information.view((0, 0), (joint, joint)).component_mul(&first.rows(0, joint));
        let variances = self.variances();
        let own = (joint..size).map(|k| prior.information[(k, k)] * variances[k]);
        of_first.sum() + own.sum::<f64>()
    }

    /// Variances of all estimated columns.
    #[must_use]
    pub(crate) fn variances(&self) -> DVector<f64> {
        let root = self.factor.l_dirty();
        let size = self.step.len();
        let mut column = DVector::zeros(size);
        // The squares of a column of L⁻¹ add up to a diagonal number of L⁻ᵀ L⁻¹.
        DVector::from_fn(size, |first, _| {
            column.fill(0.0);
            column[first] = 1.0;
            for k in first..size {
                column[k] /= root[(k, k)];
                let own = column[k];
                let (mut below, of_root) = (column.rows_mut(k + 1, size - k - 1), root.column(k));
                below.axpy(-own, &of_root.rows(k + 1, size - k - 1), 1.0);
            }
            column.rows(first, size - first).norm_squared()
        })
    }

    /// The covariance of all estimated columns.
    #[must_use]
    pub(crate) fn covariance(&self) -> DMatrix<f64> {
        self.factor.inverse()
    }
}

impl Equations {
    /// What one of the considered columns would be if it were estimated with the rest, and its standard deviation.
    #[must_use]
    pub(crate) fn estimate_of(&self, considered: usize, solved: &Solved) -> (f64, f64) {
        let with = self.considered.column(considered);
        let spread = solved.factor.solve(&with);
        let information = self.considered_square[(considered, considered)] - with.dot(&spread);
        let score = self.considered_gradient[considered] + with.dot(&solved.step);
        (-score / information, information.max(f64::MIN_POSITIVE).sqrt().recip())
    }

    /// Twice the cost with the first columns, the unknowns, where they are and all others at their best.
    #[must_use]
    pub(crate) fn square_of_blocks(&self, factors: &Factors, prior: &Prior) -> f64 {
        let (unknowns, count) = (factors.unknowns, self.gradient.len() - factors.unknowns);
        let gradient = self.gradient.rows(unknowns, count) + prior.gradient.rows(unknowns, count);
        self.square + prior.square - gradient.dot(&factors.of_blocks.solve(&gradient))
    }
}
