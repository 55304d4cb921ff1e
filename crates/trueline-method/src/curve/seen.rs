//! Observability of clock and hand-eye transform from a scan over an unknown curve: by its data alone, without the prior.
//!
//! The prior of a curve adds information on clock and hand-eye transform that the data do not contain: a smaller curve is
//! smoother, and the lever follows. So rank and ± are those of F. In each direction F is the weaker of F₀ and F₁. F₀ has a prior
//! a million times weaker. F₁ has the estimated curve as a rigid body of free place. With w, V of F₁ V = (F₀ + ε) V w, F = V⁻ᵀ
//! diag(min(w, 1)) V⁻¹.

use crate::curve::arrow::SHARED;
use crate::curve::fit::Fitted;
use crate::curve::rows::ROWS;
use crate::curve::smoothness::Parts;
use nalgebra::{DMatrix, SMatrix, SVector, SymmetricEigen, Vector3};

type Shared = SMatrix<f64, SHARED, SHARED>;

/// A direction is observable if its standard deviation is below this in t_d (s), φ (rad) and t (m).
const SEEN: [f64; 3] = [5e-3, std::f64::consts::PI / 180.0, 5e-3];
/// Prior standard deviations of t_d (s), φ (rad) and t (m) without any scan.
const WIDE: [f64; 3] = [1.0, 1.0, 0.3];
/// Factor that weakens the prior of the curve.
const WEAKER: f64 = 1e-6;

/// In an unobservable direction, rounding leaves no root. This fraction of each diagonal entry is far below the required
/// information.
const LEAST_ROOT: f64 = 1e-10;

/// The size of a component of the tangent, by groups.
fn of_group<const N: usize>(sizes: [f64; 3]) -> SVector<f64, N> {
    SVector::from_fn(|k, _| sizes[usize::from(k > 0) + usize::from(k > 3)])
}

/// Observability of a scan.
#[derive(Clone, Debug)]
pub(crate) struct Seen {
    /// Number of observable directions.
    pub rank: usize,
    /// Singular values in units of the required information, decreasing.
    pub singular_values: [f64; SHARED],
    /// Unobservable directions as unit vectors of the components in units of the required information, one column each.
    pub unseen: DMatrix<f64>,
    /// Whether each component is determined.
    pub components: [bool; SHARED],
    /// Covariance from noise, with the prior without any scan.
    pub covariance: Shared,
}

impl Seen {
    /// From a fit with third differences of a size, m, and the variance of the noise over the expected one.
    #[must_use]
    pub(crate) fn of(fitted: &Fitted, parts: &Parts, s3_m: f64, variance: f64) -> Option<Self> {
        Self::from_information(weaker(&without_prior(parts, s3_m)?, &rigid(fitted)?)? / variance)
    }

    /// Beside a curve of known form with this tolerance, m. Its prior comes from the drawing, so it counts.
    #[must_use]
    pub(crate) fn of_known_form(parts: &Parts, tolerance_m: f64, variance: f64) -> Option<Self> {
        let root = parts.of_data(tolerance_m).damped(LEAST_ROOT).root()?;
        Self::from_information(root.shared_information() / variance)
    }

    fn from_information(information: Shared) -> Option<Self> {
        let (units, wide) = (of_group::<SHARED>(SEEN), of_group::<SHARED>(WIDE));
        let scaled = Shared::from_fn(|i, j| information[(i, j)] * units[i] * units[j]);
        let eigen = SymmetricEigen::try_new(scaled, f64::EPSILON, 1000)?;
        let mut order: Vec<usize> = (0..SHARED).collect();
        order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
        let rank = order.iter().filter(|k| eigen.eigenvalues[**k] >= 1.0).count();
        let unseen =
            DMatrix::from_fn(SHARED, SHARED - rank, |row, k| eigen.eigenvectors[(row, order[rank + k])]);
        let known = information + Shared::from_diagonal(&wide.map(|size| size.powi(-2)));
        let covariance = known.cholesky()?.inverse();
        // The covariance contains the prior without any scan. A component with a part in an unobservable direction is therefore
        // not determined.
        let is_seen = |k: usize| covariance[(k, k)].sqrt() < units[k];
        Some(Self {
            rank,
            singular_values: std::array::from_fn(|k| eigen.eigenvalues[order[k]].max(0.0).sqrt()),
            unseen,
            components: std::array::from_fn(is_seen),
            covariance,
        })
    }

