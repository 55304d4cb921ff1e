//! The cause of residuals that are not noise. Each usual cause leaves a pattern over the motion. The cause that explains nearly all of the explained
//! part is reported with its size.
//!
//! Correlation ρ between neighbours exaggerates the significance by (1 + ρ)/(1 − ρ).

use crate::assess::cause_kind::{COLUMNS, CauseKind, LENS};
use crate::assess::misfit_patterns::{Patterns, Solved};
use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// A cause that was found.
#[derive(Clone, Debug, PartialEq)]
pub struct MisfitCause {
    /// Its kind.
    pub kind: CauseKind,
    /// Its size, in the unit of its kind. The most significant of several numbers.
    pub size: f64,
    /// Its standard deviation from noise.
    pub sigma: f64,
    /// All its numbers, with their standard deviations from noise. An unobservable number is zero.
    pub numbers: Vec<(f64, f64)>,
    /// Remaining correlation of neighbours.
    pub left: f64,
    /// Change of the unknowns when the cause is estimated, and the covariance that this adds.
    pub step: DVector<f64>,
    /// See `step`.
    pub added_covariance: DMatrix<f64>,
}

/// Half of the prior uncertainty of a camera's k2. Above it a scan cannot separate k2 from k1.
const SHOWS_K2: f64 = 0.025;
/// Minimum number of observations.
const LEAST: usize = 100;
/// Least part of the squares that a cause must explain: 30 of χ²₃ is one scan in a million.
const LEAST_GAIN: f64 = 30.0;
/// Least share of the squares that all causes explain. Below it the cause is not among them.
const LEAST_OF_EXPLAINED: f64 = 0.7;

/// Finds the cause. `None` if the residuals are noise, or no cause explains them.
#[must_use]
pub(crate) fn find(patterns: &Patterns) -> Option<MisfitCause> {
    if patterns.len() < LEAST {
        return None;
    }
    // A smoothed path cuts corners. That looks like an arm that runs ahead of its acceleration, which no arm does.
    let is_possible = |kind: &CauseKind| {
        !kind.is_one_sided()
            || patterns.solve(kind.columns()).is_some_and(|solved| clearest(&solved, kind.columns()).0 > 0.0)
    };
    let possible: Vec<CauseKind> = CauseKind::ALL.into_iter().filter(is_possible).collect();
    let gain = |kinds: &[CauseKind]| {
        let columns = kinds.iter().flat_map(|kind| kind.columns());
        patterns.solve(columns).map_or(0.0, |solved| solved.gain)
    };
    let kind = possible.iter().copied().max_by(|a, b| gain(&[*a]).total_cmp(&gain(&[*b])))?;
    let mut columns = kind.columns();
    let mut solved = patterns.solve(columns.clone())?;
    if kind == CauseKind::Lens && solved.covariance[(LENS + 1, LENS + 1)].sqrt() > SHOWS_K2 {
        columns = LENS..LENS + 1;
        solved = patterns.solve(columns.clone())?;
    }
    if solved.gain < LEAST_GAIN || solved.gain < LEAST_OF_EXPLAINED * gain(&possible) {
        return None;
    }
    let alike = patterns.neighbours(&solved).max(0.0);
    let inflation = (1.0 + alike) / (1.0 - alike).max(0.02);
    if solved.gain < LEAST_GAIN * inflation {
        return None;
    }
    let (size, variance) = clearest(&solved, columns);
    let by_cause = patterns.unknowns_per_size();
    let covariance = DMatrix::from_column_slice(COLUMNS, COLUMNS, (solved.covariance * inflation).as_slice());
    Some(MisfitCause {
        kind,
        size,
        sigma: (variance * inflation).sqrt(),
        numbers: kind
            .columns()
            .map(|k| (solved.size[k], (solved.covariance[(k, k)] * inflation).sqrt()))
            .collect(),
        left: alike,
        step: &by_cause * solved.size,
        added_covariance: &by_cause * covariance * by_cause.transpose(),
    })
}

/// The number that is most significant, with its variance.
fn clearest(solved: &Solved, columns: Range<usize>) -> (f64, f64) {
    let numbers = columns.map(|k| (solved.size[k], solved.covariance[(k, k)]));
    let clear = |(size, variance): &(f64, f64)| size * size / variance;
    numbers.max_by(|a, b| clear(a).total_cmp(&clear(b))).unwrap_or((0.0, 0.0))
}
