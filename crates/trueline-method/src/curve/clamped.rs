//! A part that moved between passes although nothing was stated about it.
//!
//! A robust fit leaves out readings of a moved pass, or bends the curve between the passes. Both look like an answer. So the
//! scan is weighed with and without six numbers for each pass, both times with the errors of robot, sensor, edge and detector
//! integrated out. With r = Zξ + noise beside curve, clock and hand-eye transform, and N, P as in `improved`:
//!
//! ```text
//! J = rss − ξ̂ᵀZᵀWr,  log p = −½ [ν log v + J/v − log|P|],  v = J/ν
//! ```

use crate::config::PartMoves;
use crate::curve::considered::{Considered, Errors, ShapeError};
use crate::curve::fit::Fitted;
use crate::curve::improved::Beside;
use crate::curve::part::pass_count;
use crate::curve::readings::Readings;
use crate::curve::robot;
use crate::curve::solve::{DECISIVE, Finished};
use nalgebra::{DMatrix, DVector};

/// Larger moves are found as well: they cost a few units of log likelihood and gain hundreds.
const USUAL: PartMoves = PartMoves::USUAL;
/// Nobody clamps a part again more often during a scan. More passes are those of a sensor that sways over a short curve.
const MOST_PASSES: usize = 24;
/// Rounds of the noise level.
const ROUNDS: usize = 4;

/// Largest shift of a pass, m, if a moving part is decisively likelier than one at rest. A pass that is left out altogether has no
/// say, and spoils nothing.
#[must_use]
pub(crate) fn moved_by_m(readings: &Readings, finished: &Finished, errors: &Errors<'_>) -> Option<f64> {
    if errors.part.is_some() || pass_count(&finished.fitted) > MOST_PASSES {
        return None;
    }
    let shape = errors.shape.map(|shape| ShapeError { is_estimated: false, ..shape });
    let moving = Errors { part: Some(USUAL), shape, ..*errors };
    let fitted = &finished.fitted;
    let considered = of_all(readings, fitted, &moving);
    let part = considered.iter().position(|one| one.is_estimated)?;
    let Beside { information, score, places, .. } = Beside::of(finished, &considered);
    let place = places[part].clone();
    let squares = fitted.squares();
    let level = (squares, squares / finished.variance);
    let (with, sizes) = evidence(&information, &score, level)?;
    let others: Vec<usize> = (0..score.len()).filter(|k| !place.contains(k)).collect();
    let information = information.select_columns(&others).select_rows(&others);
    let (without, _) = evidence(&information, &score.select_rows(&others), level)?;
    let shift_m = |k: usize| sizes.rows(k, 3).norm() * USUAL.shift_m;
    (with - without > DECISIVE).then(|| place.step_by(6).map(shift_m).fold(0.0, f64::max))
}

/// The considered errors, each at every reading.
fn of_all(readings: &Readings, fitted: &Fitted, errors: &Errors<'_>) -> Vec<Considered> {
    let mut all = errors.at(readings, fitted);
    for one in all.iter_mut().filter(|one| one.moves.every > 1) {
        one.moves = robot::moves(readings, fitted, errors.robot, usize::MAX);
    }
    all
}

/// Log likelihood with the errors integrated out, and their estimates.
fn evidence(
    information: &DMatrix<f64>,
    score: &DVector<f64>,
    (squares, freedom): (f64, f64),
) -> Option<(f64, DVector<f64>)> {
    let size = score.len();
    let (mut variance, mut found) = (squares / freedom, None);
    for _ in 0..ROUNDS {
        let symmetric = (information + information.transpose()) * (0.5 / variance);
        let root = (symmetric + DMatrix::identity(size, size)).cholesky()?;
        let sizes = root.solve(&(score / variance));
        let left = (squares - sizes.dot(score)).max(f64::EPSILON * squares);
        let log = -0.5 * (freedom * variance.ln() + left / variance) - 0.5 * root.ln_determinant();
        found = Some((log, sizes));
        variance = left / freedom;
    }
    found
}
