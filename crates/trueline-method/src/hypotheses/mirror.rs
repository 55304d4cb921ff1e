//! The mirrored attitude, which is indistinguishable as long as the sensor is not tilted.

use crate::error::Error;
use crate::hypotheses::paired_test::compare;
use crate::problem::parameters::Parameters;
use crate::solve::fit::Fit;
use crate::solve::settings::FitSettings;
use crate::solve::solver::Solver;
use crate::solve::start::mirrored;

/// Twins nearer than this have converged to one solution.
const TWIN_TURN_RAD: f64 = 0.02;

/// Comparison of the mirrored attitude with the one found.
pub(crate) enum MirrorComparison {
    /// It does not exist, is the same, or fits worse.
    Worse,
    /// It fits as well if the sensor may differ from its file, and worse if not.
    WorseIfSensorIsExact(Box<Fit>),
    /// It fits equally well: the scan cannot separate them.
    Equal(Box<Fit>),
    /// It fits better.
    Better(Box<Fit>),
}

/// Follows the mirror image of a solution.
///
/// # Errors
/// As [`Solver::fit`].
pub(crate) fn mirror_of(solver: &Solver<'_>, fit: &Fit) -> Result<MirrorComparison, Error> {
    let observations = solver.observations;
    let Some(start) = mirrored(observations, fit.placed.of(observations), fit.parameters()) else {
        return Ok(MirrorComparison::Worse);
    };
    let Some(mirror) = followed(solver, fit, start.clone())? else { return Ok(MirrorComparison::Worse) };
    // Too few frames have no information.
    let test = compare(observations, solver.settings.config, fit, &mirror);
    if test.is_some_and(|test| test.decided()) {
        return Ok(MirrorComparison::Worse);
    }
    if test.is_some_and(|test| test.reversed()) {
        return Ok(MirrorComparison::Better(Box::new(mirror)));
    }
    let mirror = Box::new(mirror);
    if solver.settings.shape_prior.is_none() {
        return Ok(MirrorComparison::Equal(mirror));
    }
    let exact = Solver { settings: FitSettings { shape_prior: None, ..solver.settings }, ..*solver };
    let here = exact.fit(Parameters::straight(&fit.parameters().guess(), fit.parameters().lines.clone()))?;
    let there = followed(&exact, &here, start)?;
    let is_worse = |there: Fit| {
        compare(observations, solver.settings.config, &here, &there).is_some_and(|test| test.decided())
    };
    let told = are_one(fit, &here) && there.is_some_and(is_worse);
    Ok(if told { MirrorComparison::WorseIfSensorIsExact(mirror) } else { MirrorComparison::Equal(mirror) })
}

/// The solution from a start. `None` if it converges to the known one.
fn followed(solver: &Solver<'_>, fit: &Fit, start: Parameters) -> Result<Option<Fit>, Error> {
    let rough = solver.fit(start)?;
    if are_one(fit, &rough) {
        return Ok(None);
    }
    let test = compare(solver.observations, solver.settings.config, fit, &rough);
    if test.is_some_and(|test| test.is_far_worse()) {
        return Ok(Some(rough));
    }
    let end = solver.converge(&rough)?;
    Ok((!are_one(fit, &end)).then_some(end))
}

fn are_one(fit: &Fit, other: &Fit) -> bool {
    let rotation = |fit: &Fit| fit.parameters().tool_from_camera.rotation;
    rotation(fit).angle_to(&rotation(other)) <= TWIN_TURN_RAD
}
