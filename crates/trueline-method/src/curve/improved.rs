//! Errors estimated beside a curve, each with a prior: the shape of the sensor, and the place of the part in each pass. One linear
//! step at the optimum estimates them.
//!
//! With r = J x + Z ξ + noise of variance v, ξ ~ N(0, 1) for every considered error, and M = JᵀWJ with the curve's prior:
//!
//! ```text
//! N = ZᵀWZ − (JᵀWZ)ᵀ M⁻¹ JᵀWZ,  P = (1 + N/v)⁻¹,  ξ̂ = P ZᵀWr/v
//! ```
//!
//! Robot, edge and detector are in ξ, so that their errors are not attributed to the estimated ones s. Only the part s of ξ̂ is
//! used. Then the answer is off by Xᵣ ξᵣ + Xₛ (ξₛ − ξ̂ₛ) with X = M⁻¹JᵀWZ, and ξₛ − ξ̂ₛ = Pₛᵣ ξᵣ + q with q ~ N(0, Pₛₛ − Pₛᵣ
//! Pᵣₛ).

use crate::assess::share::Share;
use crate::curve::arrow::SHARED;
use crate::curve::considered::{Considered, Errors, ShapeError};
use crate::curve::equations::{sights, stepped};
use crate::curve::moved::Moves;
use crate::curve::readings::Readings;
use crate::curve::rows::ROWS;
use crate::curve::solve::Finished;
use nalgebra::{DMatrix, DVector, SVector};
use std::ops::Range;
use trueline_model::SheetShape;

/// Rounds of the noise level, which falls as the shape explains residuals.
const ROUNDS: usize = 3;
/// Refits at most.
const REFITS: usize = 4;
/// Step of the answer that leads far, in standard deviations of its noise: a step of 3 σ leaves terms of second order far below the noise.
const FAR: f64 = 3.0;
/// Variance of each error that rounding may hide, in units of what was known beforehand.
const LEAST: f64 = 1e-12;

/// A fit with estimated errors.
pub(crate) struct Improved {
    /// The fit, moved.
    pub finished: Finished,
    /// Contributions of the errors to all unknowns.
    pub shares: Vec<Share>,
    /// The correction of the sheet; `None` where the shape is held.
    pub shape: Option<SheetShape>,
}

/// The equations of the errors beside all unknowns.
pub(crate) struct Beside {
    /// X: displacement of all unknowns by each error.
    moved: DMatrix<f64>,
    /// N.
    pub information: DMatrix<f64>,
    /// ZᵀWr.
    pub score: DVector<f64>,
    /// Range of each kind of error in ξ.
    pub places: Vec<Range<usize>>,
}

impl Beside {
    /// At a fit.
    #[must_use]
    pub(crate) fn of(finished: &Finished, considered: &[Considered]) -> Self {
        let fitted = &finished.fitted;
        let mut places: Vec<Range<usize>> = Vec::with_capacity(considered.len());
        for one in considered {
            let first = places.last().map_or(0, |before| before.end);
            places.push(first..first + one.moves.errors);
        }
        let count = places.last().map_or(0, |last| last.end);
        let mut rows = DMatrix::zeros(ROWS * fitted.sights.len(), count);
        let mut residuals = DVector::zeros(ROWS * fitted.sights.len());
        for (k, seen) in fitted.sights.iter().enumerate() {
            let Some(seen) = seen else { continue };
            let whitened = fitted.whiteners[k] * seen.residual * fitted.weights[k].sqrt();
            residuals.fixed_rows_mut::<ROWS>(ROWS * k).copy_from(&whitened);
        }
        for (one, place) in considered.iter().zip(&places) {
            for (k, by) in &one.moves.readings {
                let whitened = fitted.whiteners[*k] * fitted.weights[*k].sqrt() * by;
                rows.view_mut((ROWS * k, place.start), (ROWS, place.len())).copy_from(&whitened);
            }
        }
        let (size, mut first) = (fitted.state.arrow().size(), 0);
        let (mut moved, mut crossed) = (DMatrix::zeros(size, count), DMatrix::zeros(size, count));
        for one in considered {
            let sums = one.moves.sums(fitted);
            let columns = one.moves.solved(sums.clone(), &finished.root);
            moved.columns_mut(first, sums.ncols()).copy_from(&columns);
            crossed.columns_mut(first, sums.ncols()).copy_from(&sums);
            first += sums.ncols();
        }
        let information = rows.tr_mul(&rows) - crossed.tr_mul(&moved);
        Self { information, moved, score: rows.tr_mul(&residuals), places }
    }

