//! Estimates the size of each block from the scan: MacKay's fixed point \[MacKay1992\].

use crate::adjustment::blocks::{Block, Kind};
use crate::adjustment::equations::{Equations, Prior, Solved};
use nalgebra::DVector;

/// Weight of a block's expected size, in pseudo-observations. A block without information keeps its expected size.
const EXPECTED: f64 = 3.0;
/// Rounds in which amplitudes and coefficients follow each other.
const ROUNDS: usize = 3;
/// An amplitude changes by no more than this factor in a round.
const FASTEST: f64 = 10.0;
/// Degrees of freedom of the coefficients of a form. A tack is an outlier among them.
const FORM_FREEDOM: f64 = 3.0;
/// Least and largest own variance of a form's column, relative to the block's.
const OWN: [f64; 2] = [0.3, 200.0];

/// Updates the amplitudes from the scan. `prior` is that of the current blocks.
pub(crate) fn follow(
    blocks: &mut [Block],
    equations: &Equations,
    prior: impl Fn(&[Block]) -> Prior,
) -> Option<Solved> {
    let mut solved = equations.solve(&prior(blocks))?;
    for _ in 0..ROUNDS {
        if !blocks.iter().any(|block| block.amplitude.is_free()) {
            break;
        }
        let variances = solved.variances();
        for block in blocks.iter_mut().filter(|block| block.amplitude.is_free()) {
            update(block, &solved, &variances);
        }
        solved = equations.solve(&prior(blocks))?;
    }
    Some(solved)
}

fn update(block: &mut Block, solved: &Solved, variances: &DVector<f64>) {
    let (mut square, mut shown) = (EXPECTED, EXPECTED);
    let theta = block.amplitude.theta;
    for (k, column) in block.columns.clone().enumerate() {
        square += solved.step[column].powi(2) / block.own[k];
        shown += 1.0 - variances[column] / (theta * block.own[k]);
    }
    let [least, most] = block.amplitude.bounds;
    let wanted = (square / shown.max(f64::MIN_POSITIVE)).clamp(theta / FASTEST, theta * FASTEST);
    block.amplitude.theta = wanted.clamp(least, most);
    if let Kind::Form { .. } = block.kind {
        for (k, column) in block.columns.clone().enumerate() {
            let own = (solved.step[column].powi(2) + variances[column]) / block.amplitude.theta;
            block.own[k] = ((own + FORM_FREEDOM) / (1.0 + FORM_FREEDOM)).clamp(OWN[0], OWN[1]);
        }
    }
}
