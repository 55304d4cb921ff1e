//! External axes estimated in an adjustment.

use crate::adjustment::adjust::{Adjusted, Adjustment};
use crate::adjustment::blocks::{Block, Kind};
use crate::adjustment::columns::Considered;
use crate::adjustment::sights::Sights;
use nalgebra::{DMatrix, DVector};

/// Corrections of the external axes from a scan; six numbers each, in the order of the chain.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisStep {
    /// Correction of each number, SI.
    pub step: DVector<f64>,
    /// Their total covariance.
    pub covariance: DMatrix<f64>,
}

/// The same of an adjustment; `None` without axes.
pub(super) fn axis_step<S: Sights<ROWS, LOCAL>, const ROWS: usize, const LOCAL: usize>(
    adjustment: &Adjustment<S, ROWS, LOCAL>,
    adjusted: &Adjusted,
    covariance: &DMatrix<f64>,
) -> Option<AxisStep> {
    let of_axes = |block: &Block| match &block.kind {
        Kind::Axes { sigmas } => Some((block.columns.clone(), DVector::from_row_slice(sigmas))),
        _ => None,
    };
    let (columns, sigmas) = adjustment.columns.blocks.iter().find_map(of_axes)?;
    let (first, count) = (columns.start, columns.len());
    // Contributions of noise and priors, and of the consider parameters. The square of the lag is only tested and not included.
    let own = covariance.view((first, first), (count, count));
    let errors =
        adjustment.columns.considered.iter().take_while(|one| !matches!(one, Considered::SquaredLag(_)));
    let errors = errors.map(Considered::columns).sum();
    let by_considered = covariance.rows(first, count) * adjusted.equations.considered.columns(0, errors);
    let unit = DMatrix::from_diagonal(&sigmas);
    Some(AxisStep {
        step: adjustment.coefficients.rows(first, count).component_mul(&sigmas),
        covariance: &unit * (own + &by_considered * by_considered.transpose()) * &unit,
    })
}
