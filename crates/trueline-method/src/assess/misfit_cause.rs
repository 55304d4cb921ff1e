//! What residuals that are not noise are made of: each usual cause leaves a pattern over the motion, and the one that
//! explains nearly all of what any of them explains is named, with its size.
//!
//! Residuals that are alike from one to the next make that look more than it is, by (1 + ρ)/(1 − ρ).

use crate::assess::cause_kind::{COLUMNS, CauseKind, LENS};
use crate::assess::misfit_patterns::{Patterns, Solved};
use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// A cause that was found.
#[derive(Clone, Debug, PartialEq)]
pub struct MisfitCause {
    /// Which.
    pub kind: CauseKind,
    /// Its size, in the unit of its kind; of several numbers the clearest.
    pub size: f64,
    /// Standard deviation of that by noise.
    pub sigma: f64,
    /// All its numbers, and their standard deviations by noise; a number that the scan does not show is zero.
    pub numbers: Vec<(f64, f64)>,
    /// Correlation of neighbours that it leaves.
    pub left: f64,
    /// How the unknowns move if it is allowed for, and the covariance that this adds.
    pub step: DVector<f64>,
    /// See `step`.
    pub added_covariance: DMatrix<f64>,
}

/// Half of the prior uncertainty of a camera's k2: a scan with no less cannot separate it from k1.
const SHOWS_K2: f64 = 0.025;
/// Fewer have no information.
const LEAST: usize = 100;
/// A cause must explain so much of the squares: 30 of χ²₃ is one scan in a million.
const LEAST_GAIN: f64 = 30.0;
/// … and this part of what all causes together explain: else it is something that is not among them.
const LEAST_OF_EXPLAINED: f64 = 0.7;

/// Finds it; `None` where nothing is left to explain, or none of them explains it.
#[must_use]
pub(crate) fn find(patterns: &Patterns) -> Option<MisfitCause> {
    if patterns.len() < LEAST {
        return None;
    }
    // The corners that a smoothed path cuts off look like an arm that runs ahead of its acceleration: no arm does.
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

/// The number that is clearest beside its standard deviation, and its variance.
fn clearest(solved: &Solved, columns: Range<usize>) -> (f64, f64) {
    let numbers = columns.map(|k| (solved.size[k], solved.covariance[(k, k)]));
    let clear = |(size, variance): &(f64, f64)| size * size / variance;
    numbers.max_by(|a, b| clear(a).total_cmp(&clear(b))).unwrap_or((0.0, 0.0))
}