    /// Information that holds directions with less than a share of the required information.
    #[must_use]
    pub(crate) fn holding(&self, least: f64) -> Shared {
        /// Standard deviation of a held direction, as a fraction of the required one.
        const HELD: f64 = 1e-3;
        let units = of_group::<SHARED>(SEEN);
        let mut held = Shared::zeros();
        for k in 0..self.unseen.ncols() {
            if self.singular_values[self.rank + k] < least {
                let direction: SVector<f64, SHARED> =
                    SVector::from_fn(|row, _| self.unseen[(row, k)] / units[row]);
                held += direction * direction.transpose() * HELD.powi(-2);
            }
        }
        held
    }
}

/// F₀: with hardly any prior of the curve.
fn without_prior(parts: &Parts, s3_m: f64) -> Option<Shared> {
    Some(parts.of_data(s3_m / WEAKER.sqrt()).damped(LEAST_ROOT).root()?.shared_information())
}

/// F₁: with the curve as a rigid body of free place.
fn rigid(fitted: &Fitted) -> Option<Shared> {
    const PLACE: usize = 6;
    let spline = &fitted.state.spline;
    let middle = spline.control.iter().sum::<Vector3<f64>>() / spline.control.len() as f64;
    let (mut own, mut cross, mut place) = (
        Shared::zeros(),
        SMatrix::<f64, PLACE, SHARED>::zeros(),
        SMatrix::<f64, PLACE, PLACE>::identity() * f64::EPSILON,
    );
    for ((seen, whitener), weight) in fitted.sights.iter().zip(&fitted.whiteners).zip(&fitted.weights) {
        let Some(seen) = seen else { continue };
        let by_shared = whitener * seen.by_shared;
        let mut by_place = SMatrix::<f64, ROWS, PLACE>::zeros();
        by_place.fixed_columns_mut::<3>(0).copy_from(&(whitener * seen.by_shift));
        by_place.fixed_columns_mut::<3>(3).copy_from(&(whitener * seen.turn_about(&middle)));
        own += by_shared.tr_mul(&by_shared) * *weight;
        cross += by_place.tr_mul(&by_shared) * *weight;
        place += by_place.tr_mul(&by_place) * *weight;
    }
    // A straight curve does not determine its turn about itself: this is 1e-6 of the information on a rotation.
    let scale = place.diagonal().map(|d| d.max(f64::MIN_POSITIVE).sqrt());
    let scaled = SMatrix::<f64, PLACE, PLACE>::from_fn(|i, j| place[(i, j)] / (scale[i] * scale[j]));
    let eigen = SymmetricEigen::try_new(scaled, f64::EPSILON, 1000)?;
    let left = SMatrix::<f64, PLACE, SHARED>::from_fn(|i, j| cross[(i, j)] / scale[i]);
    let along = eigen.eigenvectors.transpose() * left;
    let mut information = own;
    for k in 0..PLACE {
        if eigen.eigenvalues[k] > LEAST_PLACE {
            let row = along.row(k);
            information -= row.tr_mul(&row) / eigen.eigenvalues[k];
        }
    }
    Some((information + information.transpose()) * 0.5)
}

/// Directions of the place below this fraction of the largest are rounding errors.
const LEAST_PLACE: f64 = 1e-9;

/// In each direction the weaker of the two.
fn weaker(first: &Shared, second: &Shared) -> Option<Shared> {
    /// Least information of the first, in units of the required information, for a root.
    const LEAST: f64 = 1e-9;
    let units = of_group::<SHARED>(SEEN);
    let scaled = |m: &Shared| Shared::from_fn(|i, j| m[(i, j)] * units[i] * units[j]);
    let root = (scaled(first) + Shared::identity() * LEAST * scaled(first).trace().max(1.0)).cholesky()?.l();
    let half = root.solve_lower_triangular(&scaled(second))?;
    let ratio = root.solve_lower_triangular(&half.transpose())?;
    let eigen = SymmetricEigen::try_new((ratio + ratio.transpose()) * 0.5, f64::EPSILON, 1000)?;
    let least = Shared::from_diagonal(&eigen.eigenvalues.map(|w| w.clamp(0.0, 1.0)));
    let turned = root * eigen.eigenvectors;
    let weaker = turned * least * turned.transpose();
    Some(Shared::from_fn(|i, j| weaker[(i, j)] / (units[i] * units[j])))
}
