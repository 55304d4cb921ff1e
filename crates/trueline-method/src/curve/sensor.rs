//! The shape of the sensor beside a curve: five more unknowns with a prior, by one linear step at the optimum.
//!
//! With r = J x + Z ξ + noise of variance v, ξ ~ N(0, 1) for every considered error, and M = JᵀWJ with the curve's prior:
//!
//! ```text
//! N = ZᵀWZ − (JᵀWZ)ᵀ M⁻¹ JᵀWZ,  P = (1 + N/v)⁻¹,  ξ̂ = P ZᵀWr/v
//! ```
//!
//! Robot, edge and detector are in ξ, so that their errors are not attributed to the sensor. Only the sensor's part of ξ̂ is
//! used. Then the answer is off by Xᵣ ξᵣ + Xₛ (ξₛ − ξ̂ₛ) with X = M⁻¹JᵀWZ, and ξₛ − ξ̂ₛ = Pₛᵣ ξᵣ + q with q ~ N(0, Pₛₛ − Pₛᵣ
//! Pᵣₛ).

use crate::assess::seam_error::{Share, ShareOf};
use crate::curve::considered::{Considered, Errors, ShapeError};
use crate::curve::equations::{sights, stepped};
use crate::curve::readings::Readings;
use crate::curve::solve::Finished;
use nalgebra::{DMatrix, DVector, SVector};
use std::ops::Range;
use trueline_model::SheetShape;

/// Rounds of the noise level, which falls as the shape explains residuals.
const ROUNDS: usize = 3;

/// A fit with an estimated sensor shape.
pub(crate) struct WithShape {
    /// The fit, moved.
    pub finished: Finished,
    /// Contributions of the errors to all unknowns.
    pub shares: Vec<Share>,
    /// The correction of the sheet.
    pub shape: SheetShape,
}

/// The equations of the errors beside all unknowns.
struct Beside {
    /// X: displacement of all unknowns by each error.
    moved: DMatrix<f64>,
    /// N.
    information: DMatrix<f64>,
    /// ZᵀWr.
    score: DVector<f64>,
    /// Range of each kind of error in ξ.
    places: Vec<Range<usize>>,
}

impl Beside {
    fn of(finished: &Finished, considered: &[Considered]) -> Self {
        let fitted = &finished.fitted;
        let mut places: Vec<Range<usize>> = Vec::with_capacity(considered.len());
        for one in considered {
            let first = places.last().map_or(0, |before| before.end);
            places.push(first..first + one.moves.errors);
        }
        let count = places.last().map_or(0, |last| last.end);
        let mut rows = DMatrix::zeros(2 * fitted.sights.len(), count);
        let mut residuals = DVector::zeros(2 * fitted.sights.len());
        for (k, seen) in fitted.sights.iter().enumerate() {
            let Some(seen) = seen else { continue };
            let whitened = fitted.whiteners[k] * seen.residual * fitted.weights[k].sqrt();
            residuals.fixed_rows_mut::<2>(2 * k).copy_from(&whitened);
        }
        for (one, place) in considered.iter().zip(&places) {
            for (k, by) in &one.moves.readings {
                let whitened = fitted.whiteners[*k] * fitted.weights[*k].sqrt() * by;
                rows.view_mut((2 * k, place.start), (2, place.len())).copy_from(&whitened);
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

/// The fit with the shape of its sensor; `None` if that is not requested, or if some error is not known for every reading.
#[must_use]
pub(crate) fn with_shape(readings: &Readings, finished: &Finished, errors: &Errors<'_>) -> Option<WithShape> {
    let is_seen = finished.seen.components.iter().all(|seen| *seen);
    let ShapeError { origin_m, .. } = errors.shape.filter(|shape| is_seen && shape.is_estimated)?;
    let considered = errors.at(readings, &finished.fitted);
    let at = considered.iter().position(|one| one.of == ShareOf::Sensor)?;
    let half = considered[at].shape.as_ref()?;
    if considered.iter().any(|one| one.moves.every > 1) {
        return None;
    }
    let beside = Beside::of(finished, &considered);
    let own = beside.places[at].clone();
    let squares = finished.fitted.squares();
    let (mut variance, mut found) = (finished.variance, None);
    for _ in 0..ROUNDS {
        let posterior = beside.posterior(variance)?;
        let errors = (posterior.rows(own.start, own.len()) * &beside.score) / variance;
        let information = beside.information.view((own.start, own.start), (own.len(), own.len()));
        let gained =
            2.0 * errors.dot(&beside.score.rows(own.start, own.len())) - errors.dot(&(information * &errors));
        variance = finished.variance * (1.0 - gained / squares).max(f64::EPSILON);
        found = Some((posterior, errors));
    }
    let (posterior, errors) = found?;
    let step = beside.moved.columns(own.start, own.len()) * &errors;
    let h = half * &errors;
    let shape =
        SheetShape::exact_about(&origin_m).retract(&-SVector::<f64, 5>::from_column_slice(h.as_slice()));
    let shares = shares(&considered, &beside, &posterior, (at, half))?;
    Some(WithShape { finished: finished.moved(&readings.corrected(&shape), &-step, variance), shares, shape })
}

/// Contribution of each kind of error to all unknowns and to the shape.
fn shares(
    considered: &[Considered],
    beside: &Beside,
    posterior: &DMatrix<f64>,
    (at, half): (usize, &DMatrix<f64>),
) -> Option<Vec<Share>> {
    let own = beside.places[at].clone();
    let by_own = beside.moved.columns(own.start, own.len());
    let mut left = posterior.view((own.start, own.start), (own.len(), own.len())).into_owned();
    let mut shares = Vec::with_capacity(considered.len());
    for (one, place) in considered.iter().zip(&beside.places).filter(|(_, place)| **place != own) {
        let with = posterior.view((own.start, place.start), (own.len(), place.len()));
        left -= with * with.transpose();
        shares.push(Share {
            of: one.of,
            columns: beside.moved.columns(place.start, place.len()) + by_own * with,
            shape: Some(half * with),
        });
    }
    let root = left.symmetric_eigen();
    let root = &root.eigenvectors * DMatrix::from_diagonal(&root.eigenvalues.map(|own| own.max(0.0).sqrt()));
    shares.push(Share { of: ShareOf::Sensor, columns: by_own * &root, shape: Some(half * root) });
    Some(shares)
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
