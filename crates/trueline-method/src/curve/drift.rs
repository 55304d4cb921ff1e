//! Clock drift beside a curve: one more unknown. Its column is that of the time offset, times the time from the middle of the
//! scan.
//!
//! The drift is removed from the stamps, as in a scan over a line. One step at the optimum estimates it, the readings get new
//! stamps, and everything is fitted again. A single pass does not determine the drift, because its curve follows every drift.

use crate::curve::answer::{Answered, Asked};
use crate::curve::arrow::SHARED;
use crate::curve::considered::Considered;
use crate::curve::equations::Columns;
use crate::curve::fit::Fitted;
use crate::curve::readings::Readings;
use crate::curve::rows::Rows;
use crate::curve::solve::{Finished, Search, refined};
use crate::hypotheses::clock_drift::is_significant;
use crate::hypotheses::drift_and_step::Drift;
use nalgebra::{DVector, SMatrix, Vector3};

/// Rounds of removal: each removes the remainder of the linear estimate before it.
const ROUNDS: usize = 5;
/// A remainder below this fraction of its standard deviation is negligible.
const NOTHING: f64 = 0.1;
/// The drift is not determined if the other unknowns leave less than this fraction of the offset's column.
const LEAST_LEFT: f64 = 1e-6;

/// With errors of robot, sensor and detector considered, a drift is significant from this many standard deviations on. These
/// errors do not vary randomly from scan to scan.
const BESIDE_ERRORS: f64 = 3.0;

/// An answer without drift of the time offset.
pub(crate) struct DriftFree {
    /// The answer.
    pub answer: Answered,
    /// Its readings, if they got new stamps.
    pub readings: Option<Readings>,
    /// Estimated drift, even if it is not significant.
    pub drift: Option<Drift>,
    /// The removed drift.
    pub drifted: Option<Drift>,
}

/// An estimate of the drift.
struct Estimate {
    drift: Drift,
    /// Its standard deviation from noise alone, parts per million.
    by_noise_ppm: f64,
    /// Displacement of the answer by a drift error of one standard deviation.
    moves: SMatrix<f64, SHARED, 1>,
}

impl Asked<'_> {
    /// The answer without a significant drift of the image clock; `rate_sigma_ppm` is the uncertainty of the clock rates of the
    /// stamps.
    #[must_use]
    pub(crate) fn without_drift(&self, answer: Answered, rate_sigma_ppm: f64) -> DriftFree {
        let is_shown = !answer.curve.is_one_pass && !answer.is_held;
        let estimate = |readings: &Readings, finished: &Finished| {
            estimate(readings, finished, &self.errors.at(readings, &finished.fitted))
        };
        let with_rates = |d: Drift| Drift { sigma_ppm: d.sigma_ppm.hypot(rate_sigma_ppm), ..d };
        let is_shown_by = |drift: &Drift, by_noise_ppm: f64| {
            let by_noise = with_rates(Drift { sigma_ppm: by_noise_ppm, ..*drift });
            is_significant(&by_noise) && drift.ppm.abs() > BESIDE_ERRORS * drift.sigma_ppm
        };
        let first = is_shown.then(|| estimate(self.search.readings, &answer.finished)).flatten();
        let drift = first.as_ref().map(|first| with_rates(first.drift));
        let shown = drift.zip(first.as_ref()).filter(|(drift, first)| is_shown_by(drift, first.by_noise_ppm));
        if shown.is_none() {
            return DriftFree { answer, readings: None, drift, drifted: None };
        }
        let mut readings = self.search.readings.clone();
        let mut finished: Option<Finished> = None;
        // Rates multiply: for a rate off by 20 % the sum of the rounds would be off by 2 %.
        let (mut kept, mut left) = (1.0, first);
        for _ in 0..ROUNDS {
            let Some(found) = left.as_ref().map(|left| left.drift) else { break };
            if found.ppm.abs() < NOTHING * found.sigma_ppm {
                break;
            }
            kept *= 1.0 - found.ppm * 1e-6;
            for reading in &mut readings.list {
                // The stamps run fast about the middle, where they are correct.
                reading.stamp_s -= found.ppm * 1e-6 * (reading.stamp_s - found.about_s);
            }
            finished = refined(&readings, finished.as_ref().unwrap_or(&answer.finished));
            left = finished.as_ref().and_then(|finished| estimate(&readings, finished));
        }
        let (Some(finished), Some(left)) = (finished, left) else {
            return DriftFree { answer, readings: None, drift, drifted: None };
        };
        let ppm = (1.0 / (kept * (1.0 - left.drift.ppm * 1e-6)) - 1.0) * 1e6;
        let drifted = with_rates(Drift { ppm, ..left.drift });
        if !is_shown_by(&drifted, left.by_noise_ppm) {
            return DriftFree { answer, readings: None, drift: Some(drifted), drifted: None };
        }
        let search = Search { readings: &readings, ..self.search };
        let how = (answer.curve.is_near_weave, None);
        let mut answer = Asked { search, ..*self }.concluded(finished, answer.rivals, &answer.course, how);
        answer.noise += left.moves * left.moves.transpose();
        DriftFree { answer, readings: Some(readings), drift: Some(drifted), drifted: Some(drifted) }
    }
}

