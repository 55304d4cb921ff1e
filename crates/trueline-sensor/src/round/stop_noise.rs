//! Noise of the robot at stops, from the residuals of arcs.

use super::model::RoundState;
use super::problem::{RoundProblem, Scan, converged, rounds};
use crate::board_hand_eye::stop_noise::{FEWEST_FREE, ROUNDS, least_part, scaled};
use crate::error::Error;
use trueline_lsq::LeastSquares;

/// Degrees of freedom that a variance takes from the uncertainty of what is estimated beside it: the mean of ν / χ²ᵥ is ν / (ν − 2).
const OF_VARIANCE: f64 = 2.0;

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
    least_part(|part| {
        let noise = scaled(scan.noise, part);
        let problem = RoundProblem::whitened(&Scan { noise: &noise, ..*scan }, at).keeping(used);
        2.0 * problem.cost(at) <= freedom
    })
}
