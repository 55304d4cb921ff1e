//! Whether new samples agree with those before.

use super::sums::Sums;
use crate::problem::parameters::TIME_OFFSET;
use nalgebra::{DMatrix, DVector};

/// New samples that do not agree with those before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Change {
    /// Stamp of the first of them, or of the window that they are in, ns.
    pub since_ns: i64,
    /// How far the time offset has changed by them, s; 0 where too few of them fit at all.
    pub time_offset_s: f64,
    /// Part of the seam points that fit, by their weights.
    pub fitting: f64,
}

/// A change of the offset that noise causes in one window of 1e11: a stream of a year has 1.6 million of 20 s.
const SIGMAS: f64 = 7.0;
/// Where fewer fit than this, most samples of a window are outliers.
const LEAST_FITTING: f64 = 0.5;
/// Fewer samples are not judged.
const FEWEST: usize = 50;

/// Innovation of a window of samples against all earlier ones: `covariance` is theirs, `step` their estimate from the state of the sums,
/// `scale` how much larger the time offset's standard deviation is than by these sums.
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