/// Change of the time offset over the scan at a fit, with the considered errors in its ±; `None` if it is not determined.
fn estimate(readings: &Readings, finished: &Finished, considered: &[Considered]) -> Option<Estimate> {
    let fitted = &finished.fitted;
    let by_time = |k: usize| {
        let seen = fitted.sights[k].as_ref().filter(|_| fitted.weights[k] > 0.0)?;
        Some(fitted.whiteners[k] * seen.by_shared.column(0))
    };
    let own = |k: usize| by_time(k).map_or(0.0, |by: Rows| by.norm_squared() * fitted.weights[k]);
    let all: Vec<f64> = (0..readings.list.len()).map(own).collect();
    // About the centre of the information on the offset the two are nearly independent.
    let stamps = all.iter().zip(&readings.list).map(|(own, reading)| own * reading.stamp_s);
    let about_s = stamps.sum::<f64>() / all.iter().sum::<f64>();
    let by_rate = |k: usize| Some(by_time(k)? * (readings.list[k].stamp_s - about_s));
    let beside = Beside::of(finished, by_rate);
    let (mut score, mut information) = (0.0, 0.0);
    for k in 0..readings.list.len() {
        let (Some(by), Some(alone)) = (by_rate(k), beside.alone(fitted, k, &by_rate)) else { continue };
        let seen = fitted.sights[k].as_ref()?;
        score += fitted.weights[k] * alone.dot(&(fitted.whiteners[k] * seen.residual));
        information += fitted.weights[k] * alone.dot(&by);
    }
    let before: f64 =
        all.iter().zip(&readings.list).map(|(own, r)| own * (r.stamp_s - about_s).powi(2)).sum();
    if information.is_nan() || information <= LEAST_LEFT * before {
        return None;
    }
    let by_noise = finished.variance / information;
    let mut variance = by_noise;
    for one in considered {
        let mut sums = vec![0.0; one.moves.errors];
        for (k, moved) in &one.moves.readings {
            let Some(alone) = beside.alone(fitted, *k, &by_rate) else { continue };
            let row = fitted.whiteners[*k].tr_mul(&alone) * fitted.weights[*k];
            for (sum, column) in sums.iter_mut().zip(moved.column_iter()) {
                *sum += row.dot(&column) / information;
            }
        }
        variance += sums.iter().map(|sum| sum * sum).sum::<f64>();
    }
    let drift = Drift { ppm: score / information * 1e6, sigma_ppm: variance.sqrt() * 1e6, about_s };
    let shared = beside.moved.len() - SHARED;
    let moves = SMatrix::<f64, 7, 1>::from_fn(|k, _| -beside.moved[shared + k] * variance.sqrt());
    Some(Estimate { drift, by_noise_ppm: by_noise.sqrt() * 1e6, moves })
}

/// The rate beside the other unknowns.
struct Beside {
    /// Response of the other unknowns, M⁻¹ Jᵀ W d, up to the sign.
    moved: DVector<f64>,
    normals: Vec<[Vector3<f64>; 2]>,
}

impl Beside {
    fn of(finished: &Finished, by_rate: impl Fn(usize) -> Option<Rows>) -> Self {
        let fitted = &finished.fitted;
        let normals = fitted.state.normals();
        let (mut sums, mut columns) = (DVector::zeros(fitted.state.size()), Columns::new());
        for (k, weight) in fitted.weights.iter().enumerate() {
            let (Some(by), Some(seen)) = (by_rate(k), &fitted.sights[k]) else { continue };
            columns.fill(&fitted.state, &normals, (seen, &fitted.whiteners[k]));
            for (index, own) in columns.found() {
                sums[*index] += own.dot(&by) * weight;
            }
        }
        Self { moved: finished.root.solve(&sums), normals }
    }

    /// Effect of the rate alone on a reading: its column without the part that the other unknowns absorb.
    fn alone(&self, fitted: &Fitted, k: usize, by_rate: &impl Fn(usize) -> Option<Rows>) -> Option<Rows> {
        let mut columns = Columns::new();
        let (by, seen) = (by_rate(k)?, fitted.sights[k].as_ref()?);
        let whitener = &fitted.whiteners[k];
        columns.fill(&fitted.state, &self.normals, (seen, whitener));
        let others: Rows = columns.found().iter().map(|(index, own)| own * self.moved[*index]).sum();
        Some(by - others)
    }
}
