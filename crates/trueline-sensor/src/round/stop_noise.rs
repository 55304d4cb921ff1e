//! Noise of the robot at stops, from the residuals.
//!
//! A stated accuracy bounds all errors of the robot within a scan. Some differ from stop to stop, and the residuals show how large these are. The rest
//! changes slowly over the workspace. With the whole accuracy as both, every error counts twice.

use super::model::RoundState;
use super::problem::{RoundProblem, Scan, converged, rounds};
use crate::board_hand_eye::unknowns::ErrorModel;
use crate::error::Error;
use trueline_lsq::LeastSquares;

/// Least part of the stated errors: the residuals of a few stops may be small by chance.
const LEAST: f64 = 0.05;
/// Rounds of fit and part in turn.
const ROUNDS: usize = 2;
/// Halvings of the part: to a thousandth.
const HALVINGS: usize = 10;
/// Degrees of freedom that a variance takes from the uncertainty of what is estimated beside it: the mean of ν / χ²ᵥ is ν / (ν − 2).
const OF_VARIANCE: f64 = 2.0;
/// Fewer degrees of freedom leave the errors as stated.
const FEWEST_FREE: f64 = 12.0;

/// The same errors times a part.
pub(super) fn scaled(noise: &ErrorModel, part: f64) -> ErrorModel {
    ErrorModel { position_m: part * noise.position_m, rotation_rad: part * noise.rotation_rad, ..*noise }
}

/// The part of the stated errors that explains the residuals of the fit from a start, at most 1; 1 of a robot that moves.
pub(super) fn part(scan: &Scan<'_>, start: &RoundState) -> Result<f64, Error> {
    let mut part = 1.0;
    if scan.robot.stops().is_empty() {
        return Ok(part);
    }
    for _ in 0..ROUNDS {
        let noise = scaled(scan.noise, part);
        let (state, problem) = converged(&Scan { noise: &noise, ..*scan }, *start, rounds())?;
        part = explaining(scan, &state, &problem.used);
    }
    Ok(part)
}

/// The part that explains the residuals of an answer.
fn explaining(scan: &Scan<'_>, at: &RoundState, used: &[bool]) -> f64 {
    let counting = used.iter().filter(|used| **used).count();
    let freedom = scan.freedom(counting) - OF_VARIANCE;
    if freedom < FEWEST_FREE {
        return 1.0;
    }
    let is_enough = |part: f64| {
        let noise = scaled(scan.noise, part);
        let problem = RoundProblem::whitened(&Scan { noise: &noise, ..*scan }, at).keeping(used);
        2.0 * problem.cost(at) <= freedom
    };
    let (mut low, mut high) = (LEAST, 1.0);
    if is_enough(low) {
        return low;
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if is_enough(middle) { high = middle } else { low = middle }
    }
    high
}
