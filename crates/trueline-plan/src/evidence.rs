//! Joint information of frames: their whitened residuals, with the derivatives by everything that moves them.

use crate::covariances::{in_si, inverse};
use crate::criterion::SensorCovariance;
use crate::prediction::Prediction;
use nalgebra::{Const, DMatrix, Dyn, Matrix2, OMatrix, SMatrix};
use std::collections::BTreeMap;

/// The whitened residuals of a frame.
#[derive(Clone, Debug)]
pub(crate) struct FrameRows<const ROWS: usize, const N: usize> {
    /// Index of the frame among the sights.
    pub sight: usize,
    /// Share of the cells that see it like this.
    pub share: f64,
    /// By the unknowns.
    pub columns: SMatrix<f64, ROWS, N>,
    /// By a shift along the picture's rows and across them, px.
    pub by_px: SMatrix<f64, ROWS, 2>,
    /// By a displacement of the robot in base, m.
    pub by_shift: SMatrix<f64, ROWS, 3>,
    /// By a turn of the robot in base, rad.
    pub by_turn: SMatrix<f64, ROWS, 3>,
    /// By the numbers of the external axes, in units of their priors; no columns without axes.
    pub by_axes: OMatrix<f64, Const<ROWS>, Dyn>,
    /// Piece of a curved seam of unknown form, and the derivatives by its place square to the seam; `None` for a straight seam.
    pub piece: Option<(usize, SMatrix<f64, ROWS, 2>)>,
}

/// The frames of a scan. Unknowns are the required ones, then the form of the seam or plates, then the sensor's shape.
#[derive(Clone, Debug)]
pub(crate) struct Evidence<const ROWS: usize, const N: usize> {
    /// Each frame; more than one for a frame that some cells see less of.
    pub frames: Vec<FrameRows<ROWS, N>>,
    /// Number of frames that each represents.
    pub stride: f64,
    /// Number of required unknowns.
    pub asked: usize,
    /// Start of the sensor's shape.
    pub shape: usize,
    /// Prior information of each number of the form: one over its variance.
    pub known_of_form: f64,
    /// Required unknowns that are held fixed, because nothing determines them.
    pub held: Vec<usize>,
    /// Prior standard deviations of the numbers of the external axes, SI.
    pub axis_sigmas: Vec<f64>,
}

/// Prior information of the place of a piece: one over its variance, 1/m², for a standard deviation of 0.1 m.
const KNOWN_OF_PIECE: f64 = 100.0;

/// Information of a number held fixed: one over its variance.
pub(crate) const HELD: f64 = 1e150;

impl<const ROWS: usize, const N: usize> Evidence<ROWS, N> {
    /// Information of the first `until` sights on everything but the shape, K unknowns, including the prior of the form.
    fn told<const K: usize>(&self, until: usize) -> SMatrix<f64, K, K> {
        let mut information = SMatrix::<f64, K, K>::zeros();
        let mut pieces: BTreeMap<usize, (Matrix2<f64>, SMatrix<f64, 2, K>)> = BTreeMap::new();
        for frame in self.frames.iter().filter(|frame| frame.sight < until) {
            let rows = frame.columns.fixed_columns::<K>(0);
            add_square(&mut information, &rows.transpose(), frame.share);
            if let Some((piece, by_place)) = &frame.piece {
                let (own, cross) = pieces.entry(*piece).or_insert((Matrix2::zeros(), SMatrix::zeros()));
                *own += by_place.tr_mul(by_place) * frame.share;
                *cross += by_place.tr_mul(&rows) * frame.share;
            }
        }
        information.fill_lower_triangle_with_upper_triangle();
        for (own, cross) in pieces.values() {
            // A piece that is seen in one frame only gives hardly any information.
            let inverse = (own + Matrix2::identity() * KNOWN_OF_PIECE).try_inverse().unwrap_or_default();
            information -= cross.tr_mul(&(inverse * cross));
        }
        let mut told = information * self.stride;
        (self.asked..self.shape).for_each(|k| told[(k, k)] += self.known_of_form);
        told
    }

    /// The same with the external axes behind, and their priors.
    fn told_with_axes<const K: usize>(&self, until: usize) -> DMatrix<f64> {
        let plain = self.told::<K>(until);
        let axes = self.axis_sigmas.len();
        let mut told = DMatrix::identity(K + axes, K + axes);
        told.view_mut((0, 0), (K, K)).copy_from(&plain);
        if axes == 0 {
            return told;
        }
        let mut own = DMatrix::zeros(axes, axes);
        let mut cross = DMatrix::zeros(axes, K);
        for frame in self.frames.iter().filter(|frame| frame.sight < until) {
            let weight = frame.share * self.stride;
            own.gemm_tr(weight, &frame.by_axes, &frame.by_axes, 1.0);
            cross.gemm_tr(weight, &frame.by_axes, &frame.columns.fixed_columns::<K>(0), 1.0);
        }
        let mut behind = told.view_mut((K, K), (axes, axes));
        behind += own;
        told.view_mut((K, 0), (axes, K)).copy_from(&cross);
        told.view_mut((0, K), (K, axes)).copy_from(&cross.transpose());
        told
    }

    /// A fast covariance of clock and hand-eye, and of the external axes, with an exact sensor; `None` if
    /// something is not determined at all.
    pub(crate) fn covariance<const K: usize>(&self) -> Option<(SensorCovariance, DMatrix<f64>)> {
        let axes = self.axis_sigmas.len();
        if axes > 0 {
            let inverse = inverse(&self.told_with_axes::<K>(usize::MAX))?;
            let of_axes = in_si(&inverse, &self.axis_sigmas);
            return Some((SensorCovariance::from_fn(|i, j| inverse[(i, j)]), of_axes));
        }
        let mut told = self.told::<K>(usize::MAX);
        self.held.iter().for_each(|&k| told[(k, k)] += HELD);
        let scale = told.diagonal().map(|d| 1.0 / d.max(f64::MIN_POSITIVE).sqrt());
        let scaled = SMatrix::<f64, K, K>::from_fn(|i, j| told[(i, j)] * scale[i] * scale[j]);
        let inverse = scaled.cholesky()?.inverse();
        let own = SensorCovariance::from_fn(|i, j| inverse[(i, j)] * scale[i] * scale[j]);
        Some((own, DMatrix::zeros(0, 0)))
    }

    /// Prediction from the first sights, with an exact sensor; `None` if it is not finite.
    pub(crate) fn prediction<const K: usize>(&self, until: usize) -> Option<Prediction> {
        Prediction::of(&self.told_with_axes::<K>(until), &self.held, self.asked, &self.axis_sigmas)
    }
}

/// Adds J Jᵀ w to the upper half of a symmetric sum; J has a column for each residual.
pub(crate) fn add_square<const ROWS: usize, const N: usize>(
    sum: &mut SMatrix<f64, N, N>,
    rows: &SMatrix<f64, N, ROWS>,
    weight: f64,
) {
    for (j, mut column) in sum.column_iter_mut().enumerate() {
        let by: [f64; ROWS] = std::array::from_fn(|row| rows[(j, row)]);
        for (i, sum) in column.iter_mut().take(j + 1).enumerate() {
            let product = (1..ROWS).fold(rows[(i, 0)] * by[0], |sum, row| sum + rows[(i, row)] * by[row]);
            *sum += product * weight;
        }
    }
}