    /// P.
    fn posterior(&self, variance: f64) -> Option<DMatrix<f64>> {
        let half = (&self.information + self.information.transpose()) * (0.5 / variance);
        let size = half.nrows();
        Some((half + DMatrix::identity(size, size)).cholesky()?.inverse())
    }
}

/// The fit with the estimated errors; `None` if there are none, or if some error is not known for every reading. One step is linear:
/// if it leads far, `refit` fits the readings without the errors again, and a second step starts there.
#[must_use]
pub(crate) fn improved(
    readings: &Readings,
    finished: &Finished,
    errors: &Errors<'_>,
    refit: impl Fn(&Readings, &Finished) -> Option<Finished>,
) -> Option<Improved> {
    let mut step = step(readings, (readings, finished), errors, None)?;
    // The first fit takes readings near the end of a pass for sure ones.
    for round in 0..REFITS {
        if !(step.is_far || (round == 0 && errors.part.is_some())) {
            break;
        }
        let again = refit(&step.corrected, &step.improved.finished);
        let Some(next) =
            again.and_then(|fit| self::step(readings, (&step.corrected, &fit), errors, Some(&step.errors)))
        else {
            break;
        };
        step = next;
    }
    Some(step.improved)
}

/// One linear step.
struct Step {
    improved: Improved,
    /// The readings without the estimated errors.
    corrected: Readings,
    /// The estimated errors, in standard deviations of their priors.
    errors: DVector<f64>,
    /// Whether the answer moved so far that terms of second order may count.
    is_far: bool,
}

/// A step at a fit to readings that are free of the errors `before`.
fn step(
    readings: &Readings,
    (corrected, finished): (&Readings, &Finished),
    errors: &Errors<'_>,
    before: Option<&DVector<f64>>,
) -> Option<Step> {
    let is_seen = finished.seen.components.iter().all(|seen| *seen);
    let considered = errors.at(corrected, &finished.fitted);
    let first = considered.iter().position(|one| is_seen && one.is_estimated)?;
    let last = considered.iter().rposition(|one| one.is_estimated)?;
    if considered.iter().any(|one| one.moves.every > 1) {
        return None;
    }
    let beside = Beside::of(finished, &considered);
    let own = beside.places[first].start..beside.places[last].end;
    let known = before.cloned().unwrap_or_else(|| DVector::zeros(own.len()));
    if known.len() != own.len() {
        return None;
    }
    let squares = finished.fitted.squares();
    let (mut variance, mut found) = (finished.variance, None);
    for _ in 0..ROUNDS {
        let posterior = beside.posterior(variance)?;
        let mut score = &beside.score / variance;
        score.rows_mut(own.start, own.len()).zip_apply(&known, |score, known| *score -= known);
        let more = posterior.rows(own.start, own.len()) * score;
        let information = beside.information.view((own.start, own.start), (own.len(), own.len()));
        let gained =
            2.0 * more.dot(&beside.score.rows(own.start, own.len())) - more.dot(&(information * &more));
        variance = finished.variance * (1.0 - gained / squares).max(f64::EPSILON);
        found = Some((posterior, more));
    }
    let (posterior, more) = found?;
    let moved = -(beside.moved.columns(own.start, own.len()) * &more);
    let total = known + more;
    let estimated = considered[first..=last].iter().zip(&beside.places[first..=last]);
    let (mut corrected, mut shape) = (readings.clone(), None);
    for (one, place) in estimated {
        let own = total.rows(place.start - own.start, place.len());
        match (&one.shape, &errors.shape) {
            (Some(half), Some(ShapeError { origin_m, .. })) => {
                let h = SVector::<f64, 5>::from_column_slice((half * own).as_slice());
                let found = SheetShape::exact_about(origin_m).retract(&-h);
                corrected = corrected.corrected(&found);
                shape = Some(found);
            }
            _ => corrected.take_out(&one.moves, &own.into_owned()),
        }
    }
    if let Some(part) = &errors.part {
        part.doubt(&mut corrected, &finished.fitted);
    }
    let shares = shares(&considered, &beside, &posterior, first..last + 1)?;
    let by_shared = moved.rows(moved.len() - SHARED, SHARED);
    let noise = finished.seen.covariance * (variance / finished.variance);
    // The priors of the errors, and the freedom that they give.
    let own_posterior = posterior.view((own.start, own.start), (own.len(), own.len())).into_owned();
    let occam = own_posterior.cholesky()?.ln_determinant();
    let is_far = by_shared.dot(&noise.cholesky()?.solve(&by_shared)) > FAR.powi(2);
    let mut finished = finished.moved(&corrected, &moved, variance);
    let prior = 0.5 * (occam - total.norm_squared());
    finished.evidence = finished.evidence.map(|evidence| evidence + prior);
    Some(Step { improved: Improved { finished, shares, shape }, corrected, errors: total, is_far })
}

