//! Tests whether new samples agree with earlier ones.

use super::sums::Sums;
use crate::problem::parameters::TIME_OFFSET;
use nalgebra::{DMatrix, DVector};

/// New samples that disagree with earlier ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Change {
    /// Stamp of the first of them, or of their window, ns.
    pub since_ns: i64,
    /// Change of the time offset, s. 0 if too few of them fit.
    pub time_offset_s: f64,
    /// Fraction of the seam points that fit, by weight.
    pub fitting: f64,
}

/// A change that noise causes in one window of 1e11. A stream of a year has 1.6 million windows of 20 s.
const SIGMAS: f64 = 7.0;
/// Fraction of fitting samples below which most of a window are outliers.
const LEAST_FITTING: f64 = 0.5;
/// Minimum samples for a test.
const FEWEST: usize = 50;

/// Innovation of a window of samples relative to all earlier ones. `covariance` is that of the earlier ones, `step` is their estimate from the state
/// of the sums, and `scale` is the ratio of the time offset's standard deviation to that from these sums.
pub(super) fn change(
    window: &Sums,
    since_ns: i64,
    covariance: &DMatrix<f64>,
    step: &DVector<f64>,
    scale: f64,
) -> Option<Change> {
    if window.count < FEWEST {
        return None;
    }
    let fitting = window.weight / window.count as f64;
    if fitting < LEAST_FITTING {
        return Some(Change { since_ns, time_offset_s: 0.0, fitting });
    }
    let row = window.hessian.row(TIME_OFFSET);
    let own = row[TIME_OFFSET];
    let score = window.gradient[TIME_OFFSET] + (row * step)[0];
    let variance = own + (row * covariance * row.transpose())[0];
    let is_change = score.abs() > SIGMAS * scale.max(1.0) * variance.sqrt();
    is_change.then_some(Change { since_ns, time_offset_s: -score / own, fitting })
}
