//! The normal equations of unknowns and blocks under one noise covariance, and their solution.

use crate::adjustment::coloured::Sums;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// The prior of the unknowns, at their present state, and of the blocks.
#[derive(Clone, Debug)]
pub(crate) struct Prior {
    /// Inverse covariance of the estimated columns.
    pub information: DMatrix<f64>,
    /// The information times the present deviation from the prior mean.
    pub gradient: DVector<f64>,
    /// Twice the cost there.
    pub square: f64,
    /// ln of the determinant of the blocks' covariance.
    pub log_determinant: f64,
}

/// The normal equations at a state.
#[derive(Clone, Debug)]
pub(crate) struct Equations {
    /// Information of the scan alone on the estimated columns.
    pub of_scan: DMatrix<f64>,
    /// Products of the estimated columns with the residual.
    gradient: DVector<f64>,
    /// Products of the estimated columns with the consider parameters.
    pub considered: DMatrix<f64>,
    /// Products of the consider parameters with each other.
    considered_square: DMatrix<f64>,
    /// Products of the consider parameters with the residual.
    considered_gradient: DVector<f64>,
    /// Σ r², whitened.
    square: f64,
    /// ln of the determinant of the noise's covariance.
    log_determinant: f64,
}

impl Equations {
    /// From the sums of each residual of the frames, with the standard deviation of its white noise.
    #[must_use]
    pub(crate) fn of<const ROWS: usize>(sums: [&Sums; ROWS], sigmas: [f64; ROWS], estimated: usize) -> Self {
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

    /// Their solution with the prior. `None` if an unknown is undetermined.
    #[must_use]
    pub(crate) fn solve(&self, prior: &Prior) -> Option<Solved> {
        Some(self.solve_by((&self.of_scan + &prior.information).cholesky()?, prior))
    }

    /// Factors that hold for all equations with the same columns, the unknowns first.
    #[must_use]
    pub(crate) fn factors(&self, prior: &Prior, unknowns: usize) -> Option<Factors> {
        let matrix = &self.of_scan + &prior.information;
        let count = matrix.ncols() - unknowns;
        let of_blocks = matrix.view((unknowns, unknowns), (count, count)).into_owned();
        Some(Factors { all: matrix.cholesky()?, of_blocks: of_blocks.cholesky()?, unknowns })
    }

    /// Their solution with given factors.
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

/// Cholesky factors of equations with moving residuals and fixed columns.
pub(crate) struct Factors {
    /// Factor of all estimated columns.
    all: Cholesky<f64, Dyn>,
    /// Factor of the blocks alone.
    of_blocks: Cholesky<f64, Dyn>,
    /// Columns before the blocks.
    unknowns: usize,
}

/// A solution.
#[derive(Clone, Debug)]
pub(crate) struct Solved {
    factor: Cholesky<f64, Dyn>,
    /// The step of the unknowns and the coefficients of the blocks.
    pub step: DVector<f64>,
    /// Minus twice the logarithm of the restricted likelihood, up to a constant \[Patterson1971\].
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

    /// Degrees of freedom that the prior supplies: the trace of its information times the covariance. The prior of the first columns may be joint.
    /// That of the others is diagonal.
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
    /// The estimate of a consider parameter if it were free, and its standard deviation.
    #[must_use]
    pub(crate) fn estimate_of(&self, considered: usize, solved: &Solved) -> (f64, f64) {
        let with = self.considered.column(considered);
        let spread = solved.factor.solve(&with);
        let information = self.considered_square[(considered, considered)] - with.dot(&spread);
        let score = self.considered_gradient[considered] + with.dot(&solved.step);
        (-score / information, information.max(f64::MIN_POSITIVE).sqrt().recip())
    }

    /// Twice the cost with the unknowns held and all other columns at their optimum.
    #[must_use]
    pub(crate) fn square_of_blocks(&self, factors: &Factors, prior: &Prior) -> f64 {
        let (unknowns, count) = (factors.unknowns, self.gradient.len() - factors.unknowns);
        let gradient = self.gradient.rows(unknowns, count) + prior.gradient.rows(unknowns, count);
        self.square + prior.square - gradient.dot(&factors.of_blocks.solve(&gradient))
    }
}