/// Contribution of each kind of error to all unknowns and to the shape.
fn shares(
    considered: &[Considered],
    beside: &Beside,
    posterior: &DMatrix<f64>,
    estimated: Range<usize>,
) -> Option<Vec<Share>> {
    let places = &beside.places;
    let own = places[estimated.start].start..places[estimated.end - 1].end;
    let by_own = beside.moved.columns(own.start, own.len());
    // What the errors that are estimated make of the shape.
    let mut by_shape = DMatrix::zeros(5, own.len());
    for (one, place) in considered.iter().zip(places) {
        if let Some(half) = one.shape.as_ref().filter(|_| one.is_estimated) {
            by_shape.columns_mut(place.start - own.start, place.len()).copy_from(half);
        }
    }
    let mut left = posterior.view((own.start, own.start), (own.len(), own.len())).into_owned();
    let mut shares = Vec::with_capacity(considered.len());
    for (k, (one, place)) in considered.iter().zip(places).enumerate() {
        if estimated.contains(&k) {
            continue;
        }
        let with = posterior.view((own.start, place.start), (own.len(), place.len()));
        left -= with * with.transpose();
        shares.push(Share {
            of: one.of,
            columns: beside.moved.columns(place.start, place.len()) + by_own * with,
            shape: Some(one.shape.as_ref().map_or_else(|| &by_shape * with, |held| held + &by_shape * with)),
        });
    }
    // Of what is left the first kind takes what it shares with the others. Rounding may leave no root of an error that is known exactly.
    left += DMatrix::identity(own.len(), own.len()) * LEAST;
    let root = left.cholesky()?.unpack();
    for k in estimated {
        let place = places[k].start - own.start..places[k].end - own.start;
        let root = root.columns(place.start, place.len());
        shares.push(Share { of: considered[k].of, columns: by_own * root, shape: Some(&by_shape * root) });
    }
    Some(shares)
}

impl Readings {
    /// Takes errors of these sizes out of the readings.
    fn take_out(&mut self, moves: &Moves, errors: &DVector<f64>) {
        for (k, by) in &moves.readings {
            self.list[*k].off_m += by * errors;
        }
    }
}

impl Finished {
    /// The same optimum with other readings, moved by a step and with another variance of the noise.
    fn moved(&self, readings: &Readings, step: &DVector<f64>, variance: f64) -> Self {
        let mut fitted = self.fitted.clone();
        fitted.state = stepped(&fitted.state, step);
        fitted.sights = sights(readings, &fitted.state);
        for (k, seen) in fitted.sights.iter().enumerate() {
            match seen {
                Some(seen) => fitted.state.u_m[k] = seen.u_m,
                None => fitted.weights[k] = 0.0,
            }
        }
        let ratio = variance / self.variance;
        let mut seen = self.seen.clone();
        seen.covariance *= ratio;
        Self {
            fitted,
            seen,
            variance,
            factor: self.factor * ratio.sqrt(),
            parts: self.parts.clone(),
            root: self.root.clone(),
            ..*self
        }
    }
}
