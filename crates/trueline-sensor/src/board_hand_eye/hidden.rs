//! Directions of time offset and hand-eye transform that the motion does not determine.
//!
//! A robot that means to turn about one axis turns a little about others too, if only by its noise. So a direction is hidden
//! not by its rank, which noise makes full, but by its uncertainty. A direction that is no better known than by a glance at
//! the robot is no result.

use super::unknowns::{HAND_EYE, SIZE, TARGET, TIME_OFFSET};
use nalgebra::{DMatrix, Matrix3, SMatrix, SVector, Vector3};
use trueline_lsq::Information;

/// A time offset is undetermined above this uncertainty, s: the time between two pictures.
pub const MOST_TIME_S: f64 = 0.03;
/// A rotation is undetermined above this uncertainty, rad: 3°.
pub const MOST_TURN_RAD: f64 = 0.05;
/// A translation is undetermined above this uncertainty, m: a ruler is better.
pub const MOST_SHIFT_M: f64 = 0.02;
/// Prior of each unknown, in units of these limits: so wide that it decides nothing.
const BEFOREHAND: f64 = 1e3;
/// Below this part of the best determined direction one is undetermined, at any noise.
const SEEN: f64 = 1e-9;

/// The undetermined directions, and the uncertainty of all.
#[derive(Clone, Debug, PartialEq)]
pub struct Hidden {
    /// Directions that are shown.
    pub rank: usize,
    /// Unknowns that are estimated.
    pub size: usize,
    /// Largest over smallest singular value, columns scaled to length one; infinite if one is zero.
    pub condition: f64,
    /// Whether the time offset is estimated but not determined.
    pub time_offset: bool,
    /// Unit directions in the carrier's axes about which the hand-eye rotation is not determined.
    pub rotation: Vec<Vector3<f64>>,
    /// Unit directions in the carrier's axes along which the hand-eye translation is not determined.
    pub translation: Vec<Vector3<f64>>,
}

impl Hidden {
    /// Whether everything is shown.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        !self.time_offset && self.rotation.is_empty() && self.translation.is_empty()
    }
}

/// Hidden directions of an information matrix, and the covariance of all that is estimated, which is very large along them. `of_time` is the
/// information about the time offset (s⁻², all else being known) that is not noise of the robot's rates.
pub(crate) fn assess(
    information: &SMatrix<f64, SIZE, SIZE>,
    of_time: f64,
    held: &[usize],
) -> Option<(Hidden, SMatrix<f64, SIZE, SIZE>)> {
    let limits = limits();
    let mut scaled = SMatrix::<f64, SIZE, SIZE>::from_fn(|i, j| information[(i, j)] * limits[i] * limits[j]);
    for k in held {
        scaled.row_mut(*k).fill(0.0);
        scaled.column_mut(*k).fill(0.0);
    }
    let beforehand = SMatrix::<f64, SIZE, SIZE>::identity() / (BEFOREHAND * BEFOREHAND);
    if !held.contains(&TIME_OFFSET) {
        let [seems, beside_all_else] =
            [scaled[(TIME_OFFSET, TIME_OFFSET)], of_time * MOST_TIME_S * MOST_TIME_S];
        let explained = seems - schur(&(scaled + beforehand))?;
        let shown = beside_all_else - explained;
        if shown < 1.0 {
            scaled[(TIME_OFFSET, TIME_OFFSET)] = explained + shown.max(0.0);
        }
    }
    let size = SIZE - held.len();
    let rank = scaled.symmetric_eigenvalues().iter().filter(|value| **value > 1.0).count();
    let inverse = (scaled + beforehand).cholesky()?.inverse();
    let is_held = |k: usize| held.contains(&k);
    let covariance = SMatrix::<f64, SIZE, SIZE>::from_fn(|i, j| {
        if is_held(i) || is_held(j) { 0.0 } else { inverse[(i, j)] * limits[i] * limits[j] }
    });
    let all = DMatrix::from_column_slice(SIZE, SIZE, information.as_slice());
    let hidden = Hidden {
        rank,
        size,
        condition: Information::new(&all, held, SEEN)?.condition(),
        time_offset: covariance[(TIME_OFFSET, TIME_OFFSET)] > MOST_TIME_S * MOST_TIME_S,
        rotation: directions(&covariance, HAND_EYE, MOST_TURN_RAD),
        translation: directions(&covariance, HAND_EYE + 3, MOST_SHIFT_M),
    };
    Some((hidden, covariance))
}

/// Information on the time offset if everything else is estimated with it.
fn schur(information: &SMatrix<f64, SIZE, SIZE>) -> Option<f64> {
    Some(information.cholesky()?.inverse()[(TIME_OFFSET, TIME_OFFSET)].recip())
}

fn limits() -> SVector<f64, SIZE> {
    let mut limits = SVector::<f64, SIZE>::repeat(MOST_TIME_S);
    for first in [HAND_EYE, TARGET] {
        limits.fixed_rows_mut::<3>(first).fill(MOST_TURN_RAD);
        limits.fixed_rows_mut::<3>(first + 3).fill(MOST_SHIFT_M);
    }
    limits
}

/// The principal directions of three unknowns with uncertainties above a limit, the worst first; the axes themselves if none
/// is determined.
fn directions(covariance: &SMatrix<f64, SIZE, SIZE>, first: usize, limit: f64) -> Vec<Vector3<f64>> {
    let block: Matrix3<f64> = covariance.fixed_view::<3, 3>(first, first).into();
    let eigen = block.symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let is_hidden = |k: &usize| eigen.eigenvalues[*k] > limit * limit;
    if order.iter().all(is_hidden) {
        return vec![Vector3::x(), Vector3::y(), Vector3::z()];
    }
    let column = |k: usize| -> Vector3<f64> { eigen.eigenvectors.column(k).into() };
    let with_positive_main = |v: Vector3<f64>| if v[v.iamax()] < 0.0 { -v } else { v };
    order.into_iter().filter(is_hidden).map(|k| with_positive_main(column(k))).collect()
}
