//! The mirrored attitude, which looks alike while the sensor is not tilted.

use crate::error::Error;
use crate::hypotheses::likelihood_ratio::{LIKELIHOOD_RATIO_LIMIT, noise_advantage};
use crate::problem::parameters::Parameters;
use crate::solve::fit::Fit;
use crate::solve::solver::Solver;
use crate::solve::start::twin;

/// Twins nearer than this have met again in one solution.
const TWIN_TURN_RAD: f64 = 0.02;

/// How the mirrored attitude compares with the one found.
pub enum MirrorComparison {
    /// It does not exist, is the same, or fits worse.
    Worse,
    /// It fits as well: the scan does not tell which is right.
    Equal(Parameters),
    /// It fits better.
    Better(Box<Fit>),
}

/// Follows the mirrored twin of a solution.
///
/// # Errors
/// As [`Solver::fit`].
pub fn mirror_of(solver: &Solver<'_>, fit: &Fit) -> Result<MirrorComparison, Error> {
    let observations = solver.observations;
    let Some(start) = twin(observations, fit.placed.of(observations), fit.parameters()) else {
        return Ok(MirrorComparison::Worse);
    };
    let twin = solver.fit(start)?;
    let advantage = noise_advantage(fit.placed.len(), fit.noise.factor, twin.noise.factor);
    let rotation = |fit: &Fit| fit.parameters().tool_from_camera.rotation;
    let apart = rotation(&twin).angle_to(&rotation(fit));
    Ok(if apart <= TWIN_TURN_RAD {
        // It has fallen back into the same valley.
        MirrorComparison::Worse
    } else if advantage < -LIKELIHOOD_RATIO_LIMIT {
        MirrorComparison::Better(Box::new(twin))
    } else if advantage < LIKELIHOOD_RATIO_LIMIT {
        MirrorComparison::Equal(twin.parameters().clone())
    } else {
        MirrorComparison::Worse
    })
}
